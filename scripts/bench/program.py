"""Part `start`: the command line, beside an interpreter that only imports numpy."""

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from runs import ROOT

from .table import Line, compare, interleave

PROGRAM = Path(sys.executable).with_name("parcontact")
TINY = ROOT / "jobs" / "westergaard.yaml"


def start(_: int, rounds: int, __: argparse.Namespace) -> Iterator[Line]:
    """Wall times; the tiny job has five static solves on 1024 x 4 points."""
    with tempfile.TemporaryDirectory() as directory:
        out = Path(directory, "out")
        commands = {
            "import numpy": [sys.executable, "-c", "import numpy"],
            "parcontact --help": [PROGRAM, "--help"],
            "parcontact --version": [PROGRAM, "--version"],
            "parcontact check": [PROGRAM, "check", TINY],
            "a tiny job": [PROGRAM, TINY, "--quiet", "--restart", "never", "--out", out],
            "parcontact info": [PROGRAM, "info", out],
        }
        run = partial(subprocess.run, check=True, capture_output=True)
        calls = {name: partial(run, words) for name, words in commands.items()}
        yield from compare(interleave(calls, rounds, time.perf_counter, before=0), "import numpy")

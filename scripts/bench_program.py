"""Part `start` of scripts/bench.py: the command line, beside an interpreter that only imports numpy."""

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from bench_lines import Line, compare, interleave

PROGRAM = Path(sys.executable).with_name("parcontact")
TINY = Path(__file__).resolve().parents[1] / "jobs" / "westergaard.yaml"


def start(_: int, rounds: int, __: argparse.Namespace) -> Iterator[Line]:
    """Wall times; the tiny job has five static solves on 1024 x 4 points."""
    with tempfile.TemporaryDirectory() as directory:
        out = Path(directory, "out")
        ways = {
            "import numpy": [sys.executable, "-c", "import numpy"],
            "parcontact --help": [PROGRAM, "--help"],
            "parcontact --version": [PROGRAM, "--version"],
            "parcontact check": [PROGRAM, "check", TINY],
            "a tiny job": [PROGRAM, TINY, "--quiet", "--restart", "never", "--out", out],
            "parcontact info": [PROGRAM, "info", out],
        }
        calls = {name: partial(subprocess.run, words, check=True, capture_output=True) for name, words in ways.items()}
        yield from compare("start", interleave(calls, rounds, time.perf_counter, before=0), "import numpy")

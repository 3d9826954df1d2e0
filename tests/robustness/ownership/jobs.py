"""A short run, what it leaves, and exit codes, for tests of whose an output directory is."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import short_job
import yaml

JOB: dict[str, Any] = {
    **short_job.JOB,
    "history": [{"pressure": 1e4, "velocity": 0.1, "distance": 6.25e-4, "cells_per_step": 1}],
    "output": {"fields": ["pressure"]},
    "checkpoint": {"every": 1, "keep": 100},
}
STEPS = 11  # a jump and 10 cells
DONE, FAILED, BAD_INPUT, AGAIN = 0, 1, 2, 3
Main = Callable[..., tuple[int, str]]
Contents = dict[str, bytes]


def write_job(path: Path, **changes: Any) -> Path:
    """A file of JOB with some sections exchanged."""
    path.write_text(yaml.safe_dump({**JOB, **changes}))
    return path


def contents(directory: Path) -> Contents:
    """All files of a directory but the marker."""
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in sorted(directory.rglob("*"))
        if path.is_file() and path.name != ".parcontact"
    }


def steps(out: Path) -> list[int]:
    """The steps of which a run has written rows."""
    lines = (out / "measures.csv").read_text().splitlines()[1:]
    return [int(line.split(",")[0]) for line in lines]

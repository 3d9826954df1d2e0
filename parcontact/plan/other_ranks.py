"""A job tried by other numbers of ranks of this machine, which are started for it."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory

from .. import progress
from ..job import Job
from .sample import Sample, StageCost

MPIRUN = Path(sys.executable).with_name("mpirun")
MARKS = ("OMPI_", "PMIX_", "PRTE_", "PMI_")  # what MPI has left in the environment would confuse another mpirun
MAX_SECONDS_LATE = 60.0  # beyond three times those that a trial is given


def samples(job: Job, words: Sequence[str], ranks: Sequence[int], seconds: float) -> Iterator[Sample]:
    """Samples of the job that was tried here on some numbers of ranks, as far as they can be had.

    `words` name the whole job and change it; all try it on the grid on which it was tried here: only so can times be
    compared.
    """
    words = [*words, "--seconds", repr(seconds), "--sample-points", ",".join(map(str, job.grid.points))]
    for count in progress.shown(ranks, "trying the job on more ranks", "number of ranks"):
        with TemporaryDirectory() as directory:
            found = _attempt(job, words, count, Path(directory, "sample"), seconds)
        if found:
            yield found


def _attempt(job: Job, words: Sequence[str], ranks: int, path: Path, seconds: float) -> Sample | None:
    program = [sys.executable, "-P", "-m", "parcontact", "plan", *words, "--sample", str(path)]
    clean = {key: value for key, value in os.environ.items() if not key.startswith(MARKS)}
    began = time.perf_counter()
    try:
        command = [str(MPIRUN), "-n", str(ranks), *program]
        subprocess.run(command, env=clean, capture_output=True, timeout=3 * seconds + MAX_SECONDS_LATE, check=True)
        whole = time.perf_counter() - began
        return load(path, job, whole)
    except (OSError, subprocess.SubprocessError, ValueError, KeyError, TypeError):
        return None


def save(path: Path, sample: Sample) -> None:
    """Leave a sample where `load` finds it."""
    facts = {name: getattr(sample, name) for name in ("ranks", "building", "took", "resident", "held", "share")}
    path.write_text(json.dumps({**facts, "stages": [asdict(stage) for stage in sample.stages]}))


def load(path: Path, job: Job, whole: float) -> Sample:
    """The sample of a job that a program left which took so many seconds; what it did not try for was its start."""
    facts = json.loads(path.read_text())
    stages = tuple(StageCost(**stage) for stage in facts.pop("stages"))
    return Sample(job=job, starting=whole - facts["took"], stages=stages, **facts)

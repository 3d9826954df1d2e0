#!/usr/bin/env python3
"""Jobs and files that nobody would write: each must run, or end in a sentence, soon, in little memory, without a trace.

    .venv/bin/python scripts/fuzz_jobs.py [--jobs 2000] [--seed 0] [--only NUMBER] [--processes 60]

A third of the jobs are texts with characters changed, cut, doubled or put in; a third sound jobs with some values
changed to extreme ones or to values of another kind; a third sound jobs with a file of heights, or a job file, that is
damaged, of another type or length, no regular file, or leads elsewhere. All are driven in this process: read,
described, planned, built, and marched a few steps. Some are run as whole processes too, on one rank and on two. Counted
as faults: exceptions other than those that say a sentence, more than 3 s of CPU time to refuse, files left after a
refusal, results that are not finite, and more than 1 GB. Ends with 0 if there are none. Crashes inside the HDF5
library, which no caller can catch, are counted apart.
"""

import contextlib
import io
import math
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

import campaign
import numpy as np
import runs
from hostile_jobs import write_job

from parcontact import job as jobs
from parcontact.errors import InputError, RunError
from parcontact.history.timeline import Timeline
from parcontact.job.text import yamltext
from parcontact.scene import sanity

CPU_SECONDS = 3.0  # to refuse a job
HANG_SECONDS = 20.0  # of CPU time for all that is done with a job in this process
WALL_SECONDS = 120.0  # of a process, on a machine that may be busy
BYTES = 1e9
POINTS = 2**14  # of a grid that is built here
STEPS = 3  # that are made of a history


class HangError(Exception):
    """More CPU time than anything here may take."""


def drive(path: Path) -> tuple[str, jobs.Job | None]:
    """Do with a job in this process what the program would do: how it ended, and the job if it can be run."""
    began = time.process_time()
    try:
        job = jobs.load_cases(path)[0].job
    except InputError as error:
        if not 0 < len(str(error).strip()) <= 50_000:
            raise AssertionError(f"a message of {len(str(error))} characters") from error
        if (spent := time.process_time() - began) > CPU_SECONDS:
            raise HangError(f"{spent:.1f} s to refuse it") from error
        return "refused", None
    jobs.describe(job)
    again = jobs.Job.model_validate(yamltext.parse(job.resolved(), "resolved").data, context=None)
    assert again.material == job.material or job.included, "the resolved job is another one"
    assert again.title == job.title, "the resolved job has another title"
    timeline = Timeline.of(job)
    _ = job.warnings, [timeline[n] for n in {1, timeline.count // 2, timeline.count} if 1 <= n <= timeline.count]
    try:
        sanity.refuse_impossible(job, timeline)
        if job.grid.nx * job.grid.ny > POINTS:
            return "large", None
        marching = runs.begun(job)
        sanity.check_heights(marching.scene.setup)
        watch = sanity.ContactWatch(job.numerics.strict, timeline)
        for step, _ in zip(timeline, range(STEPS), strict=False):
            m = marching.advance(step).measures
            watch.judge(step.number, m)
            values = (m.pressure, m.force_x, m.friction, m.contact_area, m.approach, m.mean_gap, m.max_pressure)
            assert all(map(math.isfinite, values)), f"not finite: {m}"
    except InputError:
        return "refused", None
    except RunError:
        return "failed to run", job
    return "ran", job


def run_process(path: Path, ranks: int) -> Iterator[str]:
    """Faults of the program with a job as a process."""
    mpirun = [str(Path(sys.executable).with_name("mpirun")), "-n", str(ranks)] if ranks > 1 else []
    before, spent = listing(path.parent), resource.getrusage(resource.RUSAGE_CHILDREN)
    words = [*mpirun, sys.executable, "-m", "parcontact", path.name, "--quiet", "--wall", "20", "--out", "out"]
    run = partial(subprocess.run, capture_output=True, text=True, errors="replace", timeout=WALL_SECONDS)
    try:
        done = run(words, cwd=path.parent, env=runs.environment())
    except subprocess.TimeoutExpired:
        yield f"hangs on {ranks} ranks"
        return
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in (0, 1, 2, 3) or "Traceback" in done.stderr:
        yield f"exit {done.returncode} on {ranks} ranks: {done.stderr[-500:]!r}"
    if done.returncode == 2:
        seconds = (after.ru_utime + after.ru_stime - spent.ru_utime - spent.ru_stime) / ranks
        if seconds > CPU_SECONDS:
            yield f"{seconds:.1f} s of CPU time per rank to refuse it on {ranks} ranks"
        if listing(path.parent) != before:
            yield f"wrote {listing(path.parent) - before} after a refusal on {ranks} ranks"


def listing(directory: Path) -> set[str]:
    return {str(path) for path in directory.rglob("*")}


def survives(path: Path) -> bool:
    """Whether the HDF5 library survives the file of a job, tried in a child: bytes changed by chance can crash it."""
    child = os.fork()
    if child == 0:
        with contextlib.suppress(BaseException), open(os.devnull, "w") as nowhere:
            os.dup2(nowhere.fileno(), 2)
            drive(path)
        os._exit(0)
    return not os.WIFSIGNALED(os.waitpid(child, 0)[1])


@contextlib.contextmanager
def bounded() -> Iterator[None]:
    """Raise HangError after too much CPU time, or wall time."""

    def stop(*_: Any) -> None:
        raise HangError(f"more than {HANG_SECONDS:g} s of CPU time")

    timers = ((signal.SIGPROF, signal.ITIMER_PROF, HANG_SECONDS), (signal.SIGALRM, signal.ITIMER_REAL, WALL_SECONDS))
    for number, timer, seconds in timers:
        signal.signal(number, stop)
        signal.setitimer(timer, seconds)
    try:
        yield
    finally:
        for _, timer, _ in timers:
            signal.setitimer(timer, 0.0)


def trial(seed: int, every: int, counts: Counter[str], number: int) -> Iterator[str]:
    """Faults of one job."""
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        path = write_job(Random(f"{seed} {number}"), Path(name))
        before = listing(Path(name))
        if path.with_name("road.h5").is_file() and not survives(path):
            counts["crashed in libhdf5"] += 1
            return
        with bounded(), contextlib.redirect_stdout(io.StringIO()), np.errstate(all="ignore"):
            ended, job = drive(path)
        counts[ended] += 1
        if ended == "refused" and listing(Path(name)) != before:
            yield f"wrote {listing(Path(name)) - before}"
        small = job is not None and Timeline.of(job).count <= 200
        if every and number % every == 0 and (ended == "refused" or small):
            counts["as processes"] += 1
            for ranks in (1, 2):
                yield from run_process(path, ranks)


def main() -> int:
    options = campaign.parser(__doc__, 2000, "jobs", processes=(60, "how many of them are run as processes too"))
    asked, counts = options.parse_args(), Counter[str]()
    every = max(1, asked.trials // asked.processes) if asked.processes else 0
    faulty = campaign.go(asked, partial(trial, asked.seed, every, counts), counts)
    peak = 1024.0 * max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    print(f"at most {peak / 1e6:.0f} MB")
    return 1 if faulty or peak > BYTES else 0


if __name__ == "__main__":
    sys.exit(main())

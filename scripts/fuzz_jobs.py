#!/usr/bin/env python3
"""Jobs and files that nobody would write: each must run, or end in a sentence, soon, in little memory, without a trace.

    .venv/bin/python scripts/fuzz_jobs.py [--jobs 2000] [--seed 0] [--from 0] [--processes 60]

A quarter of the jobs are texts with characters changed, cut, doubled or put in; a quarter sound jobs with some values
changed to extreme ones or to values of another kind; a quarter sound jobs with a surface or a job file that is damaged,
no regular file, or leads elsewhere; a quarter measured maps that are damaged, of other types, or of odd lengths. All
are driven in this process: read, described, planned, built, and marched a few steps. Some are run as whole processes
too, on one rank and on two. Counted as faults: exceptions other than those that say a sentence, more than 3 s of CPU
time to refuse, files left after a refusal, results that are not finite, and more than 1 GB. Each is printed with its
number; `--from NUMBER --jobs 1` with the same seed makes it again. Ends with 0 if there are none. Crashes inside the
HDF5 library, which no caller can catch, are counted apart.
"""

import argparse
import contextlib
import io
import math
import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import outside
from hostile_jobs import write_job
from mpi4py import MPI

from parcontact import job as jobs
from parcontact import scene
from parcontact.errors import InputError, RunError
from parcontact.history.timeline import Timeline
from parcontact.job.text import yamltext
from parcontact.march.loop import March
from parcontact.parallel.slab import Slab
from parcontact.scene import sanity

CPU_SECONDS = 3.0  # to refuse a job
HANG_SECONDS = 20.0  # of CPU time for all that is done with a job in this process
WALL_SECONDS = 120.0  # of a process, on a machine that may be busy
BYTES = 1e9
POINTS = 2**14  # of a grid that is built here
STEPS = 3  # that are made of a history


class HangError(Exception):
    """More CPU time than anything here may take."""


# -- driving them -----------------------------------------------------------------------------------------------------


def drive(path: Path) -> tuple[str, jobs.Job | None]:
    """Do with a job in this process what the program would do: how it ended, and the job if it can be run."""
    began = time.process_time()
    try:
        job = jobs.load_cases(path)[0].job
    except InputError as error:
        spent = time.process_time() - began
        if not str(error).strip() or len(str(error)) > 50_000:
            raise AssertionError(f"a message of {len(str(error))} characters") from error
        if spent > CPU_SECONDS:
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
        assert scene.choices(job).effects
        built = scene.build(job, Slab(MPI.COMM_SELF, *job.grid.points))
        sanity.check_heights(built.setup)
    except InputError:
        return "refused", None
    return march(job, built), job


def march(job: jobs.Job, built: scene.Scene) -> str:
    marching, watch = March(built), sanity.ContactWatch(job.numerics.strict, Timeline.of(job))
    try:
        for step, _ in zip(Timeline.of(job), range(STEPS), strict=False):
            m = marching.advance(step).measures
            watch.judge(step.number, m)
            values = (m.pressure, m.force_x, m.friction, m.contact_area, m.approach, m.mean_gap, m.max_pressure)
            assert all(map(math.isfinite, values)), f"not finite: {m}"
    except RunError:
        return "run failed"
    return "ran"


def run_process(path: Path, ranks: int) -> Iterator[str]:
    """Faults of the program with a job as a process."""
    mpirun = [str(Path(sys.executable).with_name("mpirun")), "-n", str(ranks)] if ranks > 1 else []
    before = listing(path.parent)
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [*mpirun, sys.executable, "-m", "parcontact", path.name, "--quiet", "--wall", "20", "--out", "out"]
    try:
        done = subprocess.run(
            command,
            cwd=path.parent,
            env=outside.environment(),
            capture_output=True,
            text=True,
            timeout=WALL_SECONDS,
            errors="replace",
        )
    except subprocess.TimeoutExpired:
        yield f"hangs on {ranks} ranks"
        return
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in (0, 1, 2, 3) or "Traceback" in done.stderr:
        yield f"exit {done.returncode} on {ranks} ranks: {done.stderr[-500:]}"
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
def bounded(seconds: float) -> Iterator[None]:
    """Raise HangError after so much CPU time."""

    def stop(*_: Any) -> None:
        raise HangError(f"more than {seconds:g} s of CPU time")

    signal.signal(signal.SIGPROF, stop)
    signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    signal.setitimer(signal.ITIMER_REAL, WALL_SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def trial(seed: int, number: int, counts: Counter[str], processes: bool) -> list[str]:
    """Faults of one job."""
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        path = write_job(Random(f"{seed} {number}"), Path(name))
        before = listing(Path(name))
        try:
            if path.with_name("road.h5").is_file() and not survives(path):
                counts["crashed in libhdf5"] += 1
                return []
            with bounded(HANG_SECONDS), contextlib.redirect_stdout(io.StringIO()), np.errstate(all="ignore"):
                ended, job = drive(path)
        except Exception as error:
            where = traceback.extract_tb(error.__traceback__)[-1]
            return [f"{type(error).__name__}: {str(error)[:300]} ({Path(where.filename).name}:{where.lineno})"]
        counts[ended] += 1
        faults = (
            [f"wrote {listing(Path(name)) - before}"] if ended == "refused" and listing(Path(name)) != before else []
        )
        small = job is not None and Timeline.of(job).count <= 200
        if processes and (ended == "refused" or small):
            counts["as processes"] += 1
            faults += [fault for ranks in (1, 2) for fault in run_process(path, ranks)]
        return faults


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--from", type=int, default=0, dest="first", metavar="NUMBER")
    parser.add_argument("--processes", type=int, default=60, help="how many of them are run as processes too")
    options = parser.parse_args()
    each = max(1, options.jobs // options.processes) if options.processes else 0
    counts: Counter[str] = Counter()
    print(f"seed {options.seed}, jobs {options.first} to {options.first + options.jobs - 1}")
    faulty = 0
    for number in range(options.first, options.first + options.jobs):
        faults = trial(options.seed, number, counts, bool(each) and (number - options.first) % each == 0)
        for fault in faults:
            print(f"job {number}: {re.sub(chr(10), ' | ', fault)}", flush=True)
        faulty += bool(faults)
        if (number + 1 - options.first) % 200 == 0:
            print(f"{number + 1 - options.first:6} jobs, {faulty} with faults", flush=True)
    peak = 1024.0 * max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    ended = ", ".join(f"{name} {count}" for name, count in sorted(counts.items()))
    print(f"{options.jobs} jobs: {faulty} with faults; {ended}; at most {peak / 1e6:.0f} MB")
    return 1 if faulty or peak > BYTES else 0


if __name__ == "__main__":
    sys.exit(main())

"""The beginning of run.log: facts about the machine and the program, for diagnosis."""

import os
import platform
import shlex
import socket
import sys
from collections.abc import Iterator

from ..parallel.mpi import MPI
from .provenance import PROGRAM

BATCH_JOBS = ("SLURM_JOB_ID", "PBS_JOBID", "LSB_JOBID", "JOB_ID")
GIGABYTE = 1e9


def lines(comm: MPI.Intracomm) -> Iterator[str]:
    """Yield version, host, command, MPI, ranks, batch job, and numbers of the machine."""
    words = [os.path.basename(sys.argv[0]), *sys.argv[1:]]
    yield f"{PROGRAM} on {socket.gethostname()}, process {os.getpid()}: {shlex.join(words)}"
    yield f"in {os.getcwd()}"
    library = MPI.Get_library_version().splitlines()[0].strip(" \0")
    yield f"{comm.size} rank{'s' if comm.size > 1 else ''}, {library}; Python {platform.python_version()}"
    if found := [f"{name} = {os.environ[name]}" for name in BATCH_JOBS if os.environ.get(name)]:
        yield f"batch job: {', '.join(found)}"
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / GIGABYTE
    load = ", ".join(f"{value:.2f}" for value in os.getloadavg())
    cores = len(os.sched_getaffinity(0))
    yield f"machine: {processor()}, {cores} of {os.cpu_count()} cores, {memory:.3g} GB of memory, load {load}"


def processor() -> str:
    try:
        with open("/proc/cpuinfo") as file:
            return next(line.partition(":")[2].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()

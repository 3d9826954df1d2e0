"""Provenance of files, and the header of a log.

* Provenance in HDF5 files: the runs that made a file, and the references to cite.
* Beginning of run.log: facts about the machine and the program, for diagnosis.
"""

import json
import os
import platform
import shlex
import socket
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..parallel.mpi import MPI
from ..text_tables import OWN_FORMATS

PROGRAM = f"parcontact {__version__}"
LIBRARIES = ("numpy", "pyfftw", "mpi4py", "h5py", "numba")
REFERENCES = Path(__file__).with_name("references.txt")  # references for the method and its parts
BUDGET = "error_budget"
LEFT_OUT = "(too long to be kept)"
WARNING_BYTES = 4_000  # tuning
BUDGET_BYTES = 1_000  # tuning
CHAIN_BYTES = 50_000  # tuning: largest text of a chain, an attribute of fixed size that can be updated [bytes]


@dataclass(frozen=True)
class Link:
    """One run in a chain of restarts: its resolved job, and the step from which it continued.

    Several runs in a row with the same job, ranks and program are one link; `runs` is their number.
    """

    job: str
    ranks: int
    from_step: int = 0
    runs: int = 1
    program: str = PROGRAM
    started: str = field(default_factory=lambda: datetime.now(UTC).isoformat(timespec="seconds"))


@dataclass(frozen=True)
class Provenance:
    """Provenance of a file of results: the `chain` of runs that wrote it; of the job the `seeds` of its roughness, a
    sentence on its `included` file, and `warnings`; the error `budget` so far (plain data); `references` to cite."""

    chain: tuple[Link, ...]
    seeds: tuple[int, ...] = ()
    included: str = ""
    warnings: tuple[str, ...] = ()
    budget: Mapping[str, Any] = field(default_factory=dict)
    references: tuple[str, ...] = ()

    def write(self, file: h5py.File) -> None:
        """Write the attributes of the file: program, resolved job (YAML), chain of runs (JSON), error budget (JSON),
        ranks, seeds, libraries, references."""
        now = self.chain[-1]
        file.attrs["program"] = now.program
        file.attrs["job"] = now.job
        for name, text in self._renewable(now.job).items():
            file.attrs.create(name, text)
        file.attrs["ranks"] = now.ranks
        small = all(seed < 2**63 for seed in self.seeds)
        file.attrs["seeds"] = np.array(self.seeds, dtype=np.int64) if small else [str(seed) for seed in self.seeds]
        if self.included:
            file.attrs["included"] = self.included
        versions = {name: metadata.version(name) for name in LIBRARIES}
        versions = {"python": platform.python_version(), "hdf5": h5py.version.hdf5_version, **versions}
        file.attrs["libraries"] = json.dumps(versions)
        file.attrs["references"] = "\n".join(self.references)

    def renew(self, file: h5py.File) -> None:
        """Update the chain and other changed attributes of a file in place."""
        for name, text in self._renewable(file.attrs["job"]).items():
            if name in file.attrs:
                file.attrs.modify(name, text)

    def _renewable(self, job: str) -> dict[str, NDArray[np.bytes_]]:
        """Return the attributes of fixed size that change during a run; `job` is the job of the file."""
        texts = {
            "chain": (_chain_text(self.chain, job), CHAIN_BYTES),
            "warnings": ("\n".join(self.warnings), WARNING_BYTES),
            BUDGET: (json.dumps(self.budget), BUDGET_BYTES),
        }
        return {name: np.array(text.encode()[:size], dtype=f"S{size}") for name, (text, size) in texts.items()}


def read_budget(file: h5py.File) -> dict[str, Any]:
    """Return the error budget of the run so far: relative errors of friction and area by source, or {}."""
    return dict(json.loads(bytes(file.attrs.get(BUDGET, b"{}"))))


def extend_chain(chain: Sequence[Link], link: Link) -> tuple[Link, ...]:
    """Return the chain with one more run; a run identical to the last one only raises its count."""
    if chain and (chain[-1].job, chain[-1].ranks, chain[-1].program) == (link.job, link.ranks, link.program):
        return (*chain[:-1], replace(chain[-1], runs=chain[-1].runs + 1))
    return (*chain, link)


def read_chain(file: h5py.File) -> tuple[Link, ...]:
    links = json.loads(bytes(file.attrs["chain"]))
    return tuple(Link(**{**link, "job": link["job"] or file.attrs["job"]}) for link in links)


def _chain_text(chain: Sequence[Link], job: str) -> str:
    """Return a chain as JSON. An empty job means the job of the file; the oldest jobs are left out if the text is too
    long."""
    links = [asdict(replace(link, job="" if link.job == job else link.job)) for link in chain]
    for link in links:
        if len(json.dumps(links)) > CHAIN_BYTES and link["job"]:
            link["job"] = LEFT_OUT
    while len(text := json.dumps(links)) > CHAIN_BYTES:
        links.pop(0)
    return text


def cite_lines(job: dict[str, Any]) -> tuple[str, ...]:
    """Return the references of a job (plain data) with their subjects, one per line."""
    return tuple(f"{reference} ({what})" for reference, what in references_of(job))


def references_of(job: dict[str, Any], features: Collection[str] = ()) -> list[tuple[str, str]]:
    """Return pairs of a reference and its subject, for a resolved job (plain data) and further `features`.

    Raises KeyError or TypeError for an incomplete job.
    """
    material, numerics = job["material"], job["numerics"]
    shift = material.get("shift", "")
    used = {
        *("", *features),
        f"kernel {numerics['kernel']}",
        f"boundary {job.get('grid', {}).get('boundary', 'periodic')}",
        f"shift {shift['law'] if isinstance(shift, dict) else shift}",
        *(
            f"shape {shape['shape']}"
            for shape in job["surface"]
            if Path(shape.get("path", "")).suffix not in OWN_FORMATS
        ),
        *(f"interface {key}" for key in job.get("interface") or {}),
    }
    bodies = [section for section in job.values() if isinstance(section, dict) and "model" in section]
    if any(body["model"] != "elastic" for body in bodies):
        used |= {"viscoelastic", f"integrator {numerics['integrator']}" if job.get("history") else ""}
    lines = REFERENCES.read_text(encoding="utf-8").splitlines()[1:]
    table = ([cell.strip() for cell in line.split("|")] for line in lines)
    return [(reference, what) for feature, reference, what in table if feature in used]


BATCH_JOBS = ("SLURM_JOB_ID", "PBS_JOBID", "LSB_JOBID", "JOB_ID")
GIGABYTE = 1e9


def lines(comm: MPI.Intracomm) -> Iterator[str]:
    """Yield the lines of a log's header: version, host, command, MPI, ranks, batch job, and numbers of the machine."""
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

"""Least memory and disk space that a job needs, compared with this machine."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from ..doubts import Doubt, Kind
from .advice import Sections
from .calculation import Grid
from .limits import count_steps

MAPS, MAPS_FREE = 9.0, 18.0  # tuning: least memory of a periodic and of a free run [8 bytes per point]
GIGA = 1e9
CGROUP = Path("/sys/fs/cgroup/memory.max")


WARN_DISK = Kind(
    "disk",
    "{instants:.4g} instants need {needed:.3g} GB, but {directory} has {free:.3g} GB left; use an output.every "
    "above {every}, or fewer fields",
)


def doubt_needs(job: Sections) -> Iterator[Doubt]:
    """Yield warnings about memory and disk."""
    grid, output = job.grid, job.output
    yield from doubt_memory(grid)
    if output.fields:
        count = count_steps(grid, job.history)
        saved = -(-count // output.every)
        needed, free = float(saved) * len(output.maps) * grid.nx * grid.ny * 8, _free(output.directory)
        if needed > free:
            disk = {"needed": needed / GIGA, "free": free / GIGA, "directory": str(output.directory)}
            yield WARN_DISK("output.fields", {"instants": saved, "every": output.every, **disk})


WARN_MEMORY = Kind(
    "memory",
    "{nx} x {ny} points need at least {needed:.3g} GB of memory on all ranks together, but {machines} {has:.3g} "
    "GB; use fewer points, or {count} such machines",
)


def doubt_memory(grid: Grid) -> Iterator[Doubt]:
    """Yield a warning if the grid cannot fit into the memory of the machines."""
    needed = (MAPS if all(grid.cyclic) else MAPS_FREE) * 8.0 * grid.nx * grid.ny
    each, count = _memory(), machines()
    if needed > each * count:
        have = "this machine has" if count == 1 else f"{count} such machines have"
        numbers = {"nx": grid.nx, "ny": grid.ny, "needed": needed / GIGA, "has": each * count / GIGA}
        yield WARN_MEMORY("grid.points", {**numbers, "machines": have, "count": int(needed / each) + 1})


def machines() -> int:
    """Return the number of machines on which this program runs, from the environment variables of its launcher."""

    def number(name: str) -> int:
        text = os.environ.get(name, "")
        return int(text) if text.isdecimal() else 0

    ranks, here = number("OMPI_COMM_WORLD_SIZE"), number("OMPI_COMM_WORLD_LOCAL_SIZE")
    return max(1, number("SLURM_JOB_NUM_NODES"), -(-ranks // here) if here else 1)


def _memory() -> float:
    """Return the memory of this machine, or the limit of this program's control group [bytes]."""
    whole = float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    try:
        return min(whole, float(CGROUP.read_text()))
    except (OSError, ValueError):  # no such limit
        return whole


def _free(directory: Path) -> float:
    """Return the free disk space [bytes] of the directory, or of its nearest existing parent."""
    for place in (directory.absolute(), *directory.absolute().parents):
        try:
            return float(shutil.disk_usage(place).free)
        except OSError:
            continue
    return float("inf")

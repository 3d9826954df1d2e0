"""Warnings about memory and disk: lower bounds of what a job needs, compared with this machine."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from ...doubts import Doubt
from ..sections.calculation import Grid, Output
from . import Sections
from .limits import count_steps

MAPS, MAPS_FREE = 9.0, 18.0  # tuning: least memory of a periodic and of a free run [8 bytes per point]
MOST_INSTANTS = 10**6  # tuning: most saved instants in one file, which reserves space for all of them
GIGA = 1e9
CGROUP = Path("/sys/fs/cgroup/memory.max")


def doubts_of_size(job: Sections) -> Iterator[Doubt]:
    """Yield warnings about memory and disk."""
    grid, output = job.grid, job.output
    yield from doubt_memory(grid)
    if output.fields:
        count = count_steps(grid, job.history)
        saved = -(-count // output.every)
        needed, free = float(saved) * len(output.maps) * grid.nx * grid.ny * 8, _free(output.directory)
        if needed > free:
            disk = {"needed": needed / GIGA, "free": free / GIGA, "directory": str(output.directory)}
            yield Doubt("disk", "output.fields", {"instants": saved, "every": output.every, **disk})


def doubt_memory(grid: Grid) -> Iterator[Doubt]:
    """Yield a warning if the grid cannot fit into the memory of the machines."""
    needed = (MAPS if all(grid.cyclic) else MAPS_FREE) * 8.0 * grid.nx * grid.ny
    each, count = _memory(), machines()
    if needed > each * count:
        have = "this machine has" if count == 1 else f"{count} such machines have"
        numbers = {"nx": grid.nx, "ny": grid.ny, "needed": needed / GIGA, "has": each * count / GIGA}
        yield Doubt("memory", "grid.points", {**numbers, "machines": have, "count": int(needed / each) + 1})


def beyond_file(count: int, output: Output) -> str:
    """Return a message if a run of `count` steps saves more than MOST_INSTANTS instants of fields, or ''."""
    saved = -(-count // output.every)
    if not output.fields or saved <= MOST_INSTANTS:
        return ""
    least = -(-count // MOST_INSTANTS)
    return (
        f"output.every: {saved:.4g} instants of fields would be saved, but a file holds at most {MOST_INSTANTS}; use "
        f"every: {least} or more"
    )


def machines() -> int:
    """Return the number of machines of this program, from the environment variables of its launcher."""

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

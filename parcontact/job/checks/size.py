"""Warnings about what a job needs: memory and disk, against those of this machine, and lower bounds all of them."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from ...doubts import Doubt
from ..sections.calculation import Grid, Output
from . import Sections
from .limits import count_steps

MAPS, MAPS_FREE = 9.0, 18.0  # tuning: of 8 bytes per point, which any run holds; free ones have padded transforms
MOST_INSTANTS = 10**6  # tuning: of fields in one file; each has its place in it from the start
GIGA = 1e9
CGROUP = Path("/sys/fs/cgroup/memory.max")


def doubts_of_size(job: Sections) -> Iterator[Doubt]:
    """Yield doubts about memory and disk."""
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
    """Yield a doubt if no run of a grid can fit into the memory of the machines it runs on."""
    needed = (MAPS if all(grid.cyclic) else MAPS_FREE) * 8.0 * grid.nx * grid.ny
    each, count = _memory(), machines()
    if needed > each * count:
        have = "this machine has" if count == 1 else f"{count} such machines have"
        numbers = {"nx": grid.nx, "ny": grid.ny, "needed": needed / GIGA, "has": each * count / GIGA}
        yield Doubt("memory", "grid.points", {**numbers, "machines": have, "count": int(needed / each) + 1})


def beyond_file(count: int, output: Output) -> str:
    """Return what to say if one file cannot hold so many instants of fields, or ''."""
    saved = -(-count // output.every)
    if not output.fields or saved <= MOST_INSTANTS:
        return ""
    least = -(-count // MOST_INSTANTS)
    return (
        f"output.every: {saved:.4g} instants of fields would be saved, and a file holds {MOST_INSTANTS} at most; use "
        f"every: {least} or more"
    )


def machines() -> int:
    """Return on how many machines this program runs, as far as its launcher tells."""

    def number(name: str) -> int:
        text = os.environ.get(name, "")
        return int(text) if text.isdecimal() else 0

    ranks, here = number("OMPI_COMM_WORLD_SIZE"), number("OMPI_COMM_WORLD_LOCAL_SIZE")
    return max(1, number("SLURM_JOB_NUM_NODES"), -(-ranks // here) if here else 1)


def _memory() -> float:
    """Return the bytes of this machine, or those it grants to this program."""
    whole = float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    try:
        return min(whole, float(CGROUP.read_text()))
    except (OSError, ValueError):  # no such limit
        return whole


def _free(directory: Path) -> float:
    """Return the bytes left on the disk of the nearest directory that there is."""
    for place in (directory.absolute(), *directory.absolute().parents):
        try:
            return float(shutil.disk_usage(place).free)
        except OSError:
            continue
    return float("inf")

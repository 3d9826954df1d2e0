"""Exact memory of a rank in maps, and size of a checkpoint [bytes], from the job.

The constructors of a run are called on a slab that counts memory without allocating it (`parallel.slab.Slab.planned`).
"""

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..accuracy.controller import tolerance_before
from ..effects.effect import EXTRAPOLATION
from ..job import Job
from ..job.checks.size import machines
from ..march.state import parts_of
from ..parallel.slab import Slab
from ..physics.convolution import Convolution, MirroredConvolution
from ..physics.lowest import shape_of
from ..physics.tiles import SIDE, Tiles
from ..scene import Scene, build_on, choices, outline, solver_on_tiles
from ..scene.rigid_surface import highest_waves
from ..solve.dilute_contact import BLOCKS, LARGEST_SHARE, LEAST, SHARE
from ..solve.fallback.cold_start import WORTHWHILE
from ..steady_sliding.curve import request
from ..steady_sliding.sliding import SteadySliding

FREE_SHARE = 0.7  # tuning: share of the free memory that jobs may take
MEMINFO = Path("/proc/meminfo")
MOST_POINTS = 2**20  # tuning: largest number of points of a case that runs on one rank of a sweep
SPARE = 2.0  # tuning: memory of the first contact or steady state on nested grids, over the memory of steps
NESTED = 2.5  # accuracy: largest number of maps of a first solve on coarser grids, in addition to maps of steps
SPECTRUM = "surface spectrum"


# names of parts of a run in a plan
NAMES = {"contact": "pressures", "material": "body", "energy": "memory of energies", "law": "gaps"}


def holdings(job: Job, ranks: int = 1, rank: int | None = None) -> dict[str, int]:
    """Return the memory of a rank in maps and transform buffers [bytes], by purpose.

    The default rank is the last one, which has the most, except for the spectrum of the surface, for which the largest
    memory of all ranks is returned.
    """
    slab = _slab(job, ranks, rank)
    scene = build_on(outline(job, slab))
    _memories = scene, _completed(scene)
    found = slab.tally.by_purpose
    for name, effect in choices(job).effects.items():
        if name not in scene.effects:
            found[name] = sum(np.dtype(dtype).itemsize for dtype in effect.maps(job)) * math.prod(slab.shape)
    if rank is None and choices(job).spectrum.on:
        found[SPECTRUM] = _most_waves(job, ranks)
    return found


def total_bytes(job: Job, ranks: int = 1, rank: int | None = None) -> int:
    return sum(holdings(job, ranks, rank).values())


def steady_start(job: Job, ranks: int = 1, rank: int | None = None) -> int:
    """Return the largest memory of a rank in maps [bytes] during the initial steady state, before `holdings` exist; 0
    for a run without it. The table of the wake of a free box may briefly take more."""
    if not choices(job).steady_start.on:
        return 0
    return steady_bytes(job, ranks, rank)


def steady_bytes(job: Job, ranks: int = 1, rank: int | None = None) -> int:
    """Return the largest memory of a rank in maps [bytes] during the initial steady state, or those of a curve."""
    slab = _slab(job, ranks, rank)
    first = choices(job).steady_start.on
    most = tolerance_before(job, 0, choices(job).viscoelasticity.on) if first else math.inf
    sliding, wanted = SteadySliding(outline(job, slab), most), None if first else request(job)
    held = sliding.hold(wanted.velocity(wanted.velocities[0]) if wanted else job.initial.velocity)
    bytes_held = slab.tally["map bytes"]
    del held
    return bytes_held


def most_bytes(job: Job, ranks: int) -> int:
    """Return the largest memory of rank 0 in maps [bytes]: in steps with a first solve on coarser grids and saved
    fields, or in the steady state from which a run starts."""
    (nx, ny), one_map = job.grid.points, 8 * job.grid.nx * job.grid.ny / ranks
    if not job.history:
        return steady_bytes(job, ranks)
    steps = total_bytes(job, ranks) + len(job.output.fields) * one_map + NESTED * one_map * (nx * ny >= WORTHWHILE)
    return int(max(steps, steady_start(job, ranks))) + on_tiles(job)


def on_tiles(job: Job) -> int:
    """Return the largest additional memory of rank 0 [bytes] while a dilute first contact is solved on tiles; 0 for a
    run without tiles."""
    chosen, (nx, ny) = choices(job), job.grid.points
    cold = bool(job.history) and not chosen.steady_start.on and not chosen.forbidden(EXTRAPOLATION)
    large = nx * ny >= WORTHWHILE and max(nx, ny) > BLOCKS
    if not (cold and large):
        return 0
    setup = outline(job, Slab.planned(nx, ny, 1, 0))
    make = solver_on_tiles(setup)
    if make is None:
        return 0
    count = int(LARGEST_SHARE * nx * ny / SIDE**2)
    places, before = np.zeros(count, np.intp), setup.slab.tally["map bytes"]
    made = make(Tiles((nx, ny), places, places), max(SHARE * job.numerics.tolerance, LEAST))
    held = setup.slab.tally["map bytes"] - before
    del made
    return held + 2 * 8 * SIDE**2 * count  # the heights and the start


def saved(job: Job) -> int:
    """Return the size of the maps in a checkpoint [bytes], with a checksum of 4 bytes per row. Effects declare their
    own maps, some of which exist in checkpoints only."""
    (nx, ny), scene = job.grid.points, build_on(outline(job, _slab(job, 1, 0)))
    memories = _completed(scene)
    parts = {name: part for name, part in parts_of(scene).items() if name not in scene.effects}
    entries = [entry for name, part in parts.items() for entry in part.entries(memories[name], scene.units).values()]
    itemsizes = [np.asarray(entry.value).itemsize for entry in entries if entry.is_map]
    for effect in choices(job).effects.values():
        itemsizes += [np.dtype(dtype).itemsize for dtype in effect.maps(job)]
    return sum(nx * ny * itemsize + 4 * ny for itemsize in itemsizes)


def _slab(job: Job, ranks: int, rank: int | None) -> Slab:
    """Return the counting slab of a rank, by default of the last one."""
    return Slab.planned(*job.grid.points, ranks, ranks - 1 if rank is None else rank)


def _completed(scene: Scene) -> dict[str, Any]:
    """Return the states of all parts at rest, after the allocations of the first step."""
    scene.slab.tally.purpose = "operators"
    for operator in scene.operators if scene.law is None else scene.operators[:1]:  # laws of effects use one operator
        assert isinstance(operator, Convolution | MirroredConvolution)
        _ = operator.symbols
    memories = {}
    for name, part in parts_of(scene).items():
        scene.slab.tally.purpose = NAMES.get(name, name)
        memories[name] = part.at_rest()
    return memories


def _most_waves(job: Job, ranks: int) -> int:
    """Return the largest memory of a rank for the spectrum of the surface [bytes]."""
    count = job.grid.nx // 2 + 1
    rows, columns = shape_of(highest_waves(job), job.grid.points, slice(0, -(-count // min(ranks, count))))
    return rows * columns * np.dtype(np.complex128).itemsize


def free_bytes() -> int:
    """Return the free memory [bytes], `sys.maxsize` if unknown."""
    try:
        facts = dict(line.split(":") for line in MEMINFO.read_text().splitlines())
        return int(facts["MemAvailable"].split()[0]) << 10
    except (OSError, KeyError, ValueError):
        return sys.maxsize


def count_side_by_side(jobs: Sequence[Job], ranks: int) -> int:
    """Return the number of cases to run at the same time: one per rank if small and within memory, else 1."""
    at_once = min(ranks, len(jobs))
    if at_once < 2:
        return 1
    largest = max(jobs, key=lambda job: job.grid.nx * job.grid.ny)
    if largest.grid.nx * largest.grid.ny > MOST_POINTS:
        return 1
    here = -(-at_once // machines())
    held = here * SPARE * total_bytes(largest, max(1, ranks // at_once))
    return at_once if held <= FREE_SHARE * free_bytes() else 1

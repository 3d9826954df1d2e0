"""How many bytes a rank holds in maps, and how many a checkpoint has: from the job alone, to the byte."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import DTypeLike

from ..effects import decisions, relaxation
from ..effects.effect import effects_that_follow
from ..effects.folded_branches import fold_branches_of
from ..effects.relaxation import relaxation_of
from ..job import Job
from ..parallel.fft import footprint, transform_name
from ..parallel.slab import deal
from ..physics.convolution import padded_lengths

SOLVER = 6  # maps: four of a contact solver, besides one of a byte per point, the last pressure and the next one
ZENER = 2  # maps of a body with memory, besides one per branch


@dataclass(frozen=True)
class Holding:
    """What one rank holds for a purpose [bytes]; of a transform its name in the tally, and what one sends."""

    what: str
    bytes: int
    transform: str = ""
    sent: int = 0


def holdings(job: Job, ranks: int = 1, rank: int | None = None) -> list[Holding]:
    """All maps and transform buffers of a rank in a run of a job; by default of the last one, which has the most."""
    return list(_holdings(job, ranks, ranks - 1 if rank is None else rank))


def total(job: Job, ranks: int = 1, rank: int | None = None) -> int:
    """Bytes of all of them."""
    return sum(holding.bytes for holding in holdings(job, ranks, rank))


def _holdings(job: Job, ranks: int, rank: int) -> Iterator[Holding]:
    points, precision = job.grid.points, np.dtype(job.numerics.map_type)
    part = deal(job.grid.ny, ranks)[rank]
    cells = (part.stop - part.start) * job.grid.nx
    map_bytes = cells * precision.itemsize
    spectrum, sent, blocks = footprint(points, points, precision, ranks, rank)
    yield Holding("transforms", spectrum + sent + blocks, transform_name(points, precision), sent)
    if decisions.isolated(job).on:
        lengths = padded_lengths(*points)
        wide = footprint(points, lengths, precision, ranks, rank)
        name = transform_name(lengths, precision)
        yield Holding("padded transforms and operator", sum(wide) + wide[0] // 2, name, wide[1])
    else:
        yield Holding("operator", spectrum // 2)
    if decisions.mixed_precision(job).on:
        narrow = footprint(points, points, np.float32, ranks, rank)
        name = transform_name(points, np.float32)
        yield Holding("single transforms and preconditioner", sum(narrow) + narrow[0] // 2, name, narrow[1])
    else:
        yield Holding("preconditioner", spectrum // 2)
    yield Holding("solver", SOLVER * map_bytes + cells)
    yield Holding("heights", map_bytes)
    if decisions.spectrum(job).on:
        yield Holding("surface spectrum", spectrum)
    if _moved(job):
        yield Holding("moved heights", map_bytes)
    if decisions.lasting(job).on:
        yield Holding("last pressure but one", map_bytes)
    if relaxation.decide(job).on:
        yield Holding("branches", (len(fold_branches_of(job).kept) + ZENER) * map_bytes)
    if decisions.energy_memory(job).on:
        yield Holding("energy memory", (relaxation_of(job).moduli.size + ZENER) * cells * 8)
    for name, effect in effects_that_follow(job).items():
        yield Holding(name, cells * _itemsize(effect.maps(job)))


def saved(job: Job) -> int:
    """Bytes of the maps in a checkpoint, with the checksums of their rows."""
    points, maps, doubles = job.grid.nx * job.grid.ny, 1, 0
    if decisions.lasting(job).on:
        maps += 1
    if relaxation.decide(job).on:
        maps += 1 + len(fold_branches_of(job).kept)
    if decisions.energy_memory(job).on:
        doubles = 1 + relaxation_of(job).moduli.size
    own = [kind for effect in effects_that_follow(job).values() for kind in effect.maps(job)]
    itemsize = maps * np.dtype(job.numerics.map_type).itemsize + doubles * 8 + _itemsize(own)
    return points * itemsize + (maps + doubles + len(own)) * job.grid.ny * 4


def _itemsize(kinds: Sequence[DTypeLike]) -> int:
    """Bytes of one point of maps of these types."""
    return sum(np.dtype(kind).itemsize for kind in kinds)


def _moved(job: Job) -> bool:
    """Whether an elastic body needs the heights that a body with memory moves within its own pass."""
    by_cells = decisions.sliding(job).on and not decisions.part_cells(job).on
    return by_cells and not relaxation.decide(job).on

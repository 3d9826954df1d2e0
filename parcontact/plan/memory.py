"""How many bytes a rank holds in maps, and how many a checkpoint has: from the job alone, to the byte.

Each class says what it holds; here this is added up.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import DTypeLike

from ..job import Job
from ..job.checks.size import machines
from ..march.state import State
from ..parallel.fft import footprint
from ..parallel.regrid import coarser_points
from ..parallel.slab import deal, dealt_to
from ..physics.body import ElasticBody, ZenerBody
from ..physics.convolution import Convolution
from ..physics.energy import ElasticPressure
from ..physics.entries import MapCount
from ..physics.halfspace import HalfSpace
from ..physics.lowest import shape_of
from ..scene import choices
from ..scene.rigid_surface import highest_waves
from ..solve.contact import ContactSolver
from ..solve.nonsymmetric.steady import SteadySolver
from ..solve.preconditioner.extension import grids_for
from ..steady_sliding.sliding import tolerance_of

FREE_SHARE = 0.7  # of the memory that is free, which jobs may take
MEMINFO = Path("/proc/meminfo")
MOST_POINTS = 2**20  # tuning: of a small case, which gains little from several ranks
SPARE = 2.0  # times the maps of steps: what a first contact or steady state on nested grids may hold besides


@dataclass(frozen=True)
class Holding:
    """What one rank holds for a purpose [bytes]."""

    what: str
    bytes: int


@dataclass(frozen=True)
class Maps:
    """Maps of one type that a rank holds for a purpose, and that a checkpoint has."""

    what: str
    count: MapCount
    dtype: DTypeLike

    @property
    def itemsize(self) -> int:
        return np.dtype(self.dtype).itemsize


def holdings(job: Job, ranks: int = 1, rank: int | None = None) -> list[Holding]:
    """All maps and transform buffers of a rank in a run of a job; by default no rank has more: the last has the most
    of all but the surface's waves."""
    return list(_holdings(job, ranks, ranks - 1 if rank is None else rank, _surface_spectrum(job, ranks, rank)))


def total(job: Job, ranks: int = 1, rank: int | None = None) -> int:
    """Bytes of all of them."""
    return sum(holding.bytes for holding in holdings(job, ranks, rank))


def steady_start(job: Job, ranks: int = 1, rank: int | None = None, sets: bool = False) -> int:
    """Bytes of all maps of a rank while the steady state is found from which a run starts, before those of `holdings`
    are made: as a rule, or where the solver changes `sets` of points. 0 for a run that starts from another state.

    In a free box the table of the wake, made before that, may take more for a moment; so may, up to a quarter more than
    with sets, what is tried when these have failed.
    """
    if not choices(job).steady_start.on:
        return 0
    waves = _surface_spectrum(job, ranks, rank)
    return sum(_while_steady(job, ranks, ranks - 1 if rank is None else rank, waves, sets))


def saved(job: Job) -> int:
    """Bytes of the maps in a checkpoint, with the four of the checksum of each row."""
    nx, ny = job.grid.points
    return sum(maps.count.saved * (nx * ny * maps.itemsize + 4 * ny) for maps in _maps(job))


def free_bytes() -> int:
    """Bytes of memory that are free, as far as that is known."""
    try:
        facts = dict(line.split(":") for line in MEMINFO.read_text().splitlines())
        return int(facts["MemAvailable"].split()[0]) << 10
    except (OSError, KeyError, ValueError):
        return sys.maxsize


def count_side_by_side(jobs: Sequence[Job], ranks: int) -> int:
    """How many of these cases are run at a time on so many ranks: small ones one on each rank, as they gain little from
    several; 1 where they are not small, or where so many do not fit into the memory."""
    at_once = min(ranks, len(jobs))
    if at_once < 2:
        return 1
    largest = max(jobs, key=lambda job: job.grid.nx * job.grid.ny)
    if largest.grid.nx * largest.grid.ny > MOST_POINTS:
        return 1
    here = -(-at_once // machines())
    held = here * SPARE * total(largest, max(1, ranks // at_once))
    return at_once if held <= FREE_SHARE * free_bytes() else 1


def _holdings(job: Job, ranks: int, rank: int, waves: int) -> Iterator[Holding]:
    chosen, part = choices(job), dealt_to(job.grid.ny, ranks, rank)
    cells = (part.stop - part.start) * job.grid.nx
    spectrum, *_ = footprint(job.grid.points, job.grid.points, np.float64, ranks, rank)
    symbol = Convolution.footprint(spectrum, job.grid.ny)
    kept: type[np.floating] = chosen.operator_type
    yield _transform("transforms", job, job.grid.points, np.float64, ranks, rank)
    if lengths := HalfSpace(job.grid.size, free=chosen.isolated.on).own_lengths(job.grid.points):
        yield _transform("padded transforms and operator", job, lengths, kept, ranks, rank, with_symbol=True)
    else:
        yield Holding("operator", symbol * np.dtype(kept).itemsize // 8)
    if chosen.mixed_precision.on:
        what, points = "single transforms and preconditioner", job.grid.points
        yield _transform(what, job, points, np.float32, ranks, rank, with_symbol=True, lent=True)
    else:
        yield Holding("preconditioner", symbol)
    grids = grids_for(job.grid.dx, job.grid.dy)
    yield Holding("solver", ContactSolver.footprint(*job.grid.points, job.numerics.tolerance, ranks, rank, grids, kept))
    if chosen.spectrum.on:
        yield Holding("surface spectrum", waves)
    for maps in _maps(job):
        if maps.count.held:
            yield Holding(maps.what, maps.count.held * maps.itemsize * cells)


def _while_steady(job: Job, ranks: int, rank: int, waves: int, sets: bool) -> Iterator[int]:
    points = job.grid.points
    even = not job.initial.velocity[1]
    finest = _transform("", job, points, np.float64, ranks, rank).bytes
    spectrum, *_ = footprint(points, points, np.float64, ranks, rank)
    yield SteadySolver.footprint(*points, tolerance_of(job.numerics.tolerance), ranks, rank, sets)
    yield 2 * _map(points, ranks, rank)  # the heights and the start
    yield finest + waves
    yield Convolution.footprint(spectrum, job.grid.ny, even, is_complex=True)
    if lengths := HalfSpace(job.grid.size, free=choices(job).isolated.on).own_lengths(points):
        padded, *_ = footprint(points, lengths, np.float64, ranks, rank)
        yield _transform("", job, lengths, np.float64, ranks, rank).bytes
        yield Convolution.footprint(padded, lengths[1], even, is_complex=True)
    else:
        yield Convolution.footprint(spectrum, job.grid.ny, even, is_complex=True)
    for coarse in coarser_points(*points):
        spectrum, blocks, _ = footprint(coarse, coarse, np.float64, ranks, rank)
        yield spectrum + blocks + _map(coarse, ranks, rank)


def _surface_spectrum(job: Job, ranks: int, rank: int | None) -> int:
    """Bytes of the waves of the surface on a rank, or on that which has the most."""
    if not choices(job).spectrum.on:
        return 0
    points, waves = job.grid.points, highest_waves(job)
    count = points[0] // 2 + 1
    dealt = deal(count, min(ranks, count)) if rank is None else [dealt_to(count, ranks, rank)]  # more ranks have none
    shapes = [shape_of(waves, points, columns) for columns in dealt]
    return max(rows * columns for rows, columns in shapes) * 16


def _map(points: tuple[int, int], ranks: int, rank: int) -> int:
    """Bytes of a map on a rank."""
    rows = dealt_to(points[1], ranks, rank)
    return (rows.stop - rows.start) * points[0] * 8


def _transform(
    what: str,
    job: Job,
    lengths: tuple[int, int],
    dtype: DTypeLike,
    ranks: int,
    rank: int,
    with_symbol: bool = False,
    lent: bool = False,
) -> Holding:
    """A transform with its buffers, its spectrum perhaps `lent`, and the symbol of the operator that alone uses it."""
    spectrum, blocks, _ = footprint(job.grid.points, lengths, dtype, ranks, rank, lent)
    symbol = Convolution.footprint(spectrum, lengths[1]) if with_symbol else 0
    return Holding(what, (0 if lent else spectrum) + blocks + symbol)


def _maps(job: Job) -> Iterator[Maps]:
    """Of everything that holds whole maps, or has them in checkpoints."""
    chosen = choices(job)
    yield Maps("heights", MapCount(1), np.float64)
    pressures = State.count_maps(chosen.extrapolated_starts.on, chosen.further_starts.on)
    yield Maps("pressures", pressures, np.float64)
    if chosen.viscoelasticity.on:
        yield Maps("branches", ZenerBody.count_maps(len(chosen.folded.kept)), np.float64)
    else:
        yield Maps("moved heights", ElasticBody.count_maps(chosen.slides_along_x), np.float64)
    if chosen.energy_memory.on:
        yield Maps("energy memory", ElasticPressure.count_maps(chosen.prony.moduli.size), np.float64)
    for name, effect in chosen.followers.items():
        for dtype in effect.maps(job):
            yield Maps(name, MapCount(held=1, saved=1), dtype)

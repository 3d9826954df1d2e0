"""Bytes that a rank holds in maps, and bytes of a checkpoint: from the job alone, exactly.

Each class says what it holds; here this is added up.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import DTypeLike

from ..effects import adhesive_law
from ..job import Job
from ..job.checks.size import machines
from ..march import state
from ..march.tolerance import tolerance_before
from ..parallel.fft import footprint
from ..parallel.regrid import coarser_points
from ..parallel.slab import deal, dealt_to
from ..physics import tile_operator
from ..physics.body import ElasticBody, ZenerBody
from ..physics.convolution import Convolution, MirroredConvolution
from ..physics.energy import ElasticPressure
from ..physics.entries import MapCount
from ..physics.halfspace import HalfSpace
from ..physics.layer import Layer
from ..physics.lowest import shape_of
from ..physics.tiles import REACH_OF_INVERSE, SIDE, TileConvolution, Tiles
from ..scene import choices
from ..scene.rigid_surface import highest_waves
from ..solve.adhesive.solver import GapSolver
from ..solve.contact import ContactSolver
from ..solve.fallback.cold_start import WORTHWHILE
from ..solve.nonsymmetric.steady import SteadySolver
from ..solve.preconditioner.cell_sums import CellSums
from ..solve.preconditioner.extension import grids_for, pairs_for
from ..solve.tiles import BLOCKS, LARGER_CELLS, LARGEST_SHARE, LEAST, SHARE
from ..steady_sliding.sliding import tolerance_of

FREE_SHARE = 0.7  # tuning: of the memory that is free, which jobs may take
MEMINFO = Path("/proc/meminfo")
MOST_POINTS = 2**20  # tuning: of a small case, which gains little from several ranks
SPARE = 2.0  # tuning: times the maps of steps: what a first contact or steady state on nested grids may hold besides


Points = tuple[int, int]


def holdings(job: Job, ranks: int = 1, rank: int | None = None) -> dict[str, int]:
    """Bytes of all maps and transform buffers of a rank in a run of a job, by their purpose; by default no rank has
    more: the last has the most of all but the surface's waves."""
    part, chosen, grid = _Part(job, ranks, rank), choices(job), job.grid
    whole, _ = part.transform(grid.points)
    kept = chosen.operator_type
    found = {"transforms": sum(part.transform(grid.points))}
    if lengths := part.own_lengths:
        spectrum, blocks = part.transform(lengths, kept)
        found["padded transforms and operator"] = spectrum + blocks + Convolution.footprint(spectrum, lengths[1])
    else:
        found["operator"] = Convolution.footprint(whole, grid.ny) * np.dtype(kept).itemsize // 8
    if chosen.mixed_precision.on:
        single, _ = part.transform(grid.points, np.float32)
        blocks = part.transform(grid.points, np.float32, shared=True)[1]
        found["single transforms and preconditioner"] = blocks + part.preconditioner(single, 4)
    else:
        never = whole if chosen.adhesion is not None and chosen.isolated.on else 0  # of its symbol: it is not applied
        found["preconditioner"] = part.preconditioner(whole, 8) - never
    body, tolerance = part.half_space, job.numerics.tolerance
    grids = grids_for(grid.dx, grid.dy, body.reach)
    solver = ContactSolver.footprint(*grid.points, tolerance, ranks, part.number, grids, kept, body.long_waves)
    found["solver"] = solver
    if chosen.adhesion is not None:
        found["adhesion"] = 2 * Convolution.footprint(whole, grid.ny) + GapSolver.footprint(part.cells(grid.points))
        cells = CellSums.footprint(*grid.points, ranks, part.number, body.size, body.compliance)
        found["adhesion"] += cells
    if chosen.spectrum.on:
        found["surface spectrum"] = part.surface_waves
    for what, count, dtype in _maps(job):
        if count.held:
            found[what] = found.get(what, 0) + count.held * np.dtype(dtype).itemsize * part.cells(grid.points)
    return found


def total(job: Job, ranks: int = 1, rank: int | None = None) -> int:
    return sum(holdings(job, ranks, rank).values())


def steady_start(job: Job, ranks: int = 1, rank: int | None = None, sets: bool = False) -> int:
    """Bytes of all maps of a rank while the steady state is found from which a run starts, before those of `holdings`
    are made: as a rule, or where the solver changes `sets` of points. 0 for a run that starts from another state.

    In a free box the table of the wake, made before that, may take more for a moment; so may, up to a quarter more than
    with sets, what is tried when these have failed.
    """
    if not choices(job).steady_start.on:
        return 0
    part, points, even = _Part(job, ranks, rank), job.grid.points, not job.initial.velocity[1]
    spectrum, blocks = part.transform(points)
    tolerance = min(tolerance_of(job.numerics.tolerance), tolerance_before(choices(job), 0))
    pairs = pairs_for(job.grid.dx, job.grid.dy)
    held = SteadySolver.footprint(*points, tolerance, ranks, part.number, sets, pairs)
    held += 2 * 8 * part.cells(points)  # the heights and the start
    held += spectrum + blocks + part.surface_waves
    held += Convolution.footprint(spectrum, job.grid.ny, even, is_complex=True)
    if lengths := part.own_lengths:
        padded, blocks = part.transform(lengths)
        held += padded + blocks + Convolution.footprint(padded, lengths[1], even, is_complex=True)
    else:
        held += Convolution.footprint(spectrum, job.grid.ny, even, is_complex=True)
    for coarse in coarser_points(*points):
        held += sum(footprint(coarse, coarse, np.float64, ranks, part.number)[:2]) + 8 * part.cells(coarse)
    return held


def on_tiles(job: Job) -> int:
    """Bytes that rank 0 holds at most, beside those of `holdings`, while a dilute first contact is solved on tiles; 0
    for a run that does not try that."""
    chosen, (nx, ny) = choices(job), job.grid.points
    body = _Part(job, 1, 0).half_space
    cold = bool(job.history) and not chosen.steady_start.on and chosen.adhesion is None
    large = nx * ny >= WORTHWHILE and max(nx, ny) > BLOCKS
    if not (cold and large and body.works_on_tiles(nx, ny)):
        return 0
    count = int(LARGEST_SHARE * nx * ny / SIDE**2)
    places = np.zeros(count, np.intp)
    tiles = Tiles((nx, ny), places, places)
    tolerance = max(SHARE * job.numerics.tolerance, LEAST)
    held = ContactSolver.footprint(SIDE, count * SIDE, tolerance, 1, 0, LARGER_CELLS)
    held += tile_operator.footprint(tiles, body.size) + TileConvolution.footprint(count, REACH_OF_INVERSE)
    return held + 2 * 8 * SIDE**2 * count  # the heights and the start


def saved(job: Job) -> int:
    """Bytes of the maps in a checkpoint, with the four of the checksum of each row."""
    nx, ny = job.grid.points
    return sum(count.saved * (nx * ny * np.dtype(dtype).itemsize + 4 * ny) for _, count, dtype in _maps(job))


def free_bytes() -> int:
    """Bytes of memory that are free, as far as that is known."""
    try:
        facts = dict(line.split(":") for line in MEMINFO.read_text().splitlines())
        return int(facts["MemAvailable"].split()[0]) << 10
    except (OSError, KeyError, ValueError):
        return sys.maxsize


def count_side_by_side(jobs: Sequence[Job], ranks: int) -> int:
    """Return the number of cases to run at a time on so many ranks: small ones one on each, as they gain little from
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


@dataclass(frozen=True)
class _Part:
    """The part of a job's grid that one of several ranks has; without a rank the largest part."""

    job: Job
    ranks: int
    rank: int | None

    @property
    def number(self) -> int:
        return self.ranks - 1 if self.rank is None else self.rank

    def cells(self, points: Points) -> int:
        """Points of a map."""
        rows = dealt_to(points[1], self.ranks, self.number)
        return (rows.stop - rows.start) * points[0]

    def transform(self, lengths: Points, dtype: DTypeLike = np.float64, shared: bool = False) -> tuple[int, int]:
        """Bytes of the spectrum of a transform, whose memory may be `shared` with another one, and of its buffers."""
        return footprint(self.job.grid.points, lengths, dtype, self.ranks, self.number, shared)[:2]

    @property
    def own_lengths(self) -> Points | None:
        """Lengths of the operator's own transforms; None if it takes those of the grid."""
        return self.half_space.own_lengths(self.job.grid.points)

    @property
    def half_space(self) -> HalfSpace:
        """The body, in m."""
        poisson, body, free = self.job.material.poisson, self.job.body, choices(self.job).isolated.on
        layer = None if body is None else Layer(body.thickness, body.base, poisson)
        return HalfSpace(self.job.grid.size, poisson, free=free, layer=layer)

    def preconditioner(self, spectrum: int, itemsize: int) -> int:
        """Bytes of the inverse of the half space beside a transform of maps of such items."""
        if choices(self.job).isolated.on:
            return MirroredConvolution.footprint(spectrum, self.job.grid.ny, itemsize)
        return Convolution.footprint(spectrum, self.job.grid.ny)

    @property
    def surface_waves(self) -> int:
        """Bytes of the waves of the surface."""
        if not choices(self.job).spectrum.on:
            return 0
        points, waves = self.job.grid.points, highest_waves(self.job)
        count = points[0] // 2 + 1
        most = self.rank is None  # more ranks than columns have none
        dealt = deal(count, min(self.ranks, count)) if most else [dealt_to(count, self.ranks, self.number)]
        shapes = [shape_of(waves, points, columns) for columns in dealt]
        return max(rows * columns for rows, columns in shapes) * 16


def _maps(job: Job) -> Iterator[tuple[str, MapCount, DTypeLike]]:
    """Whole maps, held or in checkpoints: their purpose, count and type."""
    chosen = choices(job)
    yield "heights", MapCount(1), np.float64
    yield "pressures", state.count_maps(chosen.extrapolated_starts.on, chosen.further_starts.on), np.float64
    if chosen.viscoelasticity.on:
        yield "branches", ZenerBody.count_maps(len(chosen.folded.kept)), np.float64
    else:
        yield "moved heights", ElasticBody.count_maps(chosen.slides_along_x), np.float64
    if chosen.energy_memory.on:
        yield "energy memory", ElasticPressure.count_maps(chosen.prony.moduli.size), np.float64
    if chosen.adhesion is not None:
        yield "gaps", adhesive_law.count_maps(chosen.isolated.on), np.float64
    for name, effect in chosen.followers.items():
        for dtype in effect.maps(job):
            yield name, MapCount(held=1, saved=1), dtype

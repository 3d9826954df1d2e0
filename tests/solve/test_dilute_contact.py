"""A dilute contact is found on tiles of a free box, and the whole grid agrees."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

from parcontact.contact import starts
from parcontact.contact.problem import Approach, Box, Contact, MeanPressure, Operators, Problem, Workspace
from parcontact.contact.solver import ContactSolver
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Array, Slab
from parcontact.physics.convolution import SIDE, Tiles
from parcontact.physics.halfspace import HalfSpace

from .bodies import Map

POINTS, TOLERANCE = 256, 1e-5
BODY = HalfSpace((1.0, 1.0), free=True)
LIGHT, HEAVY = MeanPressure(0.0005), MeanPressure(0.3)


def spheres() -> Map:
    """Two spheres and, far from them, a peak of a single point that coarse grids do not show."""
    x = (np.arange(POINTS) + 0.5) / POINTS
    h = np.full((POINTS, POINTS), -0.2)
    for at_x, at_y, top in [(0.18, 0.31, 0.0), (0.57, 0.69, 1e-3)]:
        h = np.maximum(h, top - 20.0 * ((x[None, :] - at_x) ** 2 + (x[:, None] - at_y) ** 2))
    h[40, 250] = 0.002
    return h


def found(
    comm: MPI.Intracomm,
    control: MeanPressure | Approach,
    monkeypatch: pytest.MonkeyPatch,
    on_tiles: bool = True,
    tolerance: float = TOLERANCE,
) -> tuple[Contact, Array | None, int]:
    """A contact found from nothing, its whole pressure on root, and calls of the operators of the whole grid."""
    monkeypatch.setattr(starts, "BLOCKS", POINTS // 4)
    slab, whole = Slab(comm, POINTS, POINTS), spheres()
    h, height = np.ascontiguousarray(whole[slab.rows]), float(np.ptp(whole))

    def solver_on(on: Slab, tolerance: float) -> tuple[ContactSolver, Operators]:
        fft = FFT(on, measured=False)
        solver = ContactSolver(Workspace(on, tolerance), height, tolerance, 500, free=BODY.free)
        return solver, Operators(BODY.operator(fft), BODY.inverse(fft))

    def tiles_on(tiles: Tiles, tolerance: float) -> Any:
        work = Workspace(Slab.alone(SIDE, tiles.count * SIDE, slab.tally), tolerance)
        solver = ContactSolver(work, height, tolerance, 500, starts.LARGER_CELLS, BODY.free)
        return solver, *BODY.on_tiles(tiles, slab.tally)

    solver, operators = solver_on(slab, tolerance)
    problem, p = Problem(*operators, h, Box(), control), slab.zeros()
    contact = starts.prepare_start(solver, problem, p, solver_on, tiles_on if on_tiles else None)
    before = slab.tally["operator"]
    contact = contact or solver.solve(problem, p)
    return contact, slab.to_root(contact.p), slab.tally["operator"] - before


@pytest.mark.mpi
@pytest.mark.parametrize("control", [LIGHT, Approach(0.001)], ids=["load", "approach"])
@pytest.mark.parametrize(("tolerance", "fewest"), [(TOLERANCE, 0), (0.9 * starts.FINEST, 1)], ids=["loose", "tight"])
def test_few_calls_of_the_whole_operator(
    comm: MPI.Intracomm,
    control: MeanPressure | Approach,
    tolerance: float,
    fewest: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The first certificate at all points is good, peak included, by the operators on tiles or, to a tight tolerance,
    the whole one; the pressure is that of a solve without tiles, and so is the displacement."""
    contact, p, calls = found(comm, control, monkeypatch, tolerance=tolerance)
    other, expected, more = found(comm, control, monkeypatch, on_tiles=False)
    assert contact.converged
    assert (contact.iterations, calls) == (0, fewest)
    assert more > 5
    assert np.abs(contact.u - other.u).max(initial=0.0) <= 1e-4 * np.abs(other.u).max(initial=1e-300)
    if p is not None and expected is not None:
        assert p[40, 250] > 0.0
        assert np.linalg.norm(p - expected) <= 1e-4 * np.linalg.norm(expected)


def test_tiles_at_an_edge() -> None:
    """A block at the edge has no neighbour beyond it."""
    near, slab = np.zeros((16, 16), np.bool_), Slab.alone(512, 512)
    near[5, 0] = True
    found = starts._tiles_of(near, slab)
    assert set(zip(found.rows, found.columns, strict=True)) == {(j, i) for j in (4, 5, 6) for i in (0, 1)}


@pytest.mark.mpi
def test_maps_of_ranks_without_rows(comm: MPI.Intracomm) -> None:
    """Rows of tiles come together from all ranks and go back, whoever has them: here the last one has all."""
    nx, ny = 50, 70
    dealt = [slice(0, 0)] * (comm.size - 1) + [slice(0, ny)]
    slab, tiles = Slab(comm, nx, ny, rows_of=dealt.__getitem__), Tiles((nx, ny), np.array([0, 2]), np.array([1, 0]))
    whole = np.random.default_rng(1).random((ny, nx))
    held = slab.tally["map bytes"]
    found: Array | None = starts._stacked(slab, tiles, whole[slab.rows])
    assert slab.tally["map bytes"] - held == (0 if found is None else found.nbytes)
    stacked = slab.agree(found)
    assert stacked is not None
    assert np.array_equal(stacked[:SIDE, : nx - SIDE], whole[:SIDE, SIDE:])
    assert not stacked[:SIDE, nx - SIDE :].any()
    back = slab.empty()
    starts._unstack(slab, tiles, stacked, back)
    outside = np.ones((ny, nx), np.bool_)
    outside[:SIDE, SIDE:] = outside[2 * SIDE :, :SIDE] = False
    assert np.array_equal(back, np.where(outside, 0.0, whole)[slab.rows])


@pytest.mark.mpi
def test_all_ranks_learn_that_root_failed(comm: MPI.Intracomm) -> None:
    """A script that catches the exception goes on with all ranks, none of which waits for root."""
    slab, tiles = Slab(comm, 64, 64), Tiles((64, 64), np.array([0]), np.array([1]))

    def on(_: Tiles, __: float) -> Any:
        raise MemoryError("no room for tiles")

    nothing: Any = None
    problem = Problem(nothing, nothing, slab.zeros(), Box(), Approach(1.0))
    with pytest.raises(MemoryError, match="no room for tiles"):
        starts.OnTheseTiles(tiles, on, problem, slab, 1.0).solve(1e-3, slab.zeros())
    assert slab.sum(1.0) == [comm.size]


def test_a_contact_that_is_not_dilute(monkeypatch: pytest.MonkeyPatch) -> None:
    """It starts and ends to the last bit as if there were no tiles."""
    contact, p, calls = found(MPI.COMM_SELF, HEAVY, monkeypatch)
    without, expected, as_many = found(MPI.COMM_SELF, HEAVY, monkeypatch, on_tiles=False)
    assert (contact.iterations, calls) == (without.iterations, as_many)
    assert p is not None
    assert expected is not None
    assert np.array_equal(p, expected)


def test_points_beyond_the_end_of_the_grid_do_not_touch() -> None:
    """On tiles that the end cuts off they lie below all others by the height of the surface."""
    slab = Slab.alone(40, 36)
    rows, columns = (each.ravel() for each in np.indices((2, 2)))
    grid = Tiles((40, 36), rows, columns)
    found = []

    def on(_: Tiles, __: float) -> Any:
        def solve(problem: Problem, start: Array, cold: bool) -> Any:
            assert cold
            found.append(problem.heights.reshape(2, 2, 32, 32).transpose(0, 2, 1, 3).reshape(64, 64))
            return SimpleNamespace(p=start, d=0.0, certificate=SimpleNamespace(length=1.0))

        return SimpleNamespace(slab=Slab.alone(32, 128, slab.tally), solve=solve), None, None

    heights = np.random.default_rng(1).uniform(-3.0, -1.0, (36, 40))
    nothing: Any = None
    problem = Problem(nothing, nothing, heights, Box(), Approach(1.0))
    starts.OnTheseTiles(grid, on, problem, slab, 2.0).solve(1e-3, slab.zeros())
    (stacked,) = found
    assert (stacked[:36, :40] == heights).all()
    stacked[:36, :40] = heights.min() - 2.0
    assert (stacked == heights.min() - 2.0).all()


@pytest.mark.parametrize("along_x", [True, False])
def test_grids_of_blocks(along_x: bool) -> None:
    """At most BLOCKS along the longer side, or as many as the finest grid has tiles there."""
    slab = lambda longer: Slab.alone(longer, 4) if along_x else Slab.alone(4, longer)  # noqa: E731
    assert starts.is_block_grid(slab(starts.BLOCKS), slab(2 * starts.BLOCKS))
    assert not starts.is_block_grid(slab(starts.BLOCKS + 1), slab(2 * starts.BLOCKS))
    assert starts.is_block_grid(slab(2 * starts.BLOCKS), slab(2 * starts.BLOCKS * SIDE))

"""Sums over cells of all lengths against products of matrices, on any ranks, and against the operator, wave by wave."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpi4py import MPI

from parcontact.parallel.slab import Slab
from parcontact.physics.halfspace import HalfSpace
from parcontact.physics.layer import Layer
from parcontact.solve.preconditioner.cell_sums import CellSums
from parcontact.solve.preconditioner.levels import levels_of

from .test_extension import SINGLE, Map, fewer, interpolating


def weighted(c: Map, weights: list[float], pairs: int) -> Map:
    """`sum w_l I_l I_l' c`, from the finest grid on."""
    if len(weights) == 1:
        return weights[0] * c
    down = np.eye(len(c)) if pairs > 0 else interpolating(len(c))
    along = np.eye(c.shape[1]) if pairs < 0 else interpolating(c.shape[1])
    coarse = weighted(down.T @ c @ along, weights[1:], fewer(pairs))
    return np.asarray(weights[0] * c + down @ coarse @ along.T)


@pytest.mark.mpi
@settings(max_examples=30)
@given(ny=st.integers(1, 34), nx=st.sampled_from([7, 14, 200]), pairs=st.integers(-2, 2), seed=st.integers(0, 99))
def test_sums_over_cells_of_all_lengths(ny: int, nx: int, pairs: int, seed: int) -> None:
    """`M c` is that of products of matrices, to single precision."""
    random = np.random.default_rng([ny, nx, seed])
    count = len(levels_of(Slab.alone(nx, ny), pairs))
    weights, c = random.random(count + 1).tolist(), random.normal(size=(ny, nx))
    slab = Slab(MPI.COMM_WORLD, nx, ny)
    out = slab.empty()
    CellSums(slab, pairs, weights).apply(c[slab.rows].copy(), out)
    expected = weighted(c, weights, pairs)
    np.testing.assert_allclose(out, expected[slab.rows], rtol=0, atol=SINGLE * np.abs(expected).max())


@pytest.mark.parametrize("ny", [64, 16, 256])
@pytest.mark.parametrize("layer", [None, Layer(0.1, "smooth", 0.3), Layer(0.5, "bonded", 0.3)])
def test_makes_of_waves_about_what_the_operator_makes(ny: int, layer: Layer | None) -> None:
    """Waves along x, y and between, from two points to the whole box, come out 0.5 to 2.5 times as large, on square
    cells and on cells of 4 : 1: the interpolation takes a wave of four points for half of what it is."""
    slab, body = Slab.alone(64, ny), HalfSpace((1.0, 1.0), poisson=0.3, layer=layer)
    sums = CellSums.on(slab, body.size, body.compliance)
    assert sums is not None
    half = min(64, ny) // 2
    x, y, out = np.arange(64) / 64, np.arange(ny)[:, None] / ny, slab.zeros()
    for along_x, along_y in [(1, 0), (0, 1), (3, 2), (6, 6), (half, 0), (0, ny // 2), (half, ny // 2), (32, 0)]:
        wave = slab.zeros()
        wave[...] = np.cos(2 * np.pi * (along_x * x + along_y * y))
        sums.apply(wave, out)
        made = float((wave * out).sum() / (wave * wave).sum())
        should = float(body.compliance(np.array(2 * np.pi * np.hypot(along_x, along_y))))
        assert 0.5 < made / should < 2.5


@pytest.mark.parametrize(
    ("nx", "ny", "layer"),
    [(64, 1, None), (1, 64, None), (16, 640, None), (640, 16, None), (64, 64, Layer(0.05, "bonded", 0.5))],
)
def test_none_where_they_are_no_good(nx: int, ny: int, layer: Layer | None) -> None:
    """On lines, on cells that are too long for pairs, and where long waves are stiff; nothing is held."""
    slab, body = Slab.alone(nx, ny), HalfSpace((1.0, 1.0), layer=layer)
    assert CellSums.on(slab, body.size, body.compliance) is None
    assert CellSums.footprint(nx, ny, 1, 0, body.size, body.compliance) == 0


@pytest.mark.mpi
@pytest.mark.parametrize(("nx", "ny"), [(24, 20), (41, 9), (8, 2), (9, 41)])
def test_footprint(nx: int, ny: int) -> None:
    """The bytes that it names are held, on any ranks."""
    slab, body = Slab(MPI.COMM_WORLD, nx, ny), HalfSpace((1.0, 1.0))
    before = slab.tally["map bytes"]
    made = CellSums.on(slab, body.size, body.compliance)
    assert made is not None
    said = CellSums.footprint(nx, ny, slab.comm.size, slab.comm.rank, body.size, body.compliance)
    assert slab.tally["map bytes"] - before == said

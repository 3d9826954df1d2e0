"""The extension of residuals against products of small matrices, on any ranks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpi4py import MPI
from numpy.typing import NDArray

from parcontact.contact.preconditioner import FLOOR, ExtendedPreconditioner, Grids, grids_for
from parcontact.parallel.slab import Array, Slab

Map = NDArray[np.float64]
SINGLE = 1e-5  # relative, of sums in single precision: some hundred roundings of 6e-8


class Doubling:
    """Twice a map; it remembers what it was given."""

    def apply(self, field: Array, out: Array) -> Array:
        self.given = field.copy()
        np.multiply(field, 2.0, out=out)
        return out


def adding(count: int) -> Map:
    """Points -> cells of two, along one direction."""
    return np.array([[float(i // 2 == cell) for i in range(count)] for cell in range((count + 1) // 2)])


def interpolating(count: int) -> Map:
    """Cells -> points along one direction, cyclic: 3/4 of the cell of a point, 1/4 of the nearest other one."""
    cells = (count + 1) // 2
    weights = np.zeros((count, cells))
    for i in range(count):
        weights[i, i // 2] += 0.75
        weights[i, (i // 2 + (1 if i % 2 else -1)) % cells] += 0.25
    return weights


def fewer(pairs: int) -> int:
    """Pairs that are left on the next grid."""
    return pairs - int(np.sign(pairs))


def extended(s: Map, w: Map, points: Map, pairs: int = 0) -> Map:
    """The sums s and w over cells of a given number of points, extended: `(s + f I e)/(w + f)`; first over a given
    number of `pairs`, below 0 along y."""
    ny, nx = s.shape
    if s.size == 1:
        return np.asarray(s / (w + FLOOR * points))
    down, told_down = (np.eye(ny), np.eye(ny)) if pairs > 0 else (adding(ny), interpolating(ny))
    across, told_across = (np.eye(nx), np.eye(nx)) if pairs < 0 else (adding(nx), interpolating(nx))
    s_above, w_above, points_above = (down @ field @ across.T for field in (s, w, points))
    above = extended(s_above, w_above, points_above, fewer(pairs))
    stated = told_down @ above @ told_across.T
    if points.max() == 1.0:
        return np.where(w > 0.0, s, stated)
    return np.asarray((s + FLOOR * points * stated) / (w + FLOOR * points))


@pytest.mark.mpi
@settings(max_examples=30)
@given(
    ny=st.integers(1, 34),
    nx=st.sampled_from([1, 7, 14, 200]),
    filled=st.sampled_from([0.003, 0.4]),
    pairs=st.integers(-2, 2),
    seed=st.integers(0, 99),
)
def test_extends_by_means_over_cells_of_all_sizes(ny: int, nx: int, filled: float, pairs: int, seed: int) -> None:
    """What K is given is that of products of matrices, to single precision."""
    random = np.random.default_rng([ny, nx, seed])
    slab, inverse = Slab(MPI.COMM_WORLD, nx, ny), Doubling()
    c = random.random((ny, nx)) < filled
    r = np.where(c, random.normal(size=(ny, nx)), 0.0)
    z = slab.empty()
    z[...] = r[slab.rows]
    ExtendedPreconditioner(slab, larger=Grids(None, pairs)).apply(inverse, c[slab.rows].copy(), z)
    if c.size > 1:
        expected = extended(r, c.astype(float), np.ones(c.shape), pairs)
        np.testing.assert_allclose(inverse.given, expected[slab.rows], rtol=0, atol=SINGLE * np.abs(expected).max())


@pytest.mark.mpi
@settings(max_examples=30)
@given(ny=st.integers(1, 34), nx=st.sampled_from([1, 7, 14, 200]), pairs=st.integers(-2, 2), seed=st.integers(0, 99))
def test_brings_back_by_the_transpose(ny: int, nx: int, pairs: int, seed: int) -> None:
    """`<r, E' K E s> = <E r, K E s>` for any residuals r and s on the set, to single precision."""
    random = np.random.default_rng([ny, nx, seed])
    slab, inverse = Slab(MPI.COMM_WORLD, nx, ny), Doubling()
    extended = ExtendedPreconditioner(slab, larger=Grids(None, pairs))
    c = (random.random((ny, nx)) < 0.2)[slab.rows].copy()
    r, s = (np.where(c, random.normal(size=(ny, nx))[slab.rows], 0.0) for _ in range(2))
    z = r.copy()
    extended.apply(inverse, c, z)
    r_extended = inverse.given
    z[...] = s
    extended.apply(inverse, c, z)
    left, right, size = slab.sum(
        float(np.sum(r * np.where(c, z, 0.0))),
        float(np.sum(r_extended * 2.0 * inverse.given)),
        float(np.sum(np.abs(r_extended * 2.0 * inverse.given))),
    )
    assert abs(left - right) <= SINGLE * size


def test_cells_are_no_longer_than_the_reach() -> None:
    """Three doublings to eight points; two of them along x where points are four times closer, to sixteen."""
    assert grids_for(1.0, 1.0, 8.0) == Grids(3, 0)
    assert grids_for(1.0, 4.0, 16.0) == Grids(4, 2)
    assert grids_for(1.0, 1.0, 0.1) == Grids(1, 0)
    assert grids_for(1.0, 17.0, 8.0) == Grids(0)

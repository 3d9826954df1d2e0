"""Maps between grids, on any number of ranks; against numpy on the whole map."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpi4py import MPI
from numpy.typing import NDArray

from parcontact.parallel import regrid
from parcontact.parallel.slab import Slab

pytestmark = pytest.mark.mpi

GRIDS = {"cells": st.integers(1, 9), "fx": st.integers(1, 3), "fy": st.integers(1, 3)}


def pair(cells: int, fx: int, fy: int) -> tuple[Slab, Slab]:
    """A fine and a coarse grid: fewer coarse rows than ranks, and rows cut apart by ranks, are among them."""
    coarse = Slab(MPI.COMM_WORLD, 4, cells)
    return coarse.resized(4 * fx, cells * fy), coarse


def field(slab: Slab, seed: int = 0, dtype: type = np.float64) -> tuple[NDArray, NDArray]:
    """A whole map, and this rank's rows of it."""
    whole: NDArray = np.random.default_rng(seed).normal(size=(slab.ny, slab.nx)).astype(dtype)
    own = slab.empty(dtype)
    own[...] = whole[slab.rows]
    return whole, own


@settings(max_examples=30)
@given(**GRIDS)
def test_restricts_to_means(cells: int, fx: int, fy: int) -> None:
    """To rounding."""
    fine, coarse = pair(cells, fx, fy)
    whole, own = field(fine)
    means = whole.reshape(cells, fy, 4, fx).mean(axis=(1, 3))
    np.testing.assert_allclose(regrid.restrict(fine, coarse, own), means[coarse.rows], rtol=0, atol=1e-15)


@settings(max_examples=30)
@given(**GRIDS, single=st.booleans())
def test_prolongs_by_copies(cells: int, fx: int, fy: int, single: bool) -> None:
    """Copies, so equal."""
    fine, coarse = pair(cells, fx, fy)
    whole, own = field(coarse, dtype=np.float32 if single else np.float64)
    found = regrid.prolong(coarse, fine, own, fine.empty(own.dtype))
    np.testing.assert_array_equal(found, np.kron(whole, np.ones((fy, fx)))[fine.rows])


@settings(max_examples=30)
@given(**GRIDS)
def test_prolongation_is_the_transpose(cells: int, fx: int, fy: int) -> None:
    """`<prolong c, f> = fx fy <c, restrict f>` and `restrict prolong c = c`, to rounding."""
    fine, coarse = pair(cells, fx, fy)
    (_, f), (_, c) = field(fine, 1), field(coarse, 2)
    up, down = regrid.prolong(coarse, fine, c, fine.empty()), regrid.restrict(fine, coarse, f)
    left, right = fine.sum(float((up * f).sum()), float((c * down).sum()))
    assert left == pytest.approx(fx * fy * right, rel=1e-12, abs=1e-12)
    np.testing.assert_allclose(regrid.restrict(fine, coarse, up), c, rtol=1e-15)


@settings(max_examples=30)
@given(ny=st.integers(1, 9), seed=st.integers(0, 99))
def test_fetches_what_each_rank_wants(ny: int, seed: int) -> None:
    """Any rows, none too, also more than one rank has; copies, so equal."""
    slab = Slab(MPI.COMM_WORLD, 3, ny)
    bounds = np.sort(np.random.default_rng(seed).integers(0, ny + 1, (slab.comm.size, 2)))
    wanted = [slice(int(start), int(stop)) for start, stop in bounds]
    whole, own = field(slab)
    np.testing.assert_array_equal(regrid.fetch(slab, own, wanted), whole[wanted[slab.comm.rank]])


def test_counts_what_is_sent() -> None:
    """Each rank takes the rows of the next one; its own cost nothing."""
    size = MPI.COMM_WORLD.size
    slab = Slab(MPI.COMM_WORLD, 2, size)
    regrid.fetch(slab, slab.zeros(), slab.dealt)
    assert slab.tally["bytes sent"] == 0
    regrid.fetch(slab, slab.zeros(), slab.dealt[1:] + slab.dealt[:1])
    assert slab.tally["bytes sent"] == (16 if size > 1 else 0)

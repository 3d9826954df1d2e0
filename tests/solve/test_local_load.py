"""Cutting off at 0 and taking back near by, against the same with blocks of numpy, on any ranks.

Tolerance: sums of a few hundred terms in another order, 1e-13 of the sum of their absolute values.
"""

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from parcontact.parallel.slab import Slab
from parcontact.solve.constraint import CELL, NonNegative
from parcontact.solve.local_load import MOST_GIVEN_BACK, LocalLoad

Map = NDArray[np.float64]
ROUNDING, TOTAL = 1e-13, 3.0
ANY_RANKS = pytest.mark.parametrize("shape", [(1, 1), (7, 40), (33, 16), (50, 37), (64, 64)])


def cut_off(values: Map, near_by: bool = True, pairs: int = 0) -> tuple[slice, Map, float, float]:
    """The rows that this rank has, their pressure after the cut, made to have the sum TOTAL, and the load and the cut
    that are returned."""
    slab = Slab(MPI.COMM_WORLD, values.shape[1], values.shape[0])
    p, t = values[slab.rows] + 2.0, np.full(values[slab.rows].shape, 4.0)
    local = LocalLoad(slab, pairs)
    load, cut = local.advance(NonNegative(), p, t, 0.5, p)
    if load > 0.0:
        local.restore(NonNegative(), p, load, TOTAL, near_by)
    return slab.rows, p, load, cut


def expected(values: Map, rows: int, columns: int) -> Map:
    """Cell by cell, of so many rows and columns."""
    out = np.maximum(values, 0.0)
    for j in range(0, values.shape[0], rows):
        for i in range(0, values.shape[1], columns):
            cell = np.s_[j : j + rows, i : i + columns]
            load = out[cell].sum()
            share = min((load - values[cell].sum()) / load, MOST_GIVEN_BACK) if load > 0.0 else 0.0
            out[cell] *= 1.0 - share
    return out


def pressures(shape: tuple[int, int], sunk: float) -> Map:
    """Random numbers from -sunk to 1 - sunk."""
    return np.random.default_rng(1).random(shape) - sunk


@pytest.mark.mpi
@ANY_RANKS
@pytest.mark.parametrize("sunk", [0.1, 0.45, 0.9])
@pytest.mark.parametrize(
    ("near_by", "pairs", "cell"),
    [
        (True, 0, (CELL, CELL)),
        (True, 1, (8, CELL)),
        (True, 4, (4, CELL)),
        (True, -2, (CELL, 4)),
        (False, 0, (CELL, CELL)),
    ],
)
def test_each_cell_gives_back_what_was_added_in_it(
    shape: tuple[int, int], sunk: float, near_by: bool, pairs: int, cell: tuple[int, int]
) -> None:
    """Cells have fewer rows where pairs along x make square cells, fewer columns where pairs along y do, but four at
    least."""
    values = pressures(shape, sunk) + 2.0 - 2.0  # with the rounding of what is advanced
    rows, p, load, cut = cut_off(values, near_by, pairs)
    whole = np.maximum(values, 0.0)
    assert_allclose(load, whole.sum(), rtol=ROUNDING)
    assert_allclose(cut, (whole - values).sum(), rtol=ROUNDING, atol=ROUNDING)
    if load > 0.0:
        kept = expected(values, *cell) if near_by else whole
        assert_allclose(p, (TOTAL / kept.sum() * kept)[rows], rtol=ROUNDING)


def test_nothing_and_not_a_number() -> None:
    """Pressures that are all negative leave 0; what is not a number stays so."""
    assert cut_off(np.full((20, 20), -1.0))[2] == 0.0
    values = pressures((20, 20), 0.4)
    values[3, 3] = np.nan
    _, p, load, cut = cut_off(values)
    assert np.isnan(load)
    assert np.isnan(cut)
    assert np.isnan(p[3, 3])

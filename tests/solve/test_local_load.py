"""Cutting off at 0 and taking back near by, against the same with blocks of numpy, on any ranks.

Tolerance: sums of a few hundred terms in another order, 1e-13 of the sum of their absolute values.
"""

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from parcontact.parallel.slab import Slab
from parcontact.solve.local_load import CELL, LEAST, MOST, LocalLoad

Map = NDArray[np.float64]
ROUNDING = 1e-13
ANY_RANKS = pytest.mark.parametrize("shape", [(1, 1), (7, 40), (33, 16), (50, 37), (64, 64)])


def cut_off(values: Map) -> tuple[slice, Map, float]:
    """The rows that this rank has, their pressure after the cut, and the sum that is returned."""
    slab = Slab(MPI.COMM_WORLD, values.shape[1], values.shape[0])
    p = values[slab.rows].copy()
    return slab.rows, p, LocalLoad(slab).cut_off(p)


def expected(values: Map) -> Map:
    """Cell by cell."""
    out = np.maximum(values, 0.0)
    for j in range(0, values.shape[0], CELL):
        for i in range(0, values.shape[1], CELL):
            cell = np.s_[j : j + CELL, i : i + CELL]
            load = out[cell].sum()
            share = min((load - values[cell].sum()) / load, MOST) if load > 0.0 else 0.0
            out[cell] *= 1.0 - share
    return out


def pressures(shape: tuple[int, int], sunk: float) -> Map:
    """Random numbers from -sunk to 1 - sunk."""
    return np.random.default_rng(1).random(shape) - sunk


@pytest.mark.mpi
@ANY_RANKS
@pytest.mark.parametrize("sunk", [0.1, 0.45, 0.9])
def test_each_cell_gives_back_what_was_added_in_it(shape: tuple[int, int], sunk: float) -> None:
    values = pressures(shape, sunk)
    rows, p, load = cut_off(values)
    assert_allclose(p, expected(values)[rows], rtol=ROUNDING)
    assert_allclose(load, expected(values).sum(), rtol=ROUNDING)


@pytest.mark.mpi
@ANY_RANKS
def test_little_is_not_taken_back(shape: tuple[int, int]) -> None:
    """Nothing else than a cut where that adds a third of LEAST."""
    values = pressures(shape, 0.0)
    rest = values.sum() - values[0, 0]
    values[0, 0] = -LEAST / 3 * rest
    rows, p, load = cut_off(values)
    assert np.array_equal(p, np.maximum(values, 0.0)[rows])
    assert_allclose(load, rest, rtol=ROUNDING)


def test_nothing_and_not_a_number() -> None:
    """Pressures that are all negative leave 0; what is not a number stays so."""
    assert cut_off(np.full((20, 20), -1.0))[2] == 0.0
    values = pressures((20, 20), 0.4)
    values[3, 3] = np.nan
    assert np.isnan(cut_off(values)[2])

"""Rows that move along y, across ranks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpi4py import MPI

from parcontact.parallel import rows
from parcontact.parallel.slab import Slab

pytestmark = pytest.mark.mpi


@settings(max_examples=60)
@given(ny=st.integers(1, 9), count=st.integers(-20, 20), single=st.booleans())
def test_rolls_like_numpy(ny: int, count: int, single: bool) -> None:
    """Copies, so equal; fewer rows than ranks is among the examples."""
    slab = Slab(MPI.COMM_WORLD, 3, ny)
    whole = np.arange(3.0 * ny).reshape(ny, 3).astype(np.float32 if single else np.float64)
    field, out = slab.empty(whole.dtype), slab.empty(whole.dtype)
    field[...] = whole[slab.rows]
    np.testing.assert_array_equal(rows.roll(slab, field, count, out), np.roll(whole, count, axis=0)[slab.rows])
    np.testing.assert_array_equal(field, whole[slab.rows])


@settings(max_examples=40)
@given(ny=st.integers(1, 9), cyclic=st.booleans())
def test_row_before_the_first(ny: int, cyclic: bool) -> None:
    """Copies, so equal; only ranks that have rows have one before them."""
    slab = Slab(MPI.COMM_WORLD, 3, ny)
    whole = np.arange(3.0 * ny).reshape(ny, 3)
    field, first = whole[slab.rows].copy(), slab.rows.start
    sent = slab.tally["bytes sent"]
    before = rows.before_first(slab, field, cyclic)
    if slab.rows.start < slab.rows.stop:
        np.testing.assert_array_equal(before, whole[first - 1 if cyclic or first else 0])
    assert before.shape == (3,)
    assert slab.tally["bytes sent"] - sent <= 24  # one row


def test_counts_what_is_sent() -> None:
    slab = Slab(MPI.COMM_WORLD, 4, 8)
    rows.roll(slab, slab.zeros(), 8, slab.empty())
    assert slab.tally["bytes sent"] == 0
    rows.roll(slab, slab.zeros(), 1, slab.empty())
    assert slab.tally["bytes sent"] == (32 if slab.comm.size > 1 else 0)

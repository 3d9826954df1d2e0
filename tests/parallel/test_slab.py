"""Who owns which rows, and sums over all of them, on any number of ranks."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpi4py import MPI

from parcontact.parallel import regrid
from parcontact.parallel.slab import Slab, Tally, allocate, deal

pytestmark = pytest.mark.mpi


@given(count=st.integers(0, 200), ranks=st.integers(1, 50))
def test_parts_follow_each_other_and_are_even(count: int, ranks: int) -> None:
    parts = deal(count, ranks)
    assert [index for part in parts for index in range(count)[part]] == list(range(count))
    sizes = [part.stop - part.start for part in parts]
    assert max(sizes) - min(sizes) <= 1


@pytest.mark.parametrize("ny", [1, 2, 3, 7, 64])
def test_rows(communicators: list[MPI.Intracomm], ny: int) -> None:
    for comm in communicators:
        slab = Slab(comm, 5, ny)
        assert slab.shape == (slab.rows.stop - slab.rows.start, 5)
        assert sum(slab.from_all(slab.shape[0])) == ny
        assert slab.points == 5 * ny
        finer = slab.resized(10, 2 * ny)
        assert (finer.nx, finer.ny, finer.comm) == (10, 2 * ny, comm)
        assert finer.tally is slab.tally


def test_sums_and_maxima(communicators: list[MPI.Intracomm]) -> None:
    """In one message; exact because all numbers are small integers."""
    for comm in communicators:
        slab = Slab(comm, 4, 4)
        rank, size = comm.rank, comm.size
        triangle = size * (size - 1) / 2
        assert slab.sum(1.0, rank, -rank) == [size, triangle, -triangle]
        assert slab.reduce([1.0, rank], [rank, -rank]) == [size, triangle, size - 1, 0.0]
        assert slab.reduce([], [float(rank)]) == [size - 1]
        assert slab.tally["allreduce"] == 3
        assert all(type(value) is float for value in slab.reduce([1], [rank]))


def test_nothing_hides_a_nan(comm: MPI.Intracomm) -> None:
    slab = Slab(comm, 4, 4)
    mine = math.nan if comm.rank == comm.size - 1 else 1.0
    total, largest = slab.reduce([mine], [mine])
    assert math.isnan(total)
    assert math.isnan(largest)


def test_all_ranks_get_the_same_bits(communicators: list[MPI.Intracomm]) -> None:
    """Also the same as the sum in the order of ranks: a run repeated on as many ranks takes the same decisions."""
    for comm in communicators:
        slab = Slab(comm, 4, 4)
        values = 10.0 ** np.random.default_rng(comm.rank).uniform(-8, 8, 7)
        result = slab.reduce(values.tolist(), values.tolist())
        everyone = np.array(slab.from_all(values))
        assert result == [*(sum(column) for column in everyone.T), *everyone.max(axis=0)]
        assert slab.from_all(result) == [result] * comm.size


def test_any_number_of_slabs(comm: MPI.Intracomm) -> None:
    """MPI has few handles for operators; none are used."""
    for count in range(100):
        assert Slab(comm, 1, 1).reduce([1.0] * count, [1.0]) == [comm.size] * count + [1.0]


def test_root_is_believed(communicators: list[MPI.Intracomm]) -> None:
    for comm in communicators:
        slab = Slab(comm, 4, 4)
        assert slab.root == (comm.rank == 0)
        assert slab.agree(comm.rank) == 0
        assert slab.from_all(comm.rank) == list(range(comm.size))


def test_maps_are_counted_while_they_are_held() -> None:
    """Also through views of them."""
    tally = Tally()
    kept = allocate((8, 4), np.float64, tally)
    part = allocate((8, 4), np.float32, tally)[2:]
    assert tally["map bytes"] == 256 + 128
    del part
    assert tally["map bytes"] == kept.nbytes
    assert tally["map bytes at most"] == 256 + 128


# -- rows that move along y, across ranks -----------------------------------------------------------------------------


@settings(max_examples=60)
@given(ny=st.integers(1, 9), count=st.integers(-20, 20), single=st.booleans())
def test_rolls_like_numpy(ny: int, count: int, single: bool) -> None:
    """Copies, so equal; fewer rows than ranks is among the examples."""
    slab = Slab(MPI.COMM_WORLD, 3, ny)
    whole = np.arange(3.0 * ny).reshape(ny, 3).astype(np.float32 if single else np.float64)
    field, out = slab.empty(whole.dtype), slab.empty(whole.dtype)
    field[...] = whole[slab.rows]
    np.testing.assert_array_equal(regrid.roll_rows(slab, field, count, out), np.roll(whole, count, axis=0)[slab.rows])
    np.testing.assert_array_equal(field, whole[slab.rows])


@settings(max_examples=40)
@given(ny=st.integers(1, 9), count=st.integers(1, 3), cyclic=st.booleans())
def test_rows_around_those_of_a_rank(ny: int, count: int, cyclic: bool) -> None:
    """Copies, so equal, the nearest first; zeros on ranks without rows."""
    slab = Slab(MPI.COMM_WORLD, 3, ny)
    whole = np.arange(1.0, 3.0 * ny + 1.0).reshape(ny, 3)
    field = whole[slab.rows].copy()
    above, below = regrid.around(slab, field, count, cyclic)
    for found, numbers in ((above, slab.rows.start - 1 - np.arange(count)), (below, slab.rows.stop + np.arange(count))):
        expected = whole[numbers % ny if cyclic else np.clip(numbers, 0, ny - 1)]
        np.testing.assert_array_equal(found, expected if slab.shape[0] else np.zeros((count, 3)))
    np.testing.assert_array_equal(regrid.before_first(slab, field, cyclic), above[0])


def test_counts_what_is_sent() -> None:
    slab = Slab(MPI.COMM_WORLD, 4, 8)
    regrid.roll_rows(slab, slab.zeros(), 8, slab.empty())
    assert slab.tally["bytes sent"] == 0
    regrid.roll_rows(slab, slab.zeros(), 1, slab.empty())
    assert slab.tally["bytes sent"] == (32 if slab.comm.size > 1 else 0)
    regrid.before_first(slab, slab.zeros(), True)
    assert slab.tally["bytes sent"] == (64 if slab.comm.size > 1 else 0)

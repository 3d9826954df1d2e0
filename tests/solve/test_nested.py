"""Nested grids: every one is solved, the coarsest first, and what is not finite is no start for the next."""

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_array_equal

from parcontact.contact.starts import Level, coarser_levels, descend
from parcontact.parallel.slab import Array, Slab

pytestmark = pytest.mark.mpi
NX, NY = 64, 128


def starts(comm: MPI.Intracomm, bad: float | None = None) -> tuple[list[Level], list[Array]]:
    """The levels, and the start of each in the order in which they have one. The solution on each is its start and 1,
    but for one point of one rank of the second coarsest."""
    slab, found = Slab(comm, NX, NY), list[Array]()
    levels = coarser_levels(slab, slab.zeros())
    start = slab.empty()
    start.fill(7.0)

    def solve(level: Level, here: Array) -> Array:
        found.append(here.copy())
        solution = here + 1.0
        if bad is not None and level is levels[-2] and level.slab.rows.stop == level.slab.ny:
            solution[-1:, -1:] = bad
        return solution

    descend(levels, solve, start)
    return levels, [*found, start]


def test_each_starts_from_the_solution_on_the_next_coarser_one(comm: MPI.Intracomm) -> None:
    """Which is 1 more on each of them; the finest is not solved here."""
    levels, found = starts(comm)
    assert len(levels) == 3
    assert [here.shape for here in found] == [level.slab.shape for level in reversed(levels)]
    for number, here in enumerate(found):
        assert_array_equal(here, number)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_not_finite_is_no_start(comm: MPI.Intracomm, bad: float) -> None:
    """On all ranks, though a single one has the point: the next grid starts from 0."""
    levels, found = starts(comm, bad)
    assert_array_equal(found[-2], 1.0)
    assert_array_equal(found[-1], 0.0)
    assert found[-1].shape == levels[0].slab.shape

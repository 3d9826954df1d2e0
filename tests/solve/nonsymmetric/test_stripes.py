"""The preconditioner with means of stripes: what it gives to the operator, and that it is symmetric, on any ranks."""

import numpy as np
import pytest
from mpi4py import MPI

from parcontact.parallel.slab import Array, Slab
from parcontact.solve.nonsymmetric.stripes import FLOOR, Stripes
from parcontact.solve.preconditioner.extension import ExtendedPreconditioner

NX, NY = 24, 20
SINGLE = 1e-5  # relative, of sums in single precision: some hundred roundings of 6e-8
ALONG = pytest.mark.parametrize("along", [0, 1])


class Doubling:
    """Twice a map; it remembers what it was given."""

    def apply(self, field: Array, out: Array) -> Array:
        self.given = field.copy()
        np.multiply(field, 2.0, out=out)
        return out


def drawn(slab: Slab, seed: int) -> Array:
    return np.random.default_rng(seed).normal(size=(NY, NX))[slab.rows]


@pytest.mark.mpi
@ALONG
def test_full_contact(comm: MPI.Intracomm, along: int) -> None:
    """On all points nothing is to be carried on."""
    slab = Slab(comm, NX, NY)
    stripes = Stripes(slab, Doubling(), ExtendedPreconditioner(slab), along)
    r, z = drawn(slab, 1), slab.empty()
    stripes.apply(np.ones(slab.shape, dtype=np.bool_), r, z)
    np.testing.assert_allclose(z, 2.0 * r, rtol=0, atol=SINGLE)


@pytest.mark.mpi
@ALONG
def test_means_are_carried_on_along_stripes(comm: MPI.Intracomm, along: int) -> None:
    """A residual that is the same along each stripe: of half the points of a stripe, 1/(1 + 2 FLOOR) of it everywhere
    in the stripe; the rest of it, 2 FLOOR, as without stripes."""
    slab, doubling = Slab(comm, NX, NY), Doubling()
    stripes = Stripes(slab, doubling, ExtendedPreconditioner(slab), along)
    of_stripes = np.random.default_rng(2).uniform(1.0, 2.0, (NY, 1) if along == 1 else (1, NX))
    value = np.broadcast_to(of_stripes, (NY, NX))[slab.rows]
    working = (np.indices((NY, NX)).sum(axis=0) % 2 == 0)[slab.rows]
    stripes.apply(working, np.where(working, value, 0.0), slab.empty())
    np.testing.assert_allclose(doubling.given, value, rtol=4.0 * FLOOR)


@pytest.mark.mpi
@ALONG
def test_symmetric(comm: MPI.Intracomm, along: int) -> None:
    """The transpose brings back what is carried on: `a K b = b K a` on a set, if K is symmetric."""
    slab = Slab(comm, NX, NY)
    stripes = Stripes(slab, Doubling(), ExtendedPreconditioner(slab), along)
    working = drawn(slab, 3) > 0.5
    a, b = (np.where(working, drawn(slab, seed), 0.0) for seed in (4, 5))
    of_a, of_b = slab.empty(), slab.empty()
    stripes.apply(working, a, of_a)
    stripes.apply(working, b, of_b)
    one, other, size = slab.sum(*(float(np.sum(working * x * y)) for x, y in ((a, of_b), (b, of_a), (b, of_b))))
    assert one == pytest.approx(other, abs=SINGLE * size)

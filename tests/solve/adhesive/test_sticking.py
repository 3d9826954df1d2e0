"""Contacts that stick on a free body: the state that the energy falls to, beside that of a matrix."""

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.halfspace import HalfSpace
from parcontact.solve.adhesive.free_inverse import FreeInverse
from parcontact.solve.adhesive.iterate import GapOperators
from parcontact.solve.adhesive.law import Law
from parcontact.solve.adhesive.solver import GapSolver
from parcontact.solve.adhesive.sticking import StickingSolver
from parcontact.solve.problem import Approach, Control, MeanPressure, Operator
from parcontact.solve.workspace import Workspace

TIGHT = 1e-6
Map = NDArray[np.float64]


def sticking(comm: MPI.Intracomm, points: int) -> tuple[Slab, Operator, StickingSolver]:
    """A free box of length 1, its operator and a solver."""
    slab = Slab(comm, points, points)
    half_space = HalfSpace((1.0, 1.0), kernel="love", free=True)
    gaps = GapSolver(slab, GapOperators(*half_space.gap_operators(FFT(slab))), 500)
    free = half_space.operator(FFT(slab, (2 * points, 2 * points)))
    return slab, free, StickingSolver(gaps, Workspace(slab, TIGHT), TIGHT, free)


def stiffness(points: int) -> Map:
    """The inverse of the operator, as a matrix."""
    slab, free, _ = sticking(MPI.COMM_SELF, points)
    columns = [free.apply(unit.reshape(slab.shape), slab.zeros()).ravel() for unit in np.eye(points**2)]
    return np.linalg.inv(np.array(columns))


def fallen(law: Law, heights: Map, control: Control, gap: Map) -> Map:
    """The gap to which the energy falls from another one, in steps that are too short to pass over an equilibrium.
    Under a load the body is free to move evenly, which the pressures of an even displacement do not resist."""
    k, h, g = stiffness(len(heights)), heights.ravel(), gap.ravel()
    even = k.sum(axis=1)
    if isinstance(control, Approach):
        given = even * control.value
    else:
        k, given = k - np.outer(even, even) / even.sum(), even / even.mean() * control.value
    step = 1.0 / np.linalg.eigvalsh(k)[-1]
    for _ in range(100_000):
        pushed = k @ (g + h) + given + law.strength * np.exp(-g / law.range)
        last, g = g, np.maximum(g - step * pushed, 0.0)
        if abs(g - last).max() < 1e-13:
            break
    return g.reshape(heights.shape)


@pytest.mark.mpi
@pytest.mark.parametrize("means", [True, False])
@pytest.mark.parametrize("points", [4, 24])
def test_inverse_of_a_free_body(comm: MPI.Intracomm, points: int, means: bool) -> None:
    """It gives back the pressure that was applied, also but for what moves all points alike, where its load is 0. The
    tolerance is that of the energy's root, which bounds pressures by the root of the largest compliance over the
    smallest: below 10 on these grids."""
    slab, free, solver = sticking(comm, points)
    p, pressures = slab.zeros(), np.random.default_rng(1).normal(size=(points, points))
    p[...] = (pressures if means else pressures - pressures.mean())[slab.rows]
    u = free.apply(p, slab.zeros())
    u += 0.0 if means else 3.0
    maps = slab.zeros(), slab.zeros(), slab.zeros(), slab.zeros()
    back = FreeInverse(slab, free, solver.gaps.operators, 1e-9, maps, means).apply(u, u)
    assert_allclose(back, p, rtol=0.0, atol=1e-8 * points)


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("points", "law", "control"),
    [
        (4, Law(0, 16.7, 1.16), Approach(-3.0)),
        (7, Law(0, 32.2, 1.3), Approach(-3.0)),
        (4, Law(0, 5.4, 0.57), MeanPressure(0.7)),
        (6, Law(0, 13.4, 0.81), MeanPressure(-2.1)),
    ],
    ids=str,
)
def test_a_state_that_is_stable_on_the_free_body_alone(
    comm: MPI.Intracomm, points: int, law: Law, control: Control
) -> None:
    """A wave that fills its box, near a snap. The body that repeats itself is softer, as neighbours are across the
    edge, and passes go round. The gap is that of the matrix, to 30 tolerances: so near to a snap little moves much."""
    heights = np.tile(np.cos(2.0 * np.pi * np.arange(points) / points), (points, 1))
    start = heights.max() - heights
    if isinstance(control, Approach):
        start = np.maximum(-heights - control.value, 0.0)
    expected = fallen(law, heights, control, start)
    slab, free, solver = sticking(comm, points)
    gap, lag, p = slab.zeros(), slab.zeros(), slab.zeros()
    gap[...] = start[slab.rows]
    contact, detached = solver.solve(law, heights[slab.rows], control, gap, lag, p)
    assert not contact.failure
    assert not detached
    assert contact.certificate.worst <= TIGHT
    assert_array_equal(gap == 0.0, expected[slab.rows] == 0.0)
    assert 0.0 < np.mean(expected == 0.0) < 1.0
    assert_allclose(gap, expected[slab.rows], rtol=0.0, atol=30.0 * TIGHT * law.range)
    given = contact.d if isinstance(control, Approach) else slab.sum(float(p.sum()))[0] / slab.points
    assert_allclose(given, control.value, rtol=1e-12)
    assert_allclose(free.apply(p, slab.zeros()), gap + heights[slab.rows] + contact.d, rtol=0.0, atol=10.0 * TIGHT)
    repeated = solver.gaps.operators.operator.apply(p, slab.zeros())
    assert_allclose(lag, free.apply(p, slab.zeros()) - repeated, rtol=0.0, atol=TIGHT)


@pytest.mark.mpi
@pytest.mark.parametrize("pull", [2.697, 2.784])
def test_a_load_that_the_free_body_alone_holds(comm: MPI.Intracomm, pull: float) -> None:
    """The first pass holds it, as what is lagged is that of a contact without load; later ones come off. The gap is
    that of the matrix, to 30 tolerances."""
    points, law = 4, Law(0, 8.7, 0.79)
    heights = np.tile(np.cos(2.0 * np.pi * np.arange(points) / points), (points, 1))
    expected = heights.max() - heights
    slab, _, solver = sticking(comm, points)
    gap, lag, p = slab.zeros(), slab.zeros(), slab.zeros()
    gap[...] = expected[slab.rows]
    for load in (0.0, -pull):
        expected = fallen(law, heights, MeanPressure(load), expected)
        contact, detached = solver.solve(law, heights[slab.rows], MeanPressure(load), gap, lag, p)
        assert not contact.failure
        assert not detached
        assert_allclose(gap, expected[slab.rows], rtol=0.0, atol=30.0 * TIGHT * law.range)
    assert expected.min() == 0.0

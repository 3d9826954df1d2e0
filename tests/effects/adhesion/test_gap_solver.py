"""The solver of gaps on an operator that is a matrix: conditions of contact, and an energy that is not undercut."""

import tracemalloc

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from parcontact.contact.problem import Approach, Control, MeanPressure, Operator, Workspace
from parcontact.effects.adhesion import gap_solver
from parcontact.effects.adhesion.adhesive_law import AdhesiveSolver
from parcontact.effects.adhesion.gap_solver import GapOperators, GapProblem, GapSolution, GapSolver, Law
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.halfspace import HalfSpace
from parcontact.physics.records import Certificate

NX, NY = 24, 20
WEAK = Law(0, 0.4, 0.2)


def solver(free: bool = False) -> tuple[Slab, GapOperators, GapSolver]:
    slab = Slab.alone(NX, NY)
    half_space = HalfSpace((1.0, 1.0), kernel="love" if free else "spectral", free=free)
    operators = GapOperators(*half_space.gap_operators(FFT(slab)))
    return slab, operators, GapSolver(slab, operators, 500)


def heights(slab: Slab) -> np.ndarray:
    x, y = np.arange(NX) / NX - 0.5, np.arange(NY)[:, None] / NY - 0.5
    h = slab.zeros()
    h[...] = -3.0 * (x**2 + y**2) + 0.05 * np.cos(8 * np.pi * x)
    return h


@pytest.mark.parametrize("free", [False, True])
def test_the_inverse_is_the_inverse(free: bool) -> None:
    """Of maps without mean, to rounding; a mean moves by what the operators say, and the inverse forgets it."""
    slab, operators, _ = solver(free)
    field, image, back = slab.zeros(), slab.zeros(), slab.zeros()
    field[...] = np.random.default_rng(1).normal(size=field.shape)
    operators.inverse.apply(operators.operator.apply(field, image), back)
    assert_allclose(back, field - field.mean(), atol=1e-11)
    field.fill(2.0)
    assert_allclose(operators.operator.apply(field, image), 2.0 * operators.least_mean, rtol=1e-12)
    assert operators.mean in (0.0, operators.least_mean)


@pytest.mark.parametrize("control", [Approach(0.3), Approach(0.45), MeanPressure(0.2), MeanPressure(-0.02)])
@pytest.mark.parametrize("free", [False, True])
def test_conditions(free: bool, control: Approach | MeanPressure) -> None:
    """`A p = g + h + d`, `p = -sigma(g)` where the gap is open and no less where it is closed, and the load or approach
    that was asked for; to what the tolerance 1e-8 leaves."""
    slab, operators, solve = solver(free)
    h, gap = heights(slab), slab.zeros()
    gap[...] = np.maximum(-h - 0.1, 0.0)
    found = solve.solve(GapProblem(WEAK, h, control), gap, 1e-8)
    assert not found.failure
    sigma = WEAK.strength * np.exp(-gap / WEAK.range)
    opened = gap > 0.0
    assert gap.min() >= 0.0
    assert opened.any()
    assert_allclose((found.p + sigma)[opened], 0.0, atol=1e-6)
    assert (found.p + sigma)[~opened].min(initial=0.0) >= -1e-6
    u = operators.operator.apply(found.p, slab.zeros()) + (operators.mean - operators.least_mean) * found.p.mean()
    assert_allclose(u, gap + h + found.d, atol=1e-10)
    given = found.d if isinstance(control, Approach) else found.p.mean()
    assert_allclose(given, control.value, rtol=1e-9)


@pytest.mark.parametrize("control", [Approach(0.3), MeanPressure(0.2)])
@pytest.mark.parametrize("free", [False, True])
def test_the_certificate_is_that_of_the_operator(free: bool, control: Approach | MeanPressure) -> None:
    """It is made of `A c`, of which the preconditioned residual is only an estimate, and of the pressures next to the
    law, c, by its definition; to rounding."""
    slab, operators, solve = solver(free)
    h, gap = heights(slab), slab.zeros()
    gap[...] = np.maximum(-h - 0.1, 0.0)
    found = solve.solve(GapProblem(WEAK, h, control), gap, 0.02)
    assert not found.failure
    c = found.p + WEAK.strength * np.exp(-gap / WEAK.range)
    c[(gap == 0.0) & (c > 0.0)] = 0.0
    weight, wrong = abs(found.p) + abs(c), abs(operators.operator.apply(c, slab.zeros()))
    mean = 10.0 * (weight * wrong)[c != 0.0].sum() / weight.sum()
    assert_allclose(found.certificate.complementarity, mean / found.certificate.length, rtol=1e-6)
    alongside = max(2.0 * abs(c).sum(), 5.0 * abs(c.sum()))
    assert_allclose(found.certificate.load, alongside / weight.sum(), rtol=1e-6, atol=1e-14)


def test_nothing_holds_a_load_that_pulls_too_much() -> None:
    """No more than the largest attraction of all points. The surfaces are open everywhere before they are detached."""
    slab, _, solve = solver(free=True)
    h, gap = heights(slab), slab.zeros()
    gap[...] = np.maximum(-h - 0.1, 0.0)
    assert solve.solve(GapProblem(WEAK, h, MeanPressure(-1.01 * WEAK.strength)), gap, 1e-3).detached
    assert gap.min() > 0.0


def test_open_surfaces_that_attract_more_than_the_load_close() -> None:
    """They have not detached."""
    slab, _, solve = solver()
    h, gap = heights(slab), slab.zeros()
    gap[...] = h.max() - h + WEAK.range
    assert np.mean(WEAK.strength * np.exp(-gap / WEAK.range)) > 0.02
    found = solve.solve(GapProblem(WEAK, h, MeanPressure(-0.02)), gap, 1e-6)
    assert not found.failure
    assert not found.detached
    assert gap.min() == 0.0


class Failing:
    """A solver of gaps of which the first solve fails; what it was given."""

    def __init__(self, operators: GapOperators) -> None:
        self.operators = operators
        self.given: list[tuple[np.ndarray, np.ndarray]] = []
        self.held: list[int] = []

    def solve(self, problem: GapProblem, gap: np.ndarray, *_: object) -> GapSolution:
        self.held.append(tracemalloc.get_traced_memory()[0])
        self.given.append((gap.copy(), problem.heights.copy()))
        gap += 1.0
        failure = "" if len(self.given) > 1 else "on purpose"
        return GapSolution(gap, np.zeros_like(gap), 0.0, Certificate(0.0, 0.0, 0.0), 1, failure)


def test_passes_that_begin_again_have_the_same_start_and_no_maps_of_their_own() -> None:
    """Under an approach, of a free body: the gap is that of the first pass, and nothing is lagged. Meanwhile there is
    one map more, heights with the approach."""
    slab, operators, _ = solver(free=True)
    gaps, workspace = Failing(operators), Workspace(slab, 1e-3)
    gap, lag, out = (np.random.default_rng(k).random(slab.shape) for k in range(3))
    sticking = AdhesiveSolver(gaps, workspace, 1e-3, operators.operator)  # type: ignore[arg-type]
    h = heights(slab)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    sticking.solve(GapProblem(WEAK, h, Approach(0.1)), gap, lag, out)
    tracemalloc.stop()
    first, second = gaps.given[:2]
    assert_allclose(second[0], first[0], rtol=0.0, atol=0.0)
    assert_allclose(second[1], h + 0.1, rtol=0.0, atol=0.0)
    assert gaps.held[0] - before < 1.5 * gap.nbytes


# -- compiled loops of contacts that stick against the same in numpy; sums of some hundred numbers, so rounding only --


S, RHO = 2.0, 0.3
LAWS = [Law(gap_solver.EXPONENTIAL, S, RHO), *(Law(gap_solver.DUGDALE, S, RHO, ramp) for ramp in (0.4, 2 * RHO))]


def attraction(one: Law, gap: np.ndarray) -> np.ndarray:
    if one.kind == gap_solver.EXPONENTIAL:
        return S * np.exp(-gap / RHO)
    return np.interp(gap, RHO + 0.5 * one.ramp * np.array([-1.0, 1.0]), [S, 0.0])


def test_decay() -> None:
    """The exponential function of the C library, to what rounding x does to it; 0 beyond 1e-304."""
    found = [gap_solver.decay(x) for x in np.linspace(0.0, 699.0, 2001)]
    assert_allclose(found, np.exp(-np.linspace(0.0, 699.0, 2001)), rtol=700 * np.finfo(float).eps)
    assert [gap_solver.decay(x) for x in (0.0, 700.0, 1e300, np.inf)] == [1.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize("one", LAWS)
def test_energy_and_slope_of_the_attraction(one: Law) -> None:
    """`d gamma/dg = -sigma` by central differences (second order, 1e-4 of the range), `gamma(0) = s rho`, and sigma's
    slope is the softening; between the corners of the laws."""
    step = 1e-4 * RHO

    def energy(gap: float) -> float:
        return gap_solver.energy(one, gap, gap_solver.attraction(one, gap))

    assert_allclose(energy(0.0), S * RHO, rtol=1e-15)
    for gap in (0.1 * RHO, 0.7 * RHO, 1.2 * RHO, 1.5 * RHO, 2.1 * RHO):
        low, high = gap - step, gap + step
        here = gap_solver.attraction(one, gap)
        assert_allclose((energy(low) - energy(high)) / (2 * step), here, rtol=1e-7)
        slope = (gap_solver.attraction(one, low) - gap_solver.attraction(one, high)) / (2 * step)
        assert_allclose(slope, gap_solver.softening(one, here), rtol=1e-7)


@pytest.mark.parametrize("size", [1.0, 1e-4])
@pytest.mark.parametrize("one", LAWS)
def test_change_of_energy(one: Law, size: float) -> None:
    """Along a way that closes gaps, and along a short one, by the integral of the attraction; the mean attraction of a
    short way of the exponential law is exact to 1e-7."""
    gap, q, image, way = np.random.default_rng(4).random((4, 5, 7))
    way, new, sigma, sigma_new = -size * way, *(np.empty_like(gap) for _ in range(3))
    sigma[...] = attraction(one, gap)
    rise, magnitude = gap_solver.move(one, gap, q, 0.2, sigma, 0.5, way, image, new, sigma_new)
    assert_allclose(new, np.maximum(gap + 0.5 * way, 0.0), atol=1e-15)
    assert_allclose(sigma_new, attraction(one, new), rtol=1e-13, atol=1e-15)
    surface = [gap_solver.energy(one, *at) for at in zip(gap.ravel(), sigma.ravel(), strict=True)]
    surface -= np.array([gap_solver.energy(one, *at) for at in zip(new.ravel(), sigma_new.ravel(), strict=True)])
    exact = (0.5 * way * (q + 0.2 + 0.25 * image)).sum() + surface.sum()
    assert_allclose(rise, exact, rtol=1e-12, atol=1e-12 + 1e-7 * np.abs(surface).sum() * (size < 1.0))
    assert magnitude >= abs(rise) * (1.0 - 1e-12)


# -- contacts that stick on a free body: the state that the energy falls to, next to that of a matrix ------------------

TIGHT = 1e-6
Map = NDArray[np.float64]


def sticking(comm: MPI.Intracomm, points: int) -> tuple[Slab, Operator, AdhesiveSolver]:
    """A free box of length 1, its operator and a solver."""
    slab = Slab(comm, points, points)
    half_space = HalfSpace((1.0, 1.0), kernel="love", free=True)
    gaps = GapSolver(slab, GapOperators(*half_space.gap_operators(FFT(slab))), 500)
    free = half_space.operator(FFT(slab, (2 * points, 2 * points)))
    return slab, free, AdhesiveSolver(gaps, Workspace(slab, TIGHT), TIGHT, free)


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
    edge, and passes cycle. The gap is that of the matrix, to 30 tolerances: so near to a snap little moves much."""
    heights = np.tile(np.cos(2.0 * np.pi * np.arange(points) / points), (points, 1))
    start = heights.max() - heights
    if isinstance(control, Approach):
        start = np.maximum(-heights - control.value, 0.0)
    expected = fallen(law, heights, control, start)
    slab, free, solver = sticking(comm, points)
    gap, lag, p = slab.zeros(), slab.zeros(), slab.zeros()
    gap[...] = start[slab.rows]
    contact, detached = solver.solve(GapProblem(law, heights[slab.rows], control), gap, lag, p)
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
    """The first pass holds it, as what is lagged is that of a contact without load; later ones detach. The gap is
    that of the matrix, to 30 tolerances."""
    points, law = 4, Law(0, 8.7, 0.79)
    heights = np.tile(np.cos(2.0 * np.pi * np.arange(points) / points), (points, 1))
    expected = heights.max() - heights
    slab, _, solver = sticking(comm, points)
    gap, lag, p = slab.zeros(), slab.zeros(), slab.zeros()
    gap[...] = expected[slab.rows]
    for load in (0.0, -pull):
        expected = fallen(law, heights, MeanPressure(load), expected)
        contact, detached = solver.solve(GapProblem(law, heights[slab.rows], MeanPressure(load)), gap, lag, p)
        assert not contact.failure
        assert not detached
        assert_allclose(gap, expected[slab.rows], rtol=0.0, atol=30.0 * TIGHT * law.range)
    assert expected.min() == 0.0

"""The solver of gaps on an operator that is a matrix: conditions of contact, and an energy that is not undercut."""

import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.halfspace import HalfSpace
from parcontact.solve.adhesive.iterate import GapOperators, GapSolution
from parcontact.solve.adhesive.law import Law
from parcontact.solve.adhesive.solver import GapSolver
from parcontact.solve.adhesive.sticking import StickingSolver
from parcontact.solve.certificate import Certificate
from parcontact.solve.problem import Approach, MeanPressure
from parcontact.solve.workspace import Workspace

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
    found = solve.solve(WEAK, h, control, gap, 1e-8)
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
    """It is made of `A c`, of which the preconditioned residual is only an estimate, and of the pressures beside the
    law, c, by its definition; to rounding."""
    slab, operators, solve = solver(free)
    h, gap = heights(slab), slab.zeros()
    gap[...] = np.maximum(-h - 0.1, 0.0)
    found = solve.solve(WEAK, h, control, gap, 0.02)
    assert not found.failure
    c = found.p + WEAK.strength * np.exp(-gap / WEAK.range)
    c[(gap == 0.0) & (c > 0.0)] = 0.0
    weight, wrong = abs(found.p) + abs(c), abs(operators.operator.apply(c, slab.zeros()))
    mean = 10.0 * (weight * wrong)[c != 0.0].sum() / weight.sum()
    assert_allclose(found.certificate.complementarity, mean / found.certificate.length, rtol=1e-6)
    beside = max(2.0 * abs(c).sum(), 5.0 * abs(c.sum()))
    assert_allclose(found.certificate.load, beside / weight.sum(), rtol=1e-6, atol=1e-14)


def test_nothing_holds_a_load_that_pulls_too_much() -> None:
    """No more than the largest attraction of all points."""
    slab, _, solve = solver(free=True)
    h, gap = heights(slab), slab.zeros()
    gap[...] = np.maximum(-h - 0.1, 0.0)
    assert solve.solve(WEAK, h, MeanPressure(-1.01 * WEAK.strength), gap, 1e-3).detached


class Failing:
    """A solver of gaps of which the first solve fails; what it was given."""

    def __init__(self, operators: GapOperators) -> None:
        self.operators = operators
        self.given: list[tuple[np.ndarray, np.ndarray]] = []
        self.held: list[int] = []

    def solve(self, law: Law, heights: np.ndarray, control: Approach, gap: np.ndarray, *_: object) -> GapSolution:
        self.held.append(tracemalloc.get_traced_memory()[0])
        self.given.append((gap.copy(), heights.copy()))
        gap += 1.0
        failure = "" if len(self.given) > 1 else "on purpose"
        return GapSolution(gap, np.zeros_like(gap), 0.0, Certificate(0.0, 0.0, 0.0), 1, failure)


def test_passes_that_begin_again_have_the_same_start_and_no_maps_of_their_own() -> None:
    """Under an approach, of a free body: the gap is that of the first pass, and nothing is lagged. Meanwhile there is
    one map more, heights with the approach."""
    slab, operators, _ = solver(free=True)
    gaps, workspace = Failing(operators), Workspace(slab, 1e-3)
    gap, lag, out = (np.random.default_rng(k).random(slab.shape) for k in range(3))
    sticking = StickingSolver(gaps, workspace, 1e-3, operators.operator)  # type: ignore[arg-type]
    h = heights(slab)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    sticking.solve(WEAK, h, Approach(0.1), gap, lag, out)
    tracemalloc.stop()
    first, second = gaps.given[:2]
    assert_allclose(second[0], first[0], rtol=0.0, atol=0.0)
    assert_allclose(second[1], h + 0.1, rtol=0.0, atol=0.0)
    assert gaps.held[0] - before < 1.5 * gap.nbytes

"""Tractions within bounds: against projected gradients on the matrix, in descent, in iterations, and on ranks."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from mpi4py import MPI
from numpy.typing import NDArray

from parcontact.contact.preconditioner import ALL, grids_for
from parcontact.effects.stick.solver import ShearOperator, TangentialSolver, TractionProblem, components, stacked
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Array, Slab
from parcontact.physics.halfspace import HalfSpace

Map = NDArray[np.float64]
SIZE, POISSON = (1.0, 1.0), 0.5
KINDS = ["few", "half", "all but holes", "all"]


@dataclass
class Scene:
    """Bounds on a box, displacements e of points that stick, and a stiffness of the contact."""

    bound: Map
    aim: Map
    kappa: float

    def rows(self, slab: Slab, tolerance: float) -> TractionProblem:
        """This rank's rows of the problem."""
        aim = np.concatenate([part[slab.rows] for part in self.aim])
        return TractionProblem(self.bound[slab.rows].copy(), aim, self.kappa, tolerance)


def solver_of(slab: Slab, free: bool, limit: int = 500) -> TangentialSolver:
    fft = FFT(slab)
    operator = ShearOperator(fft, SIZE, POISSON, free)
    inverse = HalfSpace(SIZE, POISSON, "love" if free else "spectral", free).inverse(fft)
    return TangentialSolver(slab, operator, inverse, ALL, limit)


def scene(kind: str, points: int, free: bool = False) -> Scene:
    """A pattern of bumps, the same on any grid, which sticks in part: points move by different ways, mainly along x."""
    x, y = np.meshgrid(*[2 * np.pi * np.arange(points) / points] * 2)
    waves = np.cos(2 * x) + np.cos(3 * y) + np.cos(x + 2 * y + 1.0)
    level = {"few": 1.2, "half": 0.0, "all but holes": -1.5, "all": -4.0}[kind]
    bound = np.maximum(waves - level, 0.0)
    slab = Slab.alone(points, points)
    tractions, u = np.concatenate([bound, 0.0 * bound]), stacked(slab).zeros()
    ShearOperator(FFT(slab), SIZE, POISSON, free).apply(tractions, u)
    above = bound - (0.0 if free else bound.mean())
    way = 0.7 * float(np.abs(u).max())
    aim = way * np.array([1.0 + 0.3 * np.cos(y), 0.2 + 0.3 * np.sin(x + 1.0)])
    return Scene(bound, aim, float((above**2).sum() / (tractions * u).sum()))


def matrix_of(solver: TangentialSolver) -> Map:
    """The operator as a matrix, one column for each traction."""
    both = stacked(solver.slab)
    units = np.eye(both.shape[0] * both.shape[1]).reshape(-1, *both.shape)
    return np.stack([solver._operator.apply(unit, both.zeros()).ravel().copy() for unit in units], axis=1)


def shortened(t: Array, bound: Array) -> Array:
    size = np.hypot(*components(t))
    return t * np.tile(np.where(size > bound, bound / np.where(size > 0.0, size, 1.0), 1.0), (2, 1))


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_solution_is_that_of_projected_gradients(kind: str, free: bool) -> None:
    """The least J agrees with the one of accelerated projected gradients (A. Beck and M. Teboulle, SIAM J. Imaging Sci.
    2 (2009) 183) on the matrix of 12 x 12 points to 1e-9 of <t, e>; tractions meet their bounds to rounding, and
    displacements are A t."""
    solver = solver_of(Slab.alone(12, 12), free)
    given = scene(kind, 12, free).rows(solver.slab, 1e-8)
    bound, e, _, _ = given
    t = np.zeros_like(e)
    solved = solver.solve(given, t, np.zeros_like(t))
    assert not solved.failure
    assert (np.hypot(*components(t)) <= bound * (1.0 + 1e-14)).all()
    matrix = matrix_of(solver)
    np.testing.assert_allclose(solved.displacement.ravel(), matrix @ t.ravel(), rtol=0, atol=1e-13 * given.kappa)
    rate = 1.0 / np.linalg.eigvalsh(matrix)[-1]
    other = ahead = np.zeros_like(t)
    momentum = 1.0
    for _ in range(4000):
        new = shortened(ahead + rate * (e - (matrix @ ahead.ravel()).reshape(e.shape)), bound)
        following = 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * momentum**2))
        ahead, other, momentum = new + (momentum - 1.0) / following * (new - other), new, following
    found, best = (0.5 * one.ravel() @ matrix @ one.ravel() - (one * e).sum() for one in (t, other))
    assert found == pytest.approx(best, rel=0.0, abs=1e-9 * float((t * e).sum()))


@pytest.mark.parametrize("kind", KINDS)
def test_no_iteration_raises_the_energy(kind: str) -> None:
    """J falls with each iteration, to rounding: solves with a limit of 0, 1, 2, ... iterations stop at its iterates."""
    energies = list[float]()
    for limit in range(12):
        solver = solver_of(Slab.alone(24, 24), False, limit)
        given = scene(kind, 24).rows(solver.slab, 1e-14)
        t = shortened(np.concatenate([-0.3 * given.bound, 0.8 * given.bound]), given.bound)
        u = solver.solve(given, t, np.zeros_like(t)).displacement
        energies.append(float((0.5 * t * u - t * given.aim).sum()))
    assert (np.diff(energies) <= 1e-14 * abs(energies[-1])).all()
    assert energies[-1] < energies[0]


@pytest.mark.parametrize("kind", KINDS)
def test_iterations_hardly_depend_on_the_grid(kind: str) -> None:
    """From 32 to 256 points along a side the iterations to 1e-3 grow at most to the double, and stay below 12."""
    found = []
    for points in (32, 256):
        solver = solver_of(Slab.alone(points, points), False)
        given = scene(kind, points).rows(solver.slab, 1e-3)
        solved = solver.solve(given, np.zeros_like(given.aim), np.zeros_like(given.aim))
        assert not solved.failure
        found.append(solved.iterations)
    assert found[1] <= min(2 * found[0], 11)


def test_nothing_resists_a_box_that_sticks() -> None:
    """A uniform displacement of a box in full contact has one solution: it slips as a whole, with all tractions at
    their bounds along it. The mean traction, which no displacement resists, gets there in a few iterations."""
    solver = solver_of(Slab.alone(16, 16), False)
    bound = np.ones((16, 16))
    e = np.concatenate([3e-4 * bound, 4e-4 * bound])
    t = np.zeros_like(e)
    solved = solver.solve(TractionProblem(bound, e, 10.0, 1e-6), t, np.zeros_like(t))
    assert solved.iterations <= 6
    np.testing.assert_allclose(t, np.concatenate([0.6 * bound, 0.8 * bound]), rtol=1e-6)


def test_failures_name_remedies() -> None:
    """A solve that ends at its limit, or at rounding, says so, says what to change, and has admissible tractions."""
    for tolerance, limit, sentence in ((1e-6, 2, "try numerics.max_iterations above 2"), (1e-30, 900, "stalled")):
        solver = solver_of(Slab.alone(24, 24), False, limit)
        given = scene("half", 24).rows(solver.slab, tolerance)
        t = np.zeros_like(given.aim)
        solved = solver.solve(given, t, np.zeros_like(t))
        assert sentence in solved.failure
        assert "smaller steps" in solved.failure
        assert solved.certificate > tolerance
        assert (np.hypot(*components(t)) <= given.bound * (1.0 + 1e-14)).all()


def test_points_that_slip_along_x_are_not_moved_along_it() -> None:
    """Where all points slip along x, tractions can only turn: the preconditioner is applied to the component along y
    alone, so that each iteration counts 3 operators, after 3 for the start and its certificate."""
    solver = solver_of(Slab.alone(16, 16), False, limit=1)
    bound = scene("few", 16).bound
    e = np.concatenate([np.full_like(bound, 100.0), 10.0 * np.sin(np.arange(16)) + np.zeros_like(bound)])
    t = np.concatenate([bound, 0.0 * bound])
    solver.solve(TractionProblem(bound, e, scene("few", 16).kappa, 1e-3), t, np.zeros_like(t))
    assert solver.slab.tally["operator"] == 3 + 3


@pytest.mark.parametrize("steps", [5, 80])
def test_errors_of_many_steps_do_not_add_up(steps: int) -> None:
    """A certificate is below 0.2 times the change since the last step, so that tractions that grow evenly over any
    number of steps from 0, each from the last ones, are right to a share of the last change and of the tolerance."""
    solver = solver_of(Slab.alone(24, 24), False)
    given = scene("half", 24).rows(solver.slab, 0.05)
    t, exact = np.zeros_like(given.aim), np.zeros_like(given.aim)
    for step in range(1, steps + 1):
        last, problem = t.copy(), given._replace(aim=given.aim * step / steps)
        solved = solver.solve(problem, t, last)
        change, size = (float(np.hypot(*components(each)).sum()) for each in (t - last, t))
        assert solved.certificate <= max(0.2 * change / size, 0.1 * 0.05)
    solver.solve(given._replace(tolerance=1e-9), exact, np.zeros_like(exact))
    error, size = (float(np.hypot(*components(each)).sum()) for each in (t - exact, exact))
    assert error <= 0.02 * size


def test_tractions_that_vanish() -> None:
    """If nothing pulls any more tractions are 0. Their errors count relative to the last ones, as none is left."""
    solver = solver_of(Slab.alone(32, 32), False)
    given = scene("half", 32).rows(solver.slab, 1e-2)
    t = np.zeros_like(given.aim)
    solver.solve(given, t, np.zeros_like(t))
    last = t.copy()
    assert not solver.solve(given._replace(aim=np.zeros_like(t)), t, last).failure
    assert np.abs(t).sum() <= 1e-3 * np.abs(last).sum()


def test_a_contact_that_sticks_as_a_whole() -> None:
    """A uniform displacement of half a periodic box that sticks takes five iterations to 1e-2 at most; without a step
    of the mean slip it takes seven."""
    solver = solver_of(Slab.alone(32, 32), False)
    given = scene("half", 32).rows(solver.slab, 1e-2)
    aim = np.concatenate([np.full((32, 32), 1e-6), np.zeros((32, 32))])
    t = np.zeros_like(aim)
    assert solver.solve(given._replace(aim=aim), t, np.zeros_like(t)).iterations <= 5


@pytest.mark.parametrize("ratio", [32, 1000])
def test_steps_adapt_to_a_row_of_long_cells(ratio: int) -> None:
    """In a free row of cells that are long along it, the preconditioner is up to several hundred times too small. Five
    points that stick still have their tractions, those of the matrix, to 1e-6 in at most 50 iterations."""
    points, size = 32, (1.0, 1.0 / 32 / ratio)
    fft = FFT(Slab.alone(points, 1))
    operator = ShearOperator(fft, size, POISSON, True)
    inverse = HalfSpace(size, POISSON, "love", True).inverse(fft)
    spacing = size[0] / points, size[1]
    solver = TangentialSolver(fft.slab, operator, inverse, grids_for(*spacing), 50)
    touches = np.zeros((1, points), np.bool_)
    touches[0, 14:19] = True
    bound, both = 1e9 * touches, np.concatenate([touches, touches])
    e = np.concatenate([1.0 + 0.1 * np.arange(points)[np.newaxis], np.full((1, points), 0.3)])
    t = np.zeros_like(e)
    matrix = matrix_of(solver)[both.ravel()][:, both.ravel()]
    exact = np.linalg.solve(matrix, e[both])
    solver.solve(TractionProblem(bound, e, float(np.abs(exact).max()), 1e-8), t, np.zeros_like(t))
    np.testing.assert_allclose(t[both], exact, rtol=0, atol=1e-6 * np.abs(exact).max())


@pytest.mark.mpi(2, 3, 4)
@pytest.mark.parametrize("free", [False, True])
def test_ranks_have_the_tractions_of_one(comm: MPI.Intracomm, free: bool) -> None:
    """Tractions on ranks, some of them without rows in the smaller box, are those on one rank to the tolerance of
    1e-10, with the same iterations."""
    for points in (3, 20):
        given, results = scene("half", points, free), []
        for slab in (Slab.alone(points, points), Slab(comm, points, points)):
            mine = given.rows(slab, 1e-10)
            t = np.zeros_like(mine.aim)
            results.append((solver_of(slab, free).solve(mine, t, np.zeros_like(t)), t))
        (alone, whole), (together, own) = results
        assert together.iterations == alone.iterations
        rows = Slab(comm, points, points).rows
        for part, other in zip(components(own), components(whole), strict=True):
            np.testing.assert_allclose(part, other[rows], rtol=0, atol=1e-8 * float(given.bound.max()))

"""Sources of error: estimates for the solver, time steps, folded branches and the mesh, of friction and contact area.

Each estimates a relative error from numbers of a step; its constants are fitted to true errors (`constants`). c is the
counted minus the corrected area, over the latter, and N is the number of spots of contact.

solver: proportional to the `complementarity` C of the certificate (`solve.certificate`) for friction, and smaller
for many
    spots. Where friction is far below the slopes it is a small difference of large forces: errors of pressures then
    count more, by the root of the ratio, and pressures with the error C may have tangential forces of this share of the
    slopes (NOISE). For the area: the points that penetrate without pressure, and a small part that varies as C^0.7.
time: from the distance by which spots of contact, or waves of the surface, pass in a step, and from the embedded
pair
    (`time_error`).
folded: the bound for the branches without a map; for the area times the open share. mesh: for the area AREA
c/N^(1/4) while the surface slides and errors of its positions average out, STILL at rest and in
    steady sliding, at least one cell. For friction in a march VIEWS times the difference of friction by the slopes of
    the rigid surface and of the body. For steady friction, a sum of squares without cancellation, the loss at edges in
    waves shorter than the cells, and STEADY_AREA c/N^(1/4). Identical contacts have the same position on the grid:
    their errors do not average out (N = 1), and those of the area and of steady friction are larger by IDENTICAL.
    A map lacks waves on a grid with less than FEW_CELLS per shortest wave, with a further error of friction
    WAVES (4/cells)^2.5.

Loss at edges: the pressure rises from an edge of contact as the root of the distance, so that the mean square of its
waves of wavenumber q across the edge falls as q^-3. In steady sliding these lose power in proportion to q^-3 sin
delta(q v), with the loss angle delta of the body at the frequency with which they pass. For Hertzian contacts of a body
whose loss angle grows with the frequency, all waves together lose as much as this law gives from a wavenumber q0 on: q0
= 2/(pi a) for a strip of half width a, q0 = 3/(pi a) for a circle of radius a, from the integrals of J1(x)^2/x and
j1(x)^2. A mesh of cells of length dx has waves up to Q = pi/dx. The share of the loss in shorter waves is

    s m = (q0/Q)^2 M(Q v)/M(q0 v),      M(w) = int_0^1 2 t sin delta(w/t) dt,      s = q0/Q.

Far below the frequencies of the body m is 1, and the share is of first order in the cell; far above m is s^2.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..physics.prony import Prony, complex_modulus
from .constants import (
    AREA,
    FREE_LOST,
    IDENTICAL,
    LOST,
    NOISE,
    PENETRATING,
    SOLVER,
    SOLVER_AREA,
    STEADY_AREA,
    STILL,
    VIEWS,
    WAVES,
    Fit,
)
from .observation import RunProperties, StepObservation, cell_along, count_spots, mean_over_spots, radius_of
from .time_error import error_of_rise, share_of_area, time_error

STRIP, CIRCLE = 2.0 / math.pi, 3.0 / math.pi  # physics: q0 times the half width, and times the radius
NODES = 16  # accuracy: nodes of the integral; its error is 2 % for one branch
AT, WEIGHTS = np.polynomial.legendre.leggauss(NODES)
STRAIGHT_POWER = 0.5  # accuracy: power of m along edges that follow the grid
GAPS = 2.0  # accuracy: factor on the open share; above half contact radii are those of gaps
FEW_CELLS = 3.0  # accuracy: cells per shortest wave below which a map lacks waves
ROUNDING = 1e-12  # rounding: least complementarity in errors by NOISE, and in steady sliding


@dataclass(frozen=True)
class ErrorPair:
    """Relative errors of friction and of the corrected contact area."""

    friction: float
    area: float


@dataclass(frozen=True)
class ErrorSource:
    """A source of error: its name, a remedy, and a function that gives its errors for an observation."""

    name: str
    remedy: str
    error: Callable[[RunProperties, StepObservation], ErrorPair]
    shown: str = ""  # its name in sentences, if different


def solver_error(run: RunProperties, observed: StepObservation) -> ErrorPair:
    """Return the errors by the solve of a step."""
    certificate, ratio = observed.complementarity, observed.slope / observed.body if observed.body else 0.0
    friction = SOLVER.value * certificate * math.sqrt(max(1.0, ratio)) * mean_over_spots(run, observed)
    noise = NOISE.value * max(certificate, ROUNDING) * ratio / math.sqrt(count_spots(run, observed))
    return ErrorPair(max(friction, noise), _solver_of_area(observed))


def steady_solver_error(run: RunProperties, observed: StepObservation) -> ErrorPair:
    """Return the same for steady sliding, whose friction is a sum of squares."""
    friction = SOLVER.value * max(observed.complementarity, ROUNDING) * mean_over_spots(run, observed)
    return ErrorPair(friction, _solver_of_area(observed))


def _solver_of_area(observed: StepObservation) -> float:
    return SOLVER_AREA.value * observed.complementarity**SOLVER_AREA.order + PENETRATING.value * observed.penetrating


def steps_error(run: RunProperties, observed: StepObservation) -> ErrorPair:
    """Return the errors by the length of a step, including a rise of friction within it. The error that a body states
    itself is also the one of the area."""
    error = time_error(run, observed)
    if observed.own_error is not None:
        return ErrorPair(error, error)
    return ErrorPair(max(error, error_of_rise(run, observed)), share_of_area(run, observed) * error)


def folded_error(run: RunProperties, observed: StepObservation) -> ErrorPair:
    """Return the bound on the errors by folded branches."""
    return ErrorPair(run.folded, run.folded * (1.0 - observed.area))


def mesh_error(run: RunProperties, observed: StepObservation) -> ErrorPair:
    """Return the errors by the mesh in a step of a march."""
    friction = VIEWS.value * observed.friction_mismatch / observed.body if observed.body else 0.0
    return ErrorPair(friction + _lacking_waves(run), _mesh_of_area(AREA if any(observed.way) else STILL, run, observed))


def steady_mesh_error(run: RunProperties, observed: StepObservation) -> ErrorPair:
    """Return the same for steady sliding."""
    correction = observed.correction * mean_over_spots(run, observed)
    friction = _grow_if_identical(run) * (lost_at_edges(run, observed) + STEADY_AREA.value * correction)
    return ErrorPair(friction + _lacking_waves(run), _mesh_of_area(STILL, run, observed))


def _lacking_waves(run: RunProperties) -> float:
    """Return the error of friction by waves that a map lacks on a coarse grid."""
    cells = run.cells_per_wave
    if not run.measured or cells is None or cells >= FEW_CELLS:
        return 0.0
    return WAVES.value * (4.0 / cells) ** WAVES.order


def _mesh_of_area(fit: Fit, run: RunProperties, observed: StepObservation) -> float:
    error = fit.value * _grow_if_identical(run) * observed.correction * mean_over_spots(run, observed)
    return max(error, 1.0 / (run.points * observed.area)) if observed.area > 0.0 else error


def _grow_if_identical(run: RunProperties) -> float:
    return IDENTICAL.value if run.identical_contacts else 1.0


def lost_at_edges(run: RunProperties, observed: StepObservation) -> float:
    """Return an upper bound on the share of friction that edges of contact lose in waves shorter than the cells along
    the sliding; 0 at rest, and for an elastic body."""
    if run.prony is None or not any(observed.way):
        return 0.0
    cell = cell_along(run, observed.way)
    size = radius_of(run, observed) * (run.mean_cell / cell)
    share, slow = lost_in_short_waves(run.prony, size, math.hypot(*observed.way) / cell, run.edges_follow_grid)
    few = min(1.0, GAPS * (1.0 - observed.area))
    most = FREE_LOST.value if run.free else LOST.value
    return min(1.0, most * few * share * slow ** (STRAIGHT_POWER if run.edges_follow_grid else 1.0))


def lost_in_short_waves(prony: Prony, radius: float, speed: float, edges_follow_grid: bool) -> tuple[float, float]:
    """Return s and s m of the module for spots with a `radius` in cells, or straight ones of this half width, that
    slide by `speed` cells per second; both at most 1, and 0 without edges or losses."""
    if radius == math.inf or not prony.moduli.size:
        return 0.0, 0.0
    first = (STRIP if edges_follow_grid else CIRCLE) / radius if radius > 0.0 else math.inf
    if first >= math.pi:
        return 1.0, 1.0
    share = first / math.pi
    return share, share * _mean_loss(prony, math.pi * speed) / _mean_loss(prony, first * speed)


def _mean_loss(prony: Prony, frequency: float) -> float:
    """Return M at a frequency [rad/s]."""
    t = 0.5 * (1.0 + AT)
    modulus = complex_modulus(frequency / t, *prony)
    return float(np.sum(WEIGHTS * t * (modulus.imag / np.abs(modulus))))


SOLVE = ErrorSource("solver", "a smaller numerics.tolerance", solver_error)
MARCH_SOURCES = (
    SOLVE,
    ErrorSource("time", "shorter time steps", steps_error, "time steps"),
    ErrorSource("folded", "a smaller numerics.branch_error", folded_error, "folded branches"),
    ErrorSource("mesh", "a finer grid", mesh_error),
)
STEADY_SOURCES = (replace(SOLVE, error=steady_solver_error), replace(MARCH_SOURCES[-1], error=steady_mesh_error))

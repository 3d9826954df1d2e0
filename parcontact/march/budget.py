"""The error budget: estimated errors of friction and contact area by source, of one step and of a whole run.

The errors of all sources are added. They are calibrated estimates that hold in nearly all scenes; a true error may be
much smaller. The error of each source follows from numbers of a step and from constants fitted to true errors
(`time_error.Fit`). Below, N is the number of spots of contact, and c is the relative excess of the counted area over
the corrected area. Names in capitals are constants of this module.

Source `solver`. The error of friction is proportional to the `complementarity` C of the certificate
(`physics.records`). As errors of many spots average out, this error is divided by N^(1/4). If friction is far below the
rms slope, friction is a small difference of large forces. The error is then multiplied by the root of the ratio of
slope to friction. It is at least NOISE C/N^(1/2) times this ratio, as errors of pressures cause a tangential force also
without friction. In steady sliding friction is a sum of squares. Its absolute error is at least the square of SINGLE,
as pressures are rounded to single precision there. The error of the area is proportional to the share of points that
penetrate without pressure, plus a small error that varies as C^0.7.

Source `time`. The error of friction follows from the distance by which spots of contact, or waves of the surface, pass
in a step, and from the embedded pair (`time_error`).

Source `folded`. The error of friction is the bound on the effect of the branches without a map. The error of the area
is this bound times the share of the box that is not in contact.

Source `mesh`. The error of the area is AREA c/N^(1/4) in slides of half a cell or more, over which the errors of
positions average out. It is STILL c/N^(1/4) at rest, in shorter slides and in steady sliding. The smallest error of the
area is the area of one cell. If the only shape of a surface has the symmetry of the grid (`time_error.is_symmetric`),
all sides of the edge of contact have equal errors, and the error of the area with STILL is multiplied by SYMMETRIC. The
error of friction in a march is VIEWS times
the difference between friction by the slopes of the rigid surface and friction by the slopes of the body. In steady
sliding, where friction is a sum of squares without cancellation, the error is the loss at edges in waves shorter than
the cells, plus STEADY_AREA c/N^(1/4). Identical contacts have the same position on the grid. Their errors do not
average out, so that N = 1, and are IDENTICAL times as large for the area and for steady friction. Errors also grow if
edges of contact follow an axis of the grid: by the factor IDENTICAL if all edges do, and less, in proportion, if some
edges do. On a grid with less than FEW_CELLS cells per shortest wave, a map lacks waves. The error of friction is then
larger by WAVES (4/n)^2.5, where n is the number of cells per shortest wave.

Loss at edges: the pressure rises from an edge of contact as the root of the distance. The mean square of its waves of
wavenumber q across the edge therefore falls as q^-3. In steady sliding at the speed v these waves lose power in
proportion to q^-3 sin delta(q v), with the loss angle delta of the body at the frequency q v. In Hertzian contacts of a
body whose loss angle grows with the frequency, all waves together lose as much as this law gives for all wavenumbers
above q0. Here q0 = 2/(pi a) for a strip of half width a and q0 = 3/(pi a) for a circle of radius a, from the integrals
of J1(x)^2/x and j1(x)^2. A mesh of cells of length dx has waves up to Q = pi/dx. The share of the loss in shorter waves
is

    s m = (q0/Q)^2 M(Q v)/M(q0 v),      M(w) = int_0^1 2 t sin delta(w/t) dt,      s = q0/Q.

Far below the relaxation frequencies of the body, m is 1, and the share is of first order in the length of the cells.
Far above them, m is s^2.
"""

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..physics.prony import Prony, complex_modulus
from ..physics.records import Entry, Saved
from ..printed import per_cent
from .time_error import (
    Fit,
    RunProperties,
    StepObservation,
    cell_along,
    count_spots,
    error_of_rise,
    is_symmetric,
    mean_over_spots,
    radius_of,
    resolves,
    share_of_area,
    time_error,
)

COVERAGE, SOLVES = "scripts/error_coverage.py", "scripts/solver_errors.py"
OF_FRICTION = "3.3, 1 to 45, in 96 % of 956 scenes"
OF_AREA = "3.8, 1.1 to 45, in 96 % of 1284 scenes"
AREA = Fit("area while something slides: times the correction over N^(1/4)", 0.5, 1.0, COVERAGE, OF_AREA)
STILL = Fit("area at rest, and in steady sliding: the same", 0.72, 1.0, COVERAGE, OF_AREA)
IDENTICAL = Fit("errors of the mesh: more where contacts are identical", 4.0, 0.0, COVERAGE, OF_AREA)
SYMMETRIC = Fit(
    "area without a slide: more where the grid is symmetric to the only spot",
    2.2,
    0.0,
    "tests/accuracy/test_centred_balls.py",
    "4, 1.2 to 43, in 97 % of 192 contacts",
)
VIEWS = Fit("friction of marches: times the difference of its two views", 0.75, 1.5, COVERAGE, OF_FRICTION)
STEADY_AREA = Fit("steady friction: times the correction of the area over N^(1/4)", 0.1, 1.0, COVERAGE, OF_FRICTION)
LOST = Fit("steady friction: what edges lose, times s m", 2.0, 1.0, COVERAGE, OF_FRICTION)
FREE_LOST = Fit("the same in free boxes, with sampled coefficients", 6.0, 1.0, COVERAGE, OF_FRICTION)
ENERGY = Fit("energies: times the error of area", 0.4, 1.0, COVERAGE, "20, in 95 % of 44 scenes with adhesion")
PULL_OFF = Fit(
    "pull-off: times the median error of the area", 0.15, 1.0, COVERAGE, "5.5, 1.1 to 58, in 97 % of 58 scenes"
)
WAVES = Fit(
    "friction: maps with 4 cells per shortest wave, which lack waves",
    0.05,
    2.5,
    "tests/road/test_spectrum.py",
    "1.6 to 2 on 1.75 cells in full contact, more on finer grids",
)
SOLVER = Fit("friction: times the complementarity over N^(1/4)", 1.1, 1.0, SOLVES, "1, 0.12 to 18, of single steps")
SOLVER_AREA = Fit("area: times a power of the complementarity", 0.1, 0.7, SOLVES, "1, 0.14 to 8, of single steps")
PENETRATING = Fit("area: times the points that penetrate without pressure", 0.8, 1.0, SOLVES, "as SOLVER_AREA")
NOISE = Fit("tangential force without friction: times slope and complementarity", 0.8, 1.0, SOLVES, "0.5 to 1.2")

STRIP, CIRCLE = 2.0 / math.pi, 3.0 / math.pi  # physics: q0 times the half width, and times the radius
NODES = 16  # accuracy: nodes of the integral; its error is 2 % for one branch
AT, WEIGHTS = np.polynomial.legendre.leggauss(NODES)
AVERAGED = 0.5  # accuracy: cells of a slide over which errors of its positions average out
GAPS = 2.0  # accuracy: factor on the open share; above half contact radii are those of gaps
FEW_CELLS = 3.0  # accuracy: cells per shortest wave below which a map lacks waves
SINGLE = float(np.finfo(np.float32).eps)  # rounding: relative, of pressures, whose squares are friction by energy
ROUNDING = 1e-12  # rounding: least complementarity in errors by NOISE, and in steady sliding


@dataclass(frozen=True)
class ErrorPair:
    """Relative errors of friction and of the corrected contact area."""

    friction: float
    area: float


@dataclass(frozen=True)
class ErrorSource:
    """A source of error: its name, a remedy, and the function `error`. This function returns the relative errors of
    friction and area that the source causes in a step."""

    name: str
    remedy: str
    error: Callable[[RunProperties, StepObservation], ErrorPair]
    shown: str = ""  # its name in sentences, if different


def solver_error(run: RunProperties, observed: StepObservation) -> ErrorPair:
    """Return the errors of friction and area that the tolerance of a step's solve causes."""
    certificate, ratio = observed.complementarity, observed.slope / observed.body if observed.body else 0.0
    friction = SOLVER.value * certificate * math.sqrt(max(1.0, ratio)) * mean_over_spots(run, observed)
    noise = NOISE.value * max(certificate, ROUNDING) * ratio / math.sqrt(count_spots(run, observed))
    return ErrorPair(max(friction, noise), _solver_of_area(observed))


def steady_solver_error(run: RunProperties, observed: StepObservation) -> ErrorPair:
    """Return the errors that an inexact solve of steady sliding causes. Friction is then a sum of squares."""
    friction = SOLVER.value * max(observed.complementarity, ROUNDING) * mean_over_spots(run, observed)
    friction = max(friction, SINGLE**2 / observed.body if observed.body else 0.0)
    return ErrorPair(friction, _solver_of_area(observed))


def _solver_of_area(observed: StepObservation) -> float:
    return SOLVER_AREA.value * observed.complementarity**SOLVER_AREA.order + PENETRATING.value * observed.penetrating


def steps_error(run: RunProperties, observed: StepObservation) -> ErrorPair:
    """Return the errors that the length of a step causes, including a rise of friction within the step. If the body
    computes the error of its own step, both results are this error."""
    error = time_error(run, observed)
    if observed.own_error is not None:
        return ErrorPair(error, error)
    return ErrorPair(max(error, error_of_rise(run, observed)), share_of_area(run, observed) * error)


def folded_error(run: RunProperties, observed: StepObservation) -> ErrorPair:
    """Return the bound on the errors that folded branches cause."""
    return ErrorPair(run.folded, run.folded * (1.0 - observed.area))


def mesh_error(run: RunProperties, observed: StepObservation) -> ErrorPair:
    """Return the errors that the mesh causes in a step of a march."""
    friction = VIEWS.value * observed.friction_mismatch / observed.body if observed.body else 0.0
    fit = AREA if any(observed.way) and run.cells_slid >= AVERAGED else STILL
    return ErrorPair(friction + _lacking_waves(run), _mesh_of_area(fit, run, observed))


def steady_mesh_error(run: RunProperties, observed: StepObservation) -> ErrorPair:
    """Return the errors that the mesh causes in steady sliding."""
    correction = _grow_if_coherent(run, observed) * observed.correction * mean_over_spots(run, observed)
    lost = (IDENTICAL.value if run.identical_contacts else 1.0) * lost_at_edges(run, observed)
    friction = lost + STEADY_AREA.value * correction
    return ErrorPair(friction + _lacking_waves(run), _mesh_of_area(STILL, run, observed))


def _lacking_waves(run: RunProperties) -> float:
    """Return the error of friction by waves that a map lacks on a coarse grid."""
    cells = run.cells_per_wave
    if not run.measured or cells is None or cells >= FEW_CELLS:
        return 0.0
    return WAVES.value * (4.0 / cells) ** WAVES.order


def _mesh_of_area(fit: Fit, run: RunProperties, observed: StepObservation) -> float:
    coherent = _grow_if_coherent(run, observed)
    position = observed.position if run.cells_slid >= AVERAGED else (0.0, 0.0)  # short slides keep half of the symmetry
    if fit is STILL and is_symmetric(run.centre, position):
        coherent = max(coherent, SYMMETRIC.value)
    error = fit.value * coherent * observed.correction * mean_over_spots(run, observed)
    return max(error, 1.0 / (run.points * observed.area)) if observed.area > 0.0 else error


def _grow_if_coherent(run: RunProperties, observed: StepObservation) -> float:
    """Return the factor by which errors grow where edges have the same position on the grid: of identical contacts, and
    of edges that follow an axis of the grid."""
    return 1.0 + (IDENTICAL.value - 1.0) * (1.0 if run.identical_contacts else observed.straight)


def lost_at_edges(run: RunProperties, observed: StepObservation) -> float:
    """Return an upper bound on the share of friction that the grid misses: the grid lacks waves shorter than its cells,
    so that the loss of these waves at edges of contact is missing. Return 0 at rest and for an elastic body."""
    if run.prony is None or not any(observed.way):
        return 0.0
    cell = cell_along(run, observed.way)
    size = radius_of(run, observed) * (run.mean_cell / cell)
    share, slow = lost_in_short_waves(run.prony, size, math.hypot(*observed.way) / cell, run.edges_follow_grid)
    few = min(1.0, GAPS * (1.0 - observed.area))
    most = FREE_LOST.value if run.free else LOST.value
    return min(1.0, most * few * share * slow)


def lost_in_short_waves(prony: Prony, radius: float, speed: float, edges_follow_grid: bool) -> tuple[float, float]:
    """Return s and s m of the module: the shares of the loss in waves shorter than cells, for round spots of contact.

    `radius` is the radius of the spots in cells, and `speed` the number of cells that they slide per second. If
    `edges_follow_grid`, the spots are strips, and `radius` is their half width. Both results are at most 1. Both are 0
    if there are no edges or no losses.
    """
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


UNKNOWN = 0.5  # accuracy: relative error of friction above which friction cannot be distinguished from 0
AT_REST, AT_ONCE = 1e-100, 1e-200  # weights [m] of a second at rest and of a jump in means over the distance slid
LEAST_WAY = 1e-60  # m: least weight of sliding
ROUNDED = 1.01  # accuracy: least ratio of an error to its limit that counts as larger, as three digits are printed
SUMS = "sums"  # its name in a checkpoint
SMALLER = "a smaller numerics.accuracy"  # the remedy if the accuracy has chosen the setting
OF_BANDS = {
    "method": "fewer bands with more points each (bands.count); two or more bands have at least 3 % in friction and "
    "9 % in a small area",
    "scatter": "more surfaces of each band (bands.samples)",
}
MESH_OF_BANDS = "more points in each band (bands.points)"
REMEDIES = {source.name: source.remedy for source in MARCH_SOURCES} | OF_BANDS
SHOWN = {source.name: source.shown or source.name for source in MARCH_SOURCES}
SHOWN |= {"method": "coupling of bands", "scatter": "surfaces"}


class ErrorParts(NamedTuple):
    """Relative errors by source. For surfaces in bands, `method` is the error of the coupling of bands, and `scatter`
    is the variation between surfaces with the same spectrum."""

    solver: float
    time: float
    folded: float
    mesh: float
    method: float = 0.0
    scatter: float = 0.0

    @property
    def total(self) -> float:
        return sum(self)

    @property
    def of_friction(self) -> float:
        """The stated relative error of friction: the sum of the parts, but at least 1 if the sum exceeds UNKNOWN.
        Friction is then a small difference of large forces, and only the order of magnitude of its error is known."""
        return max(self.total, 1.0) if self.total > UNKNOWN else self.total

    def plain(self) -> dict[str, float]:
        """Return the parts and their total."""
        return {name: getattr(self, name) for name in NAMES} | {"total": self.total}


NAMES = ErrorParts._fields


@dataclass(frozen=True)
class ErrorBudget:
    """Errors at one instant. `friction` states the relative errors of friction by source, whose sum may exceed 1; it is
    None without friction. `area` states the relative errors of the contact area by source. If `resolved` is False,
    spots of contact may be smaller than a cell, and no errors are stated."""

    friction: ErrorParts | None
    area: ErrorParts
    resolved: bool = True

    def take_from_time(self, error: float) -> "ErrorBudget":
        """Return the budget with `error` subtracted from the error of friction by the time steps."""
        friction = self.friction and self.friction._replace(time=self.friction.time - error)
        return replace(self, friction=friction)

    def with_rounds(self, friction: float, area: float) -> "ErrorBudget":
        """Return the budget of the last iteration of a fixed point. `friction` and `area` are the relative changes of
        friction and area in this iteration. They are added to the errors of the solver."""
        own = self.friction and self.friction._replace(solver=self.friction.solver + friction)
        return ErrorBudget(own, self.area._replace(solver=self.area.solver + area))


def estimate(run: RunProperties, observed: StepObservation) -> ErrorBudget:
    """Return the error budget of a step."""
    return _estimate(MARCH_SOURCES, run, observed)


def estimate_steady(run: RunProperties, observed: StepObservation) -> ErrorBudget:
    """Return the error budget of steady sliding, whose friction follows from the dissipated power."""
    return _estimate(STEADY_SOURCES, run, observed)


def _estimate(sources: Sequence[ErrorSource], run: RunProperties, observed: StepObservation) -> ErrorBudget:
    """Return the errors of the sources. The error of friction is relative to the sum of body and interface; the
    interface has the relative error of the area."""
    pairs = {source.name: source.error(run, observed) for source in sources}
    missing = dict.fromkeys(("solver", "time", "folded", "mesh"), 0.0)
    area = ErrorParts(**missing | {name: pair.area for name, pair in pairs.items()})
    resolved = resolves(run, observed)
    if observed.friction <= 0.0:
        return ErrorBudget(None, area, resolved)
    shares = observed.body / observed.friction, observed.interface / observed.friction
    friction = {name: shares[0] * pair.friction + shares[1] * pair.area for name, pair in pairs.items()}
    return ErrorBudget(ErrorParts(**missing | friction), area, resolved)


def add_shear(
    budget: ErrorBudget, body: float, shear: float, whole: float, solver: float, share: float, time: float, mesh: float
) -> ErrorBudget:
    """Return the error budget of a friction coefficient `whole` that is the sum of two parts: `body`, whose errors are
    in `budget`, and `shear`, which tractions cause.

    The relative errors of `shear` are `solver` by the solve of the tractions, `time` by the step, and `mesh` by the
    stiffness of spots. A `share` of `shear` is proportional to the area, and so its relative error is that of the area.
    """
    if whole <= 0.0:
        return replace(budget, friction=None)
    of_body = budget.friction or ErrorParts(*(0.0 for _ in NAMES))
    parts = {name: body * one + shear * share * two for name, one, two in zip(NAMES, of_body, budget.area, strict=True)}
    parts["solver"] += shear * solver
    parts["time"] += shear * time
    parts["mesh"] += shear * mesh
    return replace(budget, friction=ErrorParts(**{name: part / whole for name, part in parts.items()}))


def weight_of(slid: float, seconds: float) -> float:
    """Return the weight of a step in a mean: the distance `slid` [m]. At rest the weight is proportional to `seconds`
    and far smaller."""
    return slid or seconds * AT_REST or AT_ONCE


@dataclass(frozen=True)
class ErrorSums:
    """Sums of the budgets of many steps. The weight of a step is the distance slid; errors of friction are also
    weighted by the friction coefficient.

    At rest the weight is proportional to the duration, and much smaller, so that rest does not dilute the errors of a
    slide. Steps without duration have a still smaller weight. `sums` has one row for friction and one for the area. A
    row consists of the sum of weights and the weighted sums of all parts of the error, in the order of `ErrorParts`.
    """

    sums: NDArray[np.float64] = field(default_factory=lambda: np.zeros((2, 1 + len(NAMES))))

    def plus(self, budget: ErrorBudget, friction: float, seconds: float, slid: float = 0.0) -> "ErrorSums":
        """Return the sums with one more step of the length `seconds` [s] and the friction coefficient `friction`, in
        which the surface slid by `slid` [m]."""
        far, sums = weight_of(slid, seconds), self.sums.copy()
        for row, parts, weight in zip(sums, (budget.friction, budget.area), (friction, 1.0), strict=True):
            if parts is not None:
                row += weight * far * np.array([1.0, *parts])
        return ErrorSums(sums)

    def entries(self) -> dict[str, Entry]:
        """Return the entry of these sums in a checkpoint. The entry is optional: older checkpoints lack it."""
        return {SUMS: Entry(self.sums.ravel(), optional=True)}

    @classmethod
    def restored(cls, saved: Saved) -> "ErrorSums":
        """Return the sums in a checkpoint, or new sums if the checkpoint is of another version."""
        own = cls()
        found = np.asarray(saved.get(SUMS, own.sums))
        return cls(found.reshape(own.sums.shape)) if found.size == own.sums.size else own

    @property
    def friction(self) -> ErrorParts | None:
        """Relative errors of friction by source, as a mean over the distance slid; None without sliding or friction."""
        return self._mean(0)

    @property
    def friction_within(self) -> float:
        """Absolute error of the friction coefficient, as a mean over the distance slid."""
        parts, weight = self.friction, float(self.sums[1, 0])
        return parts.of_friction * float(self.sums[0, 0]) / weight if parts and weight > 0.0 else math.nan

    @property
    def area(self) -> ErrorParts | None:
        """Relative errors of the area by source, as a mean over the distance slid, or over time without sliding; None
        without contact."""
        return self._mean(1)

    def _mean(self, index: int) -> ErrorParts | None:
        weight, *sums = self.sums[index].tolist()
        return ErrorParts(*(value / weight for value in sums)) if weight > 0.0 else None

    def facts(self, accuracy: Any) -> dict[str, Any]:
        """Return plain data: the requested `accuracy`, and the relative errors of friction and area by source and in
        total."""
        found = {"friction": self.friction, "contact_area_corrected": self.area}
        parts = {name: each.plain() for name, each in found.items() if each is not None}
        if self.friction is not None:
            parts["friction"]["total"] = self.friction.of_friction
        return {"accuracy": accuracy, **parts}

    def lines(self, asked: tuple[float, float], chosen: Collection[str] = ()) -> list[str]:
        """Return sentences for run.log on the errors of friction and area. `asked` are the requested accuracies of
        both. A sentence states a remedy if the error exceeds the accuracy. `chosen` names the sources of error whose
        setting, such as the time step, the program has chosen from `numerics.accuracy`."""
        found = zip(("friction", "the corrected contact area"), (self.friction, self.area), asked, strict=True)
        way = "the distance slid" if self.sums[1, 0] > LEAST_WAY else "time"
        lines = [
            f"estimated error of {name}: {describe(parts, name)}, mean over {way}{advice(parts, accuracy, chosen)}"
            for name, parts, accuracy in found
            if parts is not None
        ]
        if self.friction is not None and self.friction.of_friction >= 1.0:
            lines.append(f"friction is 0 ± {self.friction_within:.2g}: it is smaller than its estimated error")
        return lines


def advice(parts: ErrorParts, accuracy: float, chosen: Collection[str] = ()) -> str:
    """Return the end of a sentence on an error: that the error is within `accuracy`, or else a remedy. `chosen` names
    the sources of error whose settings the program has chosen from `numerics.accuracy`."""
    if not exceeds(parts.total, accuracy):
        return f"; within the {100 * accuracy:g} % that numerics.accuracy asks for"
    return f"; more than the {100 * accuracy:g} % that numerics.accuracy asks for: try {find_remedy(parts, chosen)}"


def find_remedy(parts: ErrorParts, chosen: Collection[str] = ()) -> str:
    """Return what reduces the largest part of an error. `chosen` names the sources of error whose settings the program
    has chosen from `numerics.accuracy`."""
    worst = max(NAMES, key=lambda name: float(getattr(parts, name)))
    in_bands = parts.method > 0.0 or parts.scatter > 0.0
    return SMALLER if worst in chosen else MESH_OF_BANDS if in_bands and worst == "mesh" else REMEDIES[worst]


def exceeds(error: float, accuracy: float) -> bool:
    """Return True if an estimated error is more than ROUNDED times the requested accuracy, so that printed numbers
    differ."""
    return error > ROUNDED * accuracy


def describe(parts: ErrorParts, name: str) -> str:
    """Return a text with a total error and its parts by source, in per cent. `name` is the quantity, "friction" or
    another one."""
    there = [part for part in NAMES if getattr(parts, part)]
    shares = ", ".join(f"{SHOWN[part]} {per_cent(getattr(parts, part))}" for part in there)
    total = parts.of_friction if name == "friction" else parts.total
    more = " or more" if name == "friction" and total >= 1.0 else ""
    return f"{per_cent(total, 3)}{more} ({shares or 'no part'})"

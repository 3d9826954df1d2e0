"""The error budget: estimated errors of friction and contact area by source, of a step and of a whole run.

The errors of the sources (`sources`) are added. They are calibrated estimates that hold in nearly all scenes; a true
error may happen to be much smaller.
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..physics.entries import Entry, Saved
from ..printed import per_cent
from .observation import RunProperties, StepObservation, resolves
from .sources import MARCH_SOURCES, STEADY_SOURCES, ErrorSource

UNKNOWN = 0.5  # accuracy: relative error of friction above which friction cannot be distinguished from 0
AT_REST, AT_ONCE = 1e-100, 1e-200  # weights [m] of a second at rest and of a jump in means over the distance slid
LEAST_WAY = 1e-60  # m: least weight of sliding
ROUNDED = 1.01  # accuracy: least ratio of an error to its limit that counts as larger, as three digits are printed
SUMS = "sums"  # its name in a checkpoint
SMALLER = "a smaller numerics.accuracy"  # the remedy if the accuracy has chosen the setting
OF_BANDS = {
    "method": "fewer bands with more points each (bands.count)",
    "scatter": "more surfaces of each band (bands.samples)",
}
REMEDIES = {source.name: source.remedy for source in MARCH_SOURCES} | OF_BANDS
SHOWN = {source.name: source.shown or source.name for source in MARCH_SOURCES}
SHOWN |= {"method": "coupling of bands", "scatter": "surfaces"}


class ErrorParts(NamedTuple):
    """Relative errors by source. For surfaces in bands, `method` is the error of their coupling, and `scatter` the
    variation between surfaces with the same spectrum."""

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
        """The stated error of friction: at least 1 if it exceeds UNKNOWN. Such a friction is the small difference of
        large forces, and its error is known to an order of magnitude only."""
        return max(self.total, 1.0) if self.total > UNKNOWN else self.total

    def plain(self) -> dict[str, float]:
        """Return the parts and their total."""
        return {name: getattr(self, name) for name in NAMES} | {"total": self.total}


NAMES = ErrorParts._fields


@dataclass(frozen=True)
class ErrorBudget:
    """Errors at one instant. `friction` is None without friction; its error may exceed 1. They are not stated unless
    the mesh is `resolved`: spots of contact have more than a few cells."""

    friction: ErrorParts | None
    area: ErrorParts
    resolved: bool = True

    def take_from_time(self, error: float) -> "ErrorBudget":
        """Return the budget with a smaller error of friction by the time steps."""
        friction = self.friction and self.friction._replace(time=self.friction.time - error)
        return replace(self, friction=friction)

    def with_rounds(self, friction: float, area: float) -> "ErrorBudget":
        """Return the budget with relative errors by the rounds of a fixed point, as part of the solver's."""
        own = self.friction and self.friction._replace(solver=self.friction.solver + friction)
        return ErrorBudget(own, self.area._replace(solver=self.area.solver + area))


def estimate(run: RunProperties, observed: StepObservation) -> ErrorBudget:
    """Return the budget of a step."""
    return _estimate(MARCH_SOURCES, run, observed)


def estimate_steady(run: RunProperties, observed: StepObservation) -> ErrorBudget:
    """Return the budget of steady sliding, for friction by energy."""
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
    """Return the budget of friction `whole`, the sum of the part of the `body`, with its `budget`, and of `shear` by
    tractions.

    The tractions have the relative errors `solver` of their solve, `time` of the step and `mesh` of the stiffness of
    spots, and a `share` of them has the error of the area.
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
    """Return the weight of a step in a mean: the distance slid, or a far smaller one for its duration at rest."""
    return slid or seconds * AT_REST or AT_ONCE


@dataclass(frozen=True)
class ErrorSums:
    """Sums of the budgets of many steps, weighted by the distance slid; friction also by its value.

    Without sliding the weight is the duration, and for steps without duration a still smaller one, so that rest does
    not dilute the errors of a slide. `sums` has a row for friction and one for the area: the weight, and the
    weighted sum of each part.
    """

    sums: NDArray[np.float64] = field(default_factory=lambda: np.zeros((2, 1 + len(NAMES))))

    def plus(self, budget: ErrorBudget, friction: float, seconds: float, slid: float = 0.0) -> "ErrorSums":
        """Return the sums with one more step of `seconds`, in which the surface slid by `slid` [m]."""
        far, sums = weight_of(slid, seconds), self.sums.copy()
        for row, parts, weight in zip(sums, (budget.friction, budget.area), (friction, 1.0), strict=True):
            if parts is not None:
                row += weight * far * np.array([1.0, *parts])
        return ErrorSums(sums)

    def entries(self) -> dict[str, Entry]:
        """Return its entry, which is optional."""
        return {SUMS: Entry(self.sums.ravel(), optional=True)}

    @classmethod
    def restored(cls, saved: Saved) -> "ErrorSums":
        """Return the sums of a checkpoint, or new ones if another version has written them."""
        own = cls()
        found = np.asarray(saved.get(SUMS, own.sums))
        return cls(found.reshape(own.sums.shape)) if found.size == own.sums.size else own

    @property
    def friction(self) -> ErrorParts | None:
        """Mean over the distance slid; None without sliding or friction."""
        return self._mean(0)

    @property
    def friction_within(self) -> float:
        """Absolute error of the friction coefficient, as a mean over the distance slid."""
        parts, weight = self.friction, float(self.sums[1, 0])
        return parts.of_friction * float(self.sums[0, 0]) / weight if parts and weight > 0.0 else math.nan

    @property
    def area(self) -> ErrorParts | None:
        """Mean over the distance slid, or over time without sliding; None without contact."""
        return self._mean(1)

    def _mean(self, index: int) -> ErrorParts | None:
        weight, *sums = self.sums[index].tolist()
        return ErrorParts(*(value / weight for value in sums)) if weight > 0.0 else None

    def facts(self, accuracy: Any) -> dict[str, Any]:
        """Return the requested accuracy and the relative errors by part, and in total, as plain data."""
        found = {"friction": self.friction, "contact_area_corrected": self.area}
        parts = {name: each.plain() for name, each in found.items() if each is not None}
        if self.friction is not None:
            parts["friction"]["total"] = self.friction.of_friction
        return {"accuracy": accuracy, **parts}

    def lines(self, asked: tuple[float, float], chosen: Collection[str] = ()) -> list[str]:
        """Return sentences for run.log, with remedies if friction or the area exceeds the `asked` accuracies. The
        accuracy has `chosen` the settings of these parts."""
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
    """Return a text with a remedy if the error exceeds `accuracy`, or that it does not."""
    if not exceeds(parts.total, accuracy):
        return f"; within the {100 * accuracy:g} % that numerics.accuracy asks for"
    worst = max(NAMES, key=lambda name: float(getattr(parts, name)))
    remedy = SMALLER if worst in chosen else REMEDIES[worst]
    return f"; more than the {100 * accuracy:g} % that numerics.accuracy asks for: try {remedy}"


def exceeds(error: float, accuracy: float) -> bool:
    """Return whether an estimated error exceeds the requested accuracy, also as it is printed."""
    return error > ROUNDED * accuracy


def describe(parts: ErrorParts, name: str) -> str:
    """Return the total error of "friction", or of another quantity, in per cent, and its parts."""
    there = [part for part in NAMES if getattr(parts, part)]
    shares = ", ".join(f"{SHOWN[part]} {per_cent(getattr(parts, part))}" for part in there)
    total = parts.of_friction if name == "friction" else parts.total
    more = " or more" if name == "friction" and total >= 1.0 else ""
    return f"{per_cent(total, 3)}{more} ({shares or 'no part'})"

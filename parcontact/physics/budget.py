"""How wrong friction and contact area are at most, part by part, from numbers that a step has anyway.

Each part is an estimate of a relative error (1 is all of it), found by experiment: spheres, cylinders and rough
surfaces from 0.4 % to full contact, bodies of one to twelve branches, starts and jumps of velocity, against runs with
finer steps, meshes and tolerances (`scripts/error_budget.py 64 8`, which makes eight scenes with both integrators). In
brackets: the same with other surfaces at three times the velocity, `scripts/error_budget.py 64 8 7 3`, by which nothing
was found. Estimates are so many times the true errors:

    of friction, by the solver 0.7 to 2.9 (0.6 to 5), by time steps 0.8 to 2.6 (0.4 to 3.4);
    of area, by the solver 0.4 to 2.6 (0.4 to 2.7), by time steps 0.6 to 4.9 (0.3 to 7.5), but far too small where it is
    below 0.1 %, next to full contact, and a fifth of it where 0.4 % of the points touch.

solver: from the `complementarity` C of the certificate (see `solve.contact.Certificate`). Friction is wrong in
    proportion to it, area, which edges decide that carry little pressure, to C^0.7.
time: from the embedded pair (see `embedded`). Over one step the pair differs in the second order of the step where all
    branches are slow, in the first where some are as fast as the step is short. The error that all steps of the
    exponential integrator leave in the end is of an order of 1.7 in contacts, and little in full contact, where the
    displacement is smooth in time; that of backward Euler is of the first order and goes with the root. The area, which
    is wrong now by more and now by less than none, has a share of the error of friction: less where little is open.
folded: the bound of the branches without a map.
mesh: of friction from the cells per shortest wave of a rough surface, or per radius of a contact spot; of the corrected
    area from the correction itself. Where there is a run on half the mesh, both from their difference to it.

Friction is the small difference of large forces where its coefficient is less than the slopes of the surface: what is
wrong with pressures then counts more, by about the root of the ratio. Pressures that are wrong by the complementarity
may have tangential forces of that share of the slopes: measured at rest, where a sphere and a wave have no friction, it
was 0.05 to 0.7 of that. Friction that is no larger has no budget: there is no number of which to be wrong by a share.
"""

import math
from collections.abc import Collection
from dataclasses import asdict, astuple, dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .measures import SIDE

SOLVER_FRICTION = 0.5  # times the complementarity
SOLVER_AREA, SOLVER_AREA_POWER = 0.4, 0.7  # times this power of it
EXPONENTIAL_FRICTION = 1.7  # times the difference of the pair
LEAST_POWER = 0.25  # by which the error falls faster than the difference of the pair, at least
TIME_ORDER = 1.7  # of the error of the exponential integrator in the step, with contacts that begin and end
EQUAL_DIFFERENCE = 0.0072  # of the pair, at which a material of many branches is no worse than one of a single branch
FIXED_EDGES = 0.9  # of the error is from the edges of contacts: in full contact there are none
EULER_FRICTION = 0.8  # times its root
EXPONENTIAL_AREA, NEARLY_CLOSED = 0.1, 0.2  # of the error of friction; in proportion below this share of open points
EULER_AREA, EULER_OPEN_POWER = 0.35, 1.5  # of it, times this power of the share of open points
WAVES_FRICTION, WAVES_ORDER = 0.05, 2.5  # at 4 cells per shortest wave
SPOTS_FRICTION, SPOTS_ORDER = 0.13, 2.3  # at a contact spot of a radius of one cell
CORRECTED_ORDER = 1.0  # of the corrected area
EDGES, STRAIGHT_EDGES = 0.25, 2.0  # of the correction of the area; along edges that follow the grid
ROUNDING = 1e-12  # of the slope of the surface: friction of pressures that are right to all digits
AT_REST, AT_ONCE = 1e-100, 1e-200  # m/s and m: what a second at rest weighs against a way, and what a jump does
LEAST_WAY = 1e-60  # m: smaller weights are those of rest
ROUND = 8.0 / math.pi  # cells of a round spot over its sides on the edge, times this: its radius in cells


@dataclass(frozen=True)
class Parts:
    """Relative errors by what makes them."""

    solver: float
    time: float
    folded: float
    mesh: float

    @property
    def total(self) -> float:
        """All together."""
        return self.solver + self.time + self.folded + self.mesh


NAMES = tuple(field.name for field in fields(Parts))
REMEDIES = {
    "solver": "a smaller numerics.tolerance",
    "time": "shorter time steps",
    "folded": "a smaller numerics.branch_error",
    "mesh": "a finer grid",
}
SMALLER = "a smaller numerics.accuracy"  # where it has chosen the setting


@dataclass(frozen=True)
class ErrorBudget:
    """Of one instant. Friction is None where there is none, or no more than the solver's noise."""

    friction: Parts | None
    area: Parts


@dataclass(frozen=True)
class Known:
    """What is known of a run before it begins.

    `cells_per_wave` of the shortest wave of a rough surface, None without one; `straight`: on a grid of one row or
    column every edge of contact follows the grid; `folded`: the bound; `exponential`: the integrator.
    """

    cells_per_wave: float | None
    straight: bool
    folded: float
    exponential: bool


@dataclass(frozen=True)
class Seen:
    """What a step has shown: the certificate's complementarity; by how much the embedded pair differs, with its order
    in the step; the rms slope of the surface under the pressure; friction; contact area, counted and corrected, as
    shares."""

    complementarity: float
    difference: float
    order: float
    slope: float
    friction: float
    area: float
    corrected: float


def estimate(known: Known, seen: Seen, points: int) -> ErrorBudget:
    """The budget of a step on a grid of so many points."""
    noise = seen.slope * max(seen.complementarity, ROUNDING)
    return ErrorBudget(_friction(known, seen, points) if seen.friction > noise else None, _area(known, seen))


def _friction(known: Known, seen: Seen, points: int) -> Parts:
    more = math.sqrt(max(1.0, seen.slope / seen.friction))
    solver = SOLVER_FRICTION * seen.complementarity * more
    return Parts(solver, time_error(known, seen), known.folded, _mesh(known, seen, points))


def time_error(known: Known, seen: Seen) -> float:
    """What the length of a step adds to the error of friction, or would where something slides.

    In contacts the error of the exponential integrator goes with the power TIME_ORDER of the step, the difference of
    the pair with `order`.
    """
    if not known.exponential:
        return EULER_FRICTION * seen.difference**0.5
    power = max(LEAST_POWER, TIME_ORDER / max(seen.order, 1.0) - 1.0)
    fixed = 1.0 - FIXED_EDGES * seen.area**2
    return fixed * EXPONENTIAL_FRICTION * seen.difference * (seen.difference / EQUAL_DIFFERENCE) ** power


def _mesh(known: Known, seen: Seen, points: int) -> float:
    if known.cells_per_wave is not None:
        return WAVES_FRICTION * (4.0 / known.cells_per_wave) ** WAVES_ORDER
    radius = spot_radius(seen, points)
    return min(1.0, SPOTS_FRICTION / radius**SPOTS_ORDER) if radius > 0.0 else 0.0


def spot_radius(seen: Seen, points: int) -> float:
    """Of round spots of contact, or of the gaps between them where these are the smaller, in cells; infinite where
    there are no edges."""
    sides = (seen.area - seen.corrected) * points / SIDE
    return ROUND * min(seen.area, 1.0 - seen.area) * points / sides if sides > 0.0 else math.inf


def compared_with_half_mesh(
    budget: ErrorBudget, here: tuple[float, float], coarse: tuple[float, float], waves: bool
) -> ErrorBudget:
    """The budget with what another run shows of the mesh: `here` friction and corrected area of an instant, `coarse`
    those with twice the cell. As errors go with the power p of the cell, the difference is 2^p - 1 of them.

    With p as above; of the corrected area, whose error falls slower, 1.
    """
    apart = [abs(one - other) / one if one > 0.0 else 0.0 for one, other in zip(here, coarse, strict=True)]
    friction = apart[0] / (2.0 ** (WAVES_ORDER if waves else SPOTS_ORDER) - 1.0)
    area = apart[1] / (2.0**CORRECTED_ORDER - 1.0)
    found = budget.friction
    return ErrorBudget(found and replace(found, mesh=friction), replace(budget.area, mesh=area))


def _area(known: Known, seen: Seen) -> Parts:
    open_share = 1.0 - seen.area
    solver = SOLVER_AREA * seen.complementarity**SOLVER_AREA_POWER
    edges = STRAIGHT_EDGES if known.straight else EDGES
    mesh = edges * (seen.area - seen.corrected) / seen.corrected if seen.corrected > 0.0 else 0.0
    return Parts(solver, _share_of_area(known, open_share) * time_error(known, seen), known.folded * open_share, mesh)


def _share_of_area(known: Known, open_share: float) -> float:
    """What the error of area by the time steps is of that of friction."""
    if known.exponential:
        return EXPONENTIAL_AREA * min(1.0, open_share / NEARLY_CLOSED)
    return EULER_AREA * open_share**EULER_OPEN_POWER


class Summary:
    """Budgets of many steps, each for as far as the surface slid in it; friction also in proportion to it.

    Where nothing slides they count for as long as they last, and steps that last no time only where none does: a long
    rest does not dilute what a slide says. `numbers` are its sums, shape (10,), from which another begins.
    """

    def __init__(self, numbers: NDArray[np.float64] | None = None) -> None:
        self._sums = np.zeros((2, 1 + len(NAMES))) if numbers is None else numbers.reshape(2, 1 + len(NAMES)).copy()

    @property
    def numbers(self) -> NDArray[np.float64]:
        """The weight, and the weighted sum of each part, of friction and then of area."""
        return self._sums.ravel()

    def add(self, budget: ErrorBudget, friction: float, seconds: float, slid: float = 0.0) -> None:
        """One step of so many seconds, in which the surface slid so far [m]."""
        far = slid or seconds * AT_REST or AT_ONCE
        for sums, parts, weight in zip(self._sums, (budget.friction, budget.area), (friction, 1.0), strict=True):
            if parts is not None:
                sums += weight * far * np.array([1.0, *astuple(parts)])

    @property
    def friction(self) -> Parts | None:
        """The mean over the way, None where nothing has slid, or without friction."""
        return self._mean(0)

    @property
    def area(self) -> Parts | None:
        """The mean over the way, over time where nothing has slid; None where nothing has touched."""
        return self._mean(1)

    def _mean(self, index: int) -> Parts | None:
        weight, *sums = self._sums[index].tolist()
        return Parts(*(value / weight for value in sums)) if weight > 0.0 else None

    def facts(self, accuracy: float) -> dict[str, Any]:
        """As plain data: the accuracy that was asked for, and the relative errors by part, and in all."""
        found = {"friction": self.friction, "contact_area_corrected": self.area}
        parts = {name: asdict(each) | {"total": each.total} for name, each in found.items() if each is not None}
        return {"accuracy": accuracy, **parts}

    def lines(self, accuracy: float, chosen: Collection[str] = ()) -> list[str]:
        """Sentences for run.log, with what to change where more is wrong than `accuracy` allows; it has `chosen` the
        settings behind these parts."""
        found = (("friction", self.friction), ("contact area, corrected,", self.area))
        way = "the distance slid" if self._sums[1, 0] > LEAST_WAY else "time"
        return [
            f"{name} is wrong by about {describe(parts)}, in the mean over {way}{_advice(parts, accuracy, chosen)}"
            for name, parts in found
            if parts is not None
        ]


def _advice(parts: Parts, accuracy: float, chosen: Collection[str]) -> str:
    if parts.total <= accuracy:
        return ""
    worst = max(NAMES, key=lambda name: float(getattr(parts, name)))
    return f", more than numerics.accuracy = {accuracy:g}: try {SMALLER if worst in chosen else REMEDIES[worst]}"


def describe(parts: Parts) -> str:
    """The total in per cent, and what it is made of."""
    shares = ", ".join(f"{name} {100 * getattr(parts, name):.2g} %" for name in NAMES)
    return f"{100 * parts.total:.2g} % ({shares})"

"""How wrong friction and contact area are at most, part by part, from numbers that a step has anyway.

Each part is an estimate of a relative error (1 is all of it), found by experiment: spheres, cylinders and rough
surfaces from 0.4 % to full contact, bodies of one to twelve branches, starts and jumps of velocity, against runs with
finer steps, meshes and tolerances. `scripts/error_coverage.py` tells how they compare with true errors in random
scenes. On one of them an error may happen to be next to nothing, of which no estimate knows.

solver: from the `complementarity` C of the certificate (see `solve.contact.Certificate`). Friction is wrong in
    proportion to it, less where many spots of contact average it out, by the root of the root of their number. Area is
    wrong by the points that penetrate and have no pressure, which the working set of the last iterate counts; and
    somewhat, as C^0.7, where there happen to be none.
time: from how far the spots of contact, or the waves of the surface, pass in a step, and from the embedded pair (see
    `time_error`).
folded: the bound of the branches without a map.
mesh: of friction by how much its two views differ, by the slopes of the rigid surface and of the body (`slopes`), or
    by what edges of contact lose in waves shorter than the cells, and what both views have in common: from the cells
    per shortest wave of a rough surface, and per radius of the spots of contact (`mesh_error`). Of the corrected area
    from the correction itself.

Friction is the small difference of large forces where its coefficient is less than the slopes of the surface: what is
wrong with pressures then counts more, by about the root of the ratio. Pressures that are wrong by the complementarity
may have tangential forces of that share of the slopes: measured at rest, where a sphere and a wave have no friction, it
was 0.05 to 0.7 of that. So small a friction may be wrong by more than all of it: then it is 0 within its error.

Friction of steady sliding is the dissipated power over load and velocity, a sum of squares: it does not vanish by
cancellation. It is wrong in the same proportion as the pressures are, of which three numbers tell: the difference of
the two views over the slope of the surface, cells per shortest wave, and cells per radius of a spot. The difference is
mostly the error of friction by slopes, so that all of it counts in marches, and BY_ENERGY of it here. Of 223 other
states of rough surfaces and spheres the estimate is then half of the error at least in 99.6 %, 0.42 in one, and 5
times in the median; with all of it that was 7.7. Contacts of waves and cylinders are alike, and so are their errors, of
up to 1.2 of the difference: all of it counts. Of cells per wave a share counts (`mesh_error`).
"""

import math
from collections.abc import Callable, Collection
from dataclasses import astuple, dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..physics.entries import Entry, Saved
from ..printed import per_cent
from .mesh_error import SPOTS_POWER, area_by_mesh, friction_by_mesh, lost_at_edges
from .time_error import RunProperties, StepObservation, count_spots, share_of_area, time_error

# accuracy: these constants are fitted to true errors, as the text above says
SOLVER_FRICTION = 1.1  # times the complementarity, over the power SPOTS_POWER of the number of spots
SOLVER_AREA, SOLVER_AREA_POWER = 0.1, 0.7  # times this power of it
PENETRATING = 0.8  # of the points that penetrate without pressure are missing in the contact, but for those in excess
NOISE = 0.4  # of the slope of the surface, times the complementarity: tangential force where there is no friction
BY_ENERGY = 0.3  # of the difference of the views, in steady sliding
PRESSURES = 0.3  # of the slope: friction that is less is not wrong by a larger share, as its power is a sum of squares
ROUNDING = 1e-12  # of the slope of the surface: friction of pressures that are right to all digits
UNKNOWN = 0.5  # accuracy: of friction: one whose error is estimated as more cannot be told from 0
AT_REST, AT_ONCE = 1e-100, 1e-200  # m/s and m: what a second at rest weighs against a way, and what a jump does
LEAST_WAY = 1e-60  # m: smaller weights are those of rest


@dataclass(frozen=True)
class Parts:
    """Relative errors by what makes them; of the mesh's part `across` is what the cells across the sliding make, 0
    where nothing slides, and `edges` what edges of contact lose in waves shorter than the cells. Of surfaces in bands
    `method` is what their coupling makes, and `scatter` what other surfaces of the same spectrum do."""

    solver: float
    time: float
    folded: float
    mesh: float
    across: float = 0.0
    edges: float = 0.0
    method: float = 0.0
    scatter: float = 0.0

    @property
    def total(self) -> float:
        return self.solver + self.time + self.folded + self.mesh + self.method + self.scatter

    @property
    def of_friction(self) -> float:
        """The error of friction as it is stated: 1 or more where it is more than UNKNOWN.

        Such a friction is the small difference of forces that are known, and its error to an order of magnitude only:
        six times friction where 0.76 was estimated.
        """
        return max(self.total, 1.0) if self.total > UNKNOWN else self.total

    @property
    def along(self) -> float:
        """What the cells along the sliding make, or all of the mesh's where nothing slides."""
        return self.mesh - self.across

    def plain(self) -> dict[str, float]:
        """Return the parts that add up, that of the mesh which is made across the sliding, and all of them."""
        return {name: getattr(self, name) for name in NAMES} | {"mesh_across": self.across, "total": self.total}


NAMES = ("solver", "time", "folded", "mesh", "method", "scatter")  # that add up
ALIKE = 0.1  # of the error by the mesh along the sliding and across it, which are then mended together
LITTLE = 0.05  # of the error by the mesh: what one direction makes is not told
SUMS = "sums"  # in a checkpoint
REMEDIES = {
    "solver": "a smaller numerics.tolerance",
    "time": "shorter time steps",
    "folded": "a smaller numerics.branch_error",
    "mesh": "a finer grid",
    "along": "more grid.points along the sliding",
    "across": "more grid.points across the sliding",
    "method": "fewer bands with more points each (bands.count)",
    "scatter": "more surfaces of each band (bands.samples)",
}
SMALLER = "a smaller numerics.accuracy"  # where it has chosen the setting
SHOWN = {
    "time": "time steps",
    "folded": "folded branches",
    "method": "coupling of bands",
    "scatter": "surfaces",
}  # names of parts in sentences
ROUNDED = 1.01  # accuracy: errors are said with three digits, and no closer to a limit than that are they beyond it


@dataclass(frozen=True)
class ErrorBudget:
    """Errors of one instant. Friction is None where there is none; it may be wrong by more than all of it."""

    friction: Parts | None
    area: Parts


def estimate(run: RunProperties, observed: StepObservation, points: int, time: float | None = None) -> ErrorBudget:
    """Return the budget of a step on a grid of so many points; `time` is its time error, if that is at hand."""
    time = time_error(run, observed, points) if time is None else time
    area = _area(run, observed, points, time)
    friction = lambda body: _friction(run, body, points, time)  # noqa: E731
    return ErrorBudget(_with_interface(observed, friction, area), area)


def estimate_steady(run: RunProperties, observed: StepObservation, points: int) -> ErrorBudget:
    """Return the budget of steady sliding, whose friction is that by energy, on a grid of so many points."""
    area = _area(run, observed, points, 0.0)
    friction = lambda body: _steady_friction(run, body, points)  # noqa: E731
    return ErrorBudget(_with_interface(observed, friction, area), area)


def _with_interface(
    observed: StepObservation, of_body: Callable[[StepObservation], Parts], area: Parts
) -> Parts | None:
    """Return the error of friction from that `of_body`, which is relative to its own part, and that of the area, to
    which friction of the interface is proportional; None where there is no friction."""
    if observed.friction <= 0.0:
        return None
    if not observed.interface:
        return of_body(observed)
    own, body = observed.interface / observed.friction, abs(observed.friction - observed.interface)
    parts = [own * error for error in astuple(area)]
    if body > 0.0:
        errors = astuple(of_body(replace(observed, friction=body)))
        parts = [part + body / observed.friction * error for part, error in zip(parts, errors, strict=True)]
    return Parts(*parts)


def _steady_friction(run: RunProperties, observed: StepObservation, points: int) -> Parts:
    apart = observed.views_apart * (1.0 if run.alike else BY_ENERGY)
    views = apart / max(observed.friction, PRESSURES * observed.slope)
    lost = lost_at_edges(run, observed, points, steady=True)
    along, across = friction_by_mesh(run, observed, points, steady=True)
    solver = SOLVER_FRICTION * observed.complementarity / count_spots(run, observed, points) ** SPOTS_POWER
    return Parts(solver, 0.0, run.folded, max(views, lost) + along + across, across, lost)


def _friction(run: RunProperties, observed: StepObservation, points: int, time: float) -> Parts:
    spots, steep = count_spots(run, observed, points), max(1.0, observed.slope / observed.friction)
    solver = SOLVER_FRICTION * observed.complementarity * math.sqrt(steep) / spots**SPOTS_POWER
    noise = NOISE * max(observed.complementarity, ROUNDING) * observed.slope / observed.friction / math.sqrt(spots)
    along, across = friction_by_mesh(run, observed, points, steady=False)
    lost = lost_at_edges(run, observed, points, steady=False)
    mesh = max(observed.views_apart / observed.friction, lost) + along + across
    return Parts(max(solver, noise), time, run.folded, mesh, across, lost)


def _area(run: RunProperties, observed: StepObservation, points: int, time: float) -> Parts:
    open_share = 1.0 - observed.area
    solver = SOLVER_AREA * observed.complementarity**SOLVER_AREA_POWER + PENETRATING * observed.penetrating
    along, across = area_by_mesh(run, observed, points)
    return Parts(solver, share_of_area(run, observed) * time, run.folded * open_share, along + across, across)


def weight_of(slid: float, seconds: float) -> float:
    """Return what a step counts in a mean: as far as the surface slid [m], less by far how long it lasted."""
    return slid or seconds * AT_REST or AT_ONCE


@dataclass(frozen=True)
class ErrorSums:
    """Budgets of many steps, each for as far as the surface slid in it; friction also in proportion to it.

    Where nothing slides they count for as long as they last, and steps that last no time only where none does: a long
    rest does not dilute what a slide says. `sums` are, of friction and of area, the weight, and the weighted sum of
    each part.
    """

    sums: NDArray[np.float64] = field(default_factory=lambda: np.zeros((2, 1 + len(fields(Parts)))))

    def plus(self, budget: ErrorBudget, friction: float, seconds: float, slid: float = 0.0) -> "ErrorSums":
        """Return the sums with one step of so many seconds, in which the surface slid so far [m]."""
        far, sums = weight_of(slid, seconds), self.sums.copy()
        for row, parts, weight in zip(sums, (budget.friction, budget.area), (friction, 1.0), strict=True):
            if parts is not None:
                row += weight * far * np.array([1.0, *astuple(parts)])
        return ErrorSums(sums)

    def entries(self) -> dict[str, Entry]:
        """Return its entry; a checkpoint may lack it."""
        return {SUMS: Entry(self.sums.ravel(), optional=True)}

    @classmethod
    def restored(cls, saved: Saved) -> "ErrorSums":
        if SUMS not in saved:
            return cls()
        found = np.reshape(saved[SUMS], (2, -1))
        return cls(np.pad(found, ((0, 0), (0, 1 + len(fields(Parts)) - found.shape[1]))))  # no directions in old ones

    @property
    def friction(self) -> Parts | None:
        """The mean over the way, None where nothing has slid, or without friction."""
        return self._mean(0)

    @property
    def friction_within(self) -> float:
        """Friction is known to so much, in the mean over the way: an error of its coefficient, not of a share of it."""
        return float(self.sums[0, 1 : 1 + len(NAMES)].sum() / self.sums[1, 0]) if self.sums[1, 0] > 0.0 else math.nan

    @property
    def area(self) -> Parts | None:
        """The mean over the way, over time where nothing has slid; None where nothing has touched."""
        return self._mean(1)

    def _mean(self, index: int) -> Parts | None:
        weight, *sums = self.sums[index].tolist()
        return Parts(*(value / weight for value in sums)) if weight > 0.0 else None

    def facts(self, accuracy: Any) -> dict[str, Any]:
        """Return as plain data the accuracy that was asked for, and the relative errors by part, and in all."""
        found = {"friction": self.friction, "contact_area_corrected": self.area}
        parts = {name: each.plain() for name, each in found.items() if each is not None}
        if self.friction is not None:
            parts["friction"]["total"] = self.friction.of_friction
        return {"accuracy": accuracy, **parts}

    def lines(self, asked: tuple[float, float], chosen: Collection[str] = ()) -> list[str]:
        """Sentences for run.log, with what to change where friction or the area is more wrong than `asked` for; the
        accuracy has `chosen` the settings behind these parts."""
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


def advice(parts: Parts, accuracy: float, chosen: Collection[str] = ()) -> str:
    """Return what to change where more is wrong than `accuracy` allows, or that it is not."""
    if not exceeds(parts.total, accuracy):
        return f"; within the {100 * accuracy:g} % that numerics.accuracy asks for"
    worst = max(NAMES, key=lambda name: float(getattr(parts, name)))
    if worst == "mesh" and worst not in chosen and parts.across:
        both = math.isclose(parts.along, parts.across, rel_tol=ALIKE)
        worst = "mesh" if both else "along" if parts.along > parts.across else "across"
    remedy = SMALLER if worst in chosen else REMEDIES[worst]
    return f"; more than the {100 * accuracy:g} % that numerics.accuracy asks for: try {remedy}"


def exceeds(error: float, accuracy: float) -> bool:
    """Return whether an estimated error is beyond the accuracy asked for, also as it is printed."""
    return error > ROUNDED * accuracy


def describe(parts: Parts, name: str) -> str:
    """Return the total error of "friction", or of another quantity, in per cent, and the parts that it is made of; of
    the mesh also those of both directions, where neither is small."""
    there = [name for name in NAMES if getattr(parts, name)]
    shares = ", ".join(f"{SHOWN.get(name, name)} {per_cent(getattr(parts, name))}" for name in there)
    both = min(parts.across, parts.along) > LITTLE * parts.mesh
    split = f": {per_cent(parts.along)} along, {per_cent(parts.across)} across the sliding" if both else ""
    total = parts.of_friction if name == "friction" else parts.total
    more = " or more" if name == "friction" and total >= 1.0 else ""
    return f"{per_cent(total, 3)}{more} ({shares or 'no part'}{split})"

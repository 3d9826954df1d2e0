"""Results of a study: limits, errors of all cases, the best settings, and sentences about them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from ..printed import per_cent, with_error
from .extrapolation import Limit, extrapolate
from .ladders import Ladders, Settings

QUANTITIES = ("mu_max", "mu_dyn", "contact_area", "contact_area_corrected")
TARGETS = (0.05, 0.03, 0.01, 0.003)
FRICTION = ("mu_max", "mu_dyn")
NEEDED = (*FRICTION, "contact_area_corrected")  # quantities that the sentences assess
TOGETHER, TIME, CHOSEN = "mesh and time together", "time alone", "mesh with auto steps"  # ladders
Outcome = Mapping[str, float]  # a row of sweep.csv
Outcomes = Mapping[Settings, Outcome]


@dataclass(frozen=True)
class StudyFinding:
    """The limit of one quantity along one ladder of one integrator."""

    quantity: str
    integrator: str
    ladder: str
    limit: Limit

    def __str__(self) -> str:
        last = "no order found: value of the last case, and its difference to earlier and finer ones"
        order = last if math.isnan(self.limit.order) else f"order {self.limit.order:.2f}"
        name = f"{self.quantity} with {self.integrator}, {self.ladder}"
        if math.isnan(self.limit.uncertainty):
            return f"{name}: {self.limit.value:.4g} in the last cases, which do not differ: its error is unknown"
        value = with_error(self.limit.value, abs(self.limit.value) * self.limit.doubt)
        return f"{name}: {value} ({per_cent(self.limit.doubt)}), {order}"


def sequences(ladders: Ladders, outcomes: Outcomes, integrator: str) -> dict[str, tuple[list[float], list[Settings]]]:
    """Return sizes and cases of each ladder from coarse to fine: mesh and time together, mesh alone, time alone; for
    chosen steps the mesh only."""
    usual = [case for case in outcomes if case.integrator == integrator]
    coarse, finest = ladders.cells[0], ladders.meshes[-1]
    together = sorted((c for c in usual if _is_same(c.cells_per_step, coarse)), key=lambda case: case.mesh)
    if coarse is None:
        return {CHOSEN: ([1.0 / c.mesh for c in together], together)} if len(together) > 1 else {}
    step = coarse / finest
    mesh = sorted((c for c in usual if math.isclose(c.time_step, step)), key=lambda case: case.mesh)
    time = sorted((c for c in usual if c.mesh == finest), key=lambda case: -case.time_step)
    time = [case for case in time if any(_is_same(case.cells_per_step, cells) for cells in ladders.cells)]
    found = {
        TOGETHER: ([1.0 / c.mesh for c in together], together),
        "mesh alone": ([1.0 / c.mesh for c in mesh], mesh),
        TIME: ([c.time_step for c in time], time),
    }
    return {name: pair for name, pair in found.items() if len(pair[1]) > 1}


def _is_same(one: float | None, other: float | None) -> bool:
    """Return True if cells per step are equal; None means chosen steps."""
    return one == other if one is None or other is None else math.isclose(one, other)


def judged(ladders: Ladders) -> list[str]:
    """Return the quantities whose errors are assessed: friction only if something slides."""
    return [name for name in QUANTITIES if ladders.slides or name not in FRICTION]


def limits(ladders: Ladders, outcomes: Outcomes) -> list[StudyFinding]:
    """Return the limit of every quantity along every ladder."""
    found = []
    for integrator in ladders.integrators:
        for name, (sizes, cases) in sequences(ladders, outcomes, integrator).items():
            for quantity in judged(ladders):
                values = [outcomes[case][quantity] for case in cases]
                found.append(StudyFinding(quantity, integrator, name, extrapolate(sizes, values)))
    return found


def references(ladders: Ladders, outcomes: Outcomes) -> dict[str, Limit]:
    """Return the best limit of each quantity: along mesh and time together, the least uncertain one with an order;
    without a ladder of meshes along time alone.

    Without such a ladder, or without differences, it is the most expensive case, with unknown error. Errors that all
    cases have in common do not show in a limit, so its uncertainty is at least `ladders.shared`.
    """
    found = [one for one in limits(ladders, outcomes) if one.ladder == TIME]
    if len(ladders.meshes) > 1:
        each = [replace(ladders, cells=(cells,)) for cells in ladders.cells]
        found = [one for part in each for one in limits(part, outcomes) if one.ladder in (TOGETHER, CHOSEN)]
    dearest = max(outcomes, key=lambda case: case.effort)
    best = {name: Limit(outcomes[dearest][name], math.nan, math.nan) for name in judged(ladders)}
    for quantity in best:
        choices = [one.limit for one in found if one.quantity == quantity and one.limit.value]
        if choices:
            limit = min(choices, key=lambda one: (math.isnan(one.doubt), math.isnan(one.order), one.doubt))
            best[quantity] = replace(limit, uncertainty=max(limit.uncertainty, ladders.shared * abs(limit.value)))
    return best


def errors(outcome: Outcome, reference: Mapping[str, Limit]) -> dict[str, float]:
    """Return the relative error of each quantity; NaN if the reference is 0, such as friction at rest."""
    return {
        name: abs(outcome[name] / limit.value - 1.0) if limit.value else math.nan for name, limit in reference.items()
    }


def proven(error: Mapping[str, float], reference: Mapping[str, Limit]) -> dict[str, float]:
    """Return the errors, each at least the uncertainty of its reference."""
    return {name: doubt if value < (doubt := reference[name].doubt) else value for name, value in error.items()}


def worst(error: Mapping[str, float]) -> float:
    """Return the largest of the assessed errors; NaN without any."""
    values = [error[name] for name in NEEDED if not math.isnan(error.get(name, math.nan))]
    return max(values, default=math.nan)


def sentences(outcomes: Outcomes, reference: Mapping[str, Limit], ranks: int) -> list[str]:
    """Return the settings that reach each target in the least time, and the error of the reference."""
    error = {case: worst(proven(errors(outcome, reference), reference)) for case, outcome in outcomes.items()}
    if all(map(math.isnan, error.values())):
        return ["there is no contact, and no error"]
    needed = [name for name in NEEDED if name in reference]
    on = "1 rank" if ranks == 1 else f"{ranks} ranks"
    lines = [f"the fastest settings with errors of {', '.join(needed)} within a bound, times of all steps on {on}:"]
    for target in TARGETS:
        enough = [case for case in outcomes if error[case] <= target]
        case = min(enough, key=lambda case: outcomes[case]["seconds"], default=None)
        found = f"{case}; {outcomes[case]['seconds']:.3g} s" if case else "none of these settings is good enough"
        lines.append(f"for {per_cent(target)}: {found}")
    doubt = worst({name: limit.doubt for name, limit in reference.items() if limit.value})
    known = "is not known" if math.isnan(doubt) else f"is {100 * doubt:.2g} %"
    return [*lines, f"the error of the reference, to which they are compared, {known}"]

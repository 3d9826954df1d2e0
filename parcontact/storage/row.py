"""A row of measures.csv: the numbers of one instant, their columns and units."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from operator import attrgetter

from ..errors import InputError
from ..physics.budget import ErrorBudget
from ..physics.measures import Measures
from ..solve.certificate import Certificate


@dataclass(frozen=True)
class Row:
    """One instant of a run, as it goes into measures.csv; SI units, energies in J since the start.

    `errors` is the budget of the instant, None where nothing touches. `added` is what effects have for columns of their
    own. `remark` is a sentence for run.log, or '': what was unusual about the step.
    """

    step: int = 0
    time: float = 0.0
    distance: float = 0.0
    measures: Measures = field(default_factory=Measures)
    iterations: int = 0
    certificate: Certificate = field(default_factory=lambda: Certificate(0.0, 0.0, 0.0))
    operator_calls: int = 0
    work: float = math.nan
    stored: float = math.nan
    dissipated: float = math.nan
    branch_dissipation: tuple[float, ...] = ()
    seconds: float = 0.0
    remark: str = ""
    errors: ErrorBudget | None = None
    added: tuple[float, ...] = ()

    @property
    def wall_time(self) -> float:
        """The wall time of the step [s], to microseconds."""
        return round(self.seconds, 6)

    @property
    def error_friction(self) -> float:
        """The estimated relative error of friction, NaN where there is none."""
        return self.errors.friction.total if self.errors and self.errors.friction else math.nan

    @property
    def error_area(self) -> float:
        """The estimated relative error of the contact area, NaN where there is none."""
        return self.errors.area.total if self.errors else math.nan


COLUMNS = {  # of measures.csv: unit, and where a row has the number
    "step": ("", "step"),
    "time": ("s", "time"),
    "distance": ("m", "distance"),
    "pressure": ("Pa", "measures.pressure"),
    "force_x": ("N", "measures.force_x"),
    "force_y": ("N", "measures.force_y"),
    "friction": ("", "measures.friction"),
    "contact_area": ("", "measures.contact_area"),
    "approach": ("m", "measures.approach"),
    "mean_gap": ("m", "measures.mean_gap"),
    "max_pressure": ("Pa", "measures.max_pressure"),
    "iterations": ("", "iterations"),
    "residual": ("", "certificate.worst"),
    "penetration": ("", "certificate.penetration"),
    "operator_calls": ("", "operator_calls"),
    "work": ("J", "work"),
    "stored": ("J", "stored"),
    "dissipated": ("J", "dissipated"),
    "seconds": ("s", "wall_time"),
}
LAST = {  # after the dissipation of the branches: columns that came later stand at the end
    "friction_x": ("", "measures.friction_x"),
    "contact_area_corrected": ("", "measures.contact_area_corrected"),
    "error_friction": ("", "error_friction"),
    "error_area": ("", "error_area"),
}
UNITS = {name: unit for name, (unit, _) in COLUMNS.items() if unit}  # of the columns that have one
_first = attrgetter(*(place for _, place in COLUMNS.values()))
_last = attrgetter(*(place for _, place in LAST.values()))


def columns(branches: int, added: Sequence[str] = ()) -> list[str]:
    """Return the columns when the dissipation of so many branches is asked for, and effects have added some.

    Raises InputError for a name that is there twice.
    """
    names = [*COLUMNS, *(f"dissipated_{k}" for k in range(branches)), *LAST, *added]
    if twice := {name for name in added if names.count(name) > 1}:
        raise InputError(f"measures.csv has a column {', '.join(sorted(twice))}: an effect must name its own otherwise")
    return names


def numbers(row: Row, branches: int) -> list[float]:
    """Return the numbers of a row, in the order of `columns`; NaN for what was not asked for."""
    return [*_first(row), *row.branch_dissipation[:branches], *_last(row), *row.added]

"""What is recorded of one instant."""

import math
from dataclasses import dataclass, field

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

"""Shares of solver, folded branches, time steps and mesh in the requested accuracy.

They are shares of true errors and add up to 1. Estimates exceed errors, so that they hold in nearly all scenes: in
the median by SOLVER_MEDIAN and TIME_MEDIAN. An estimate may exceed its share by this factor.
"""

from dataclasses import astuple, dataclass

from ..job.sections.calculation import BRANCH_SHARE

SOLVER_MEDIAN = 2.0  # fitted: median of estimate over error of the solver
TIME_MEDIAN = 2.67  # tuning: steps have 0.8 of the accuracy; 1.0 to 3.4, 1.7 in the median of six chosen marches
FOLDED_MEDIAN = 2.0  # accuracy: bound of the folded branches over their error, at least: 4 and 6 in two marches


@dataclass(frozen=True)
class Shares:
    """Shares of the error by source. Raises ValueError unless they add up to 1."""

    solver: float
    folded: float
    time: float
    mesh: float

    def __post_init__(self) -> None:
        if abs(sum(astuple(self)) - 1.0) > 1e-12:  # rounding
            raise ValueError(f"shares of the accuracy add up to {sum(astuple(self)):g}, not to 1")


FOLDED = BRANCH_SHARE / FOLDED_MEDIAN
FRICTION = Shares(solver=0.05, folded=FOLDED, time=0.3, mesh=0.6)
AREA = Shares(solver=0.2, folded=FOLDED, time=0.15, mesh=0.6)
STEADY = Shares(solver=0.1, folded=0.0, time=0.0, mesh=0.9)

"""Shares of the accuracy asked for, which solver, folded branches, time steps and mesh may make of the error.

They are shares of true errors, and add up to 1. Estimates are larger than errors, as they are to hold in nearly all
scenes: in the median by the factors SOLVER_MEDIAN and TIME_MEDIAN. So much more than its share an estimate may be.
"""

from dataclasses import astuple, dataclass

from ..job.sections.calculation import BRANCH_SHARE

SOLVER_MEDIAN = 2.0  # accuracy: estimate over error, of 100 scenes at tolerances of 0.003 to 0.1: 1.7 to 2.2
TIME_MEDIAN = 2.67  # accuracy: the same of marches with chosen steps: 2.2 to 2.7; 0.3 of it is 0.8
FOLDED_MEDIAN = 2.0  # accuracy: the bound of the folded branches over their error, which is more, as a rule


@dataclass(frozen=True)
class Shares:
    """Shares of the error by what makes it. Raises ValueError unless they add up to 1."""

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

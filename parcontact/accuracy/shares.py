"""Shares of solver, folded branches, time steps and mesh in the requested accuracy.

They are shares of true errors and add up to 1. Estimates exceed errors, so that they hold in nearly all scenes: in
the median by SOLVER_MEDIAN and TIME_MEDIAN. An estimate may exceed its share by this factor.
"""

from dataclasses import astuple, dataclass

from ..job.sections.calculation import BRANCH_SHARE

SOLVER_MEDIAN = 2.0  # fitted: median of estimate over error of the solver
TIME_MEDIAN = 2.67  # fitted: the same of marches with chosen steps
FOLDED_MEDIAN = 2.0  # accuracy: bound of the folded branches over their error, usually more


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

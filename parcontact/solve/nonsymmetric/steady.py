"""Contact with an operator that is not symmetric: steady sliding in the frame of the rigid surface, in periodic boxes.

Find p >= 0 with mean P0 and `g = A p - h - d >= 0`, `p g = 0`. For a lossy body sliding at constant velocity, A is
positive but not symmetric, and there is no energy to minimize. Accelerated splitting (`splitting`) solves it. In light
contact, and from a start that is 0, projected steps (`projected`) come first as long as they help: they take fewer
applications of A there. Only the certificate of an admissible pressure ends a solve.
"""

from ...parallel.slab import Array
from ...physics.convolution import Convolution
from ..interface_law import HARD
from ..problem import MeanPressure
from .judge import Judge, SteadyContact
from .projected import Projected
from .splitting import Splitting

LIGHT = 0.05  # tuning: share of the points with pressure in the start, below which projected steps come first
PATIENCE = 5  # tuning: limit on projected steps in which the certificate must halve


class SteadySolver:
    """Solver on one grid. It holds the maps of `Projected` while it makes projected steps, and those of `Splitting`
    afterwards.

    Parameters: `operator` A; `preconditioner` K near its inverse; `tolerance` on the certificate; `most`, a limit on
    steps of the splitting; `pairs` of doublings that make cells square (`extension.pairs_for`).
    """

    def __init__(
        self,
        judge: Judge,
        operator: Convolution,
        preconditioner: Convolution,
        tolerance: float,
        most: int,
        pairs: int = 0,
    ) -> None:
        self.judge, self.operator, self.preconditioner = judge, operator, preconditioner
        self.tolerance, self.most, self.pairs = tolerance, most, pairs

    def hold_all(self) -> tuple[Splitting, Convolution]:
        """Allocate all maps that a solve may need: projected steps need fewer."""
        splitting = Splitting(self.judge, self.operator, self.preconditioner, self.tolerance, self.most)
        return splitting, splitting.resolvent(1.0)

    def solve(self, h: Array, mean: float, start: Array) -> SteadyContact:
        """Solve for heights h under the mean pressure `mean`; collective. The solution overwrites the pressure
        `start`, which may be 0 everywhere."""
        (touching,) = self.judge.slab.sum(float((start > 0.0).sum()))
        if touching < LIGHT * self.judge.slab.points:
            projected = Projected(self.judge, self.operator, self.preconditioner, self.pairs)
            contact = projected.solve(h, mean, start, self.tolerance, PATIENCE)
            if contact.converged:
                return contact
            del projected, contact  # frees their maps before others are made
        splitting = Splitting(self.judge, self.operator, self.preconditioner, self.tolerance, self.most)
        return splitting.solve(h, MeanPressure(mean), HARD, start)

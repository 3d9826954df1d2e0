"""Certificates of admissible pressures, and the contact that solvers return."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...parallel.slab import Array, Slab
from ..certificate import Certificate
from ..constraint import NonNegative
from ..iterate import Lines, certify, form_iterate
from ..problem import Approach, Control


@dataclass(frozen=True)
class SteadyContact:
    """A contact, solved or given up in `steps`. p is the map of the start; `u = A p` belongs to the solver and is valid
    until its next solve. `failure` is empty, or states why the tolerance was not reached."""

    p: Array
    u: Array
    d: float
    certificate: Certificate
    steps: int
    failure: str

    @property
    def converged(self) -> bool:
        return not self.failure


@dataclass(frozen=True)
class Judge:
    """Certifies pressures on one grid: `height` of the surface; `lines` along which the body is stiffer, if gaps are to
    be certified for them."""

    slab: Slab
    height: float
    lines: Lines | None = None

    def certify(
        self, p: Array, u: Array, h: Array, control: Control, working: NDArray[np.bool_]
    ) -> tuple[float, Certificate]:
        """Mark the working set of an admissible pressure with the displacement u. Return its approach and
        certificate; collective."""
        slab, constraint, given = self.slab, NonNegative(), isinstance(control, Approach)
        iterate = form_iterate(slab, constraint, p, u, h, control.value if given else 0.0)
        iterate, mean = (iterate, None) if given else (iterate.settled(), control.value)
        *_, certificate = certify(slab, constraint, p, u, h, iterate, mean, self.height, working)
        if self.lines is not None and iterate.load > 0.0:
            certificate = certificate.shortened(self.lines.share_of_length(slab, p, u, iterate))
        return iterate.d, certificate


def describe_failure(reason: str, certificate: Certificate, tolerance: float) -> str:
    """Return the reason why a solve was given up, with its residual; empty if it met the tolerance."""
    worst = certificate.worst
    return "" if worst <= tolerance else f"{reason}: the residual is {worst:.3g} where {tolerance:.3g} was asked for"

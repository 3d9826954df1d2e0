"""Friction of the contact area itself: a shear stress that opposes sliding on all points in contact.

    F = -tau A v/|v|,    tau constant, or    tau(v) = tau_0 exp(-(log10(a_T |v|/v_0)/w)^2),

a bell in the logarithm of the velocity with its maximum at v_0, which shifts with temperature like the bulk (B. Lorenz,
Y. R. Oh, S. K. Nam, S. H. Jeon, B. N. J. Persson, J. Chem. Phys. 142 (2015) 194701, with c = 1/w^2). Shear does not
move an incompressible half space along its normal (nu = 1/2), so that this friction is added without a coupled solve.
"""

import math
from dataclasses import dataclass, replace
from typing import Protocol

Vector = tuple[float, float]


class Shear(Protocol):
    """Friction of the contact area itself, in addition to that of the body."""

    def force(self, area: float, velocity: Vector) -> Vector:
        """Return the force [N] on the rigid surface that slides with `velocity` [m/s] on an area in contact [m^2]."""

    def shifted(self, factor: float) -> "Shear":
        """Return the friction at a temperature that multiplies the relaxation times of the body by `factor`."""


@dataclass(frozen=True)
class InterfaceFriction:
    """`shear_stress` [Pa], the largest one; of a bell its `velocity` [m/s] and `width` [decades], and the shift factor
    a_T."""

    shear_stress: float
    velocity: float | None = None
    width: float = 1.0
    shift: float = 1.0

    def stress(self, speed: float) -> float:
        """Return the shear stress [Pa] at a sliding speed [m/s]; 0 at rest."""
        if speed <= 0.0:
            return 0.0
        if self.velocity is None:
            return self.shear_stress
        decades = math.log10(speed / self.velocity) + math.log10(self.shift)
        return self.shear_stress * math.exp(-((decades / self.width) ** 2))

    def shifted(self, factor: float) -> "InterfaceFriction":
        """Return the friction with the bell shifted by the factor a_T of the bulk."""
        return replace(self, shift=self.shift * factor)

    def force(self, area: float, velocity: Vector) -> Vector:
        """See `Shear.force`."""
        speed = math.hypot(*velocity)
        size = self.stress(speed) * area / (speed or 1.0)
        return 0.0 - size * velocity[0], 0.0 - size * velocity[1]

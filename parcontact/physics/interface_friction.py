"""Friction of the contact area itself: a shear stress that opposes sliding on all that is in contact.

    F = -tau A v/|v|,    tau constant, or    tau(v) = tau_0 exp(-(log10(a_T |v|/v_0)/w)^2),

a bell over the logarithm of the velocity, largest at v_0, that is shifted with temperature like the bulk (B. Lorenz, Y.
R. Oh, S. K. Nam, S. H. Jeon, B. N. J. Persson, J. Chem. Phys. 142 (2015) 194701, with c = 1/w^2). An incompressible
half space does not move along its normal under shear (nu = 1/2): this adds to friction without a coupled solve.
"""

import math
from dataclasses import dataclass, replace
from typing import Protocol

Vector = tuple[float, float]


class Shear(Protocol):
    """Friction of the contact area itself, which adds to that of the body."""

    def force(self, area: float, velocity: Vector) -> Vector:
        """Return the force [N] on the rigid surface that slides with `velocity` [m/s] on an area in contact [m^2]."""

    def shifted(self, factor: float) -> "Shear":
        """Return the friction at a temperature at which the body relaxes with so many times the relaxation times."""


@dataclass(frozen=True)
class InterfaceFriction:
    """`shear_stress` [Pa], the largest one; of a bell its `velocity` [m/s] and `width` [decades], with the shift factor
    a_T of the temperature."""

    shear_stress: float
    velocity: float | None = None
    width: float = 1.0
    shift: float = 1.0

    def stress(self, speed: float) -> float:
        """Shear stress [Pa] at a sliding speed [m/s]; none at rest."""
        if speed <= 0.0:
            return 0.0
        if self.velocity is None:
            return self.shear_stress
        decades = math.log10(speed / self.velocity) + math.log10(self.shift)
        return self.shear_stress * math.exp(-((decades / self.width) ** 2))

    def shifted(self, factor: float) -> "InterfaceFriction":
        """Return the bell shifted like the bulk, whose relaxation times are so many times as long."""
        return replace(self, shift=self.shift * factor)

    def force(self, area: float, velocity: Vector) -> Vector:
        """Return the force of the stress; `Shear.force`."""
        speed = math.hypot(*velocity)
        size = self.stress(speed) * area / (speed or 1.0)
        return 0.0 - size * velocity[0], 0.0 - size * velocity[1]

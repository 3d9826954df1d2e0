"""Stiffness of a body under the waves of a surface that slides, which decides how its steady state is solved.

Waves that do not vary along the sliding see the long-term modulus G_inf, the others `G(w)` at the frequency w with
which they pass a point.
"""

import numpy as np
from numpy.typing import NDArray

from ..physics.prony import complex_modulus
from ..scene import Setup

CONTRAST = 30.0  # tuning: |G| of the shortest wave over G_inf, above which the body is far softer along stripes
LOSSY = 3.0  # tuning: loss tangent of a wave, above which nearly all work is lost,
SOFT = 4.0  # tuning: if |G| of the longest wave over G_inf is less than this: else the lossy waves are few

Vector = tuple[float, float]


def soft_stripes(setup: Setup, velocity: Vector) -> int | None:
    """Return the axis of an array of rows along which the body is far softer than across it at a velocity [m/s], None
    where it is not: also on a line of points, in a free box, and with a velocity oblique to the grid."""
    moduli = _moduli(setup, velocity)
    if moduli is None or abs(moduli[-1]) < CONTRAST * setup.prony.modulus_inf:
        return None
    return 1 if velocity[0] else 0


def loses_most(setup: Setup, velocity: Vector) -> bool:
    """Return whether the body loses nearly all work of waves along the sliding, where they are independent."""
    moduli = _moduli(setup, velocity)
    if moduli is None or abs(moduli[0]) >= SOFT * setup.prony.modulus_inf:
        return False
    return bool(np.any(moduli.imag > LOSSY * moduli.real))


def _moduli(setup: Setup, velocity: Vector) -> NDArray[np.complex128] | None:
    """Return those of all waves along the sliding, the longest first; None where stripes are of no use."""
    grid = setup.grid
    if setup.half_space.free or 1 in (grid.nx, grid.ny) or np.count_nonzero(velocity) != 1:
        return None
    points, size, speed = (grid.nx, grid.lx, velocity[0]) if velocity[0] else (grid.ny, grid.ly, velocity[1])
    frequencies = 2.0 * np.pi * abs(speed) / size * np.arange(1, points // 2 + 1)
    return complex_modulus(frequencies, *setup.prony)

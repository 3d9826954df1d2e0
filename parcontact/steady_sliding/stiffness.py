"""Stiffness of a body for the waves of a sliding surface, which decides how its steady state is solved.

Waves that do not vary along the sliding have the long-term modulus G_inf, the others `G(w)` at the frequency w with
which they pass a point.
"""

import numpy as np
from numpy.typing import NDArray

from ..physics.prony import complex_modulus
from ..scene import Setup
from ..solve.iterate import Lines

CONTRAST = 30.0  # tuning: least |G| of the shortest wave over G_inf for `soft_stripes`
LOSSY = 3.0  # tuning: least loss tangent of a wave for `loses_most`
HIGHEST = 1e3  # rounding: largest contrast, as larger displacements between lines have rounding errors
SOFT = 4.0  # tuning: largest |G| of the longest wave over G_inf for `loses_most`

Vector = tuple[float, float]


def soft_stripes(setup: Setup, velocity: Vector) -> int | None:
    """Return the axis of an array of rows along which the body is far softer than across it at a velocity [m/s]. It is
    None if there is no such axis: also on a line of points, in a free box, and for oblique velocities."""
    moduli = _moduli(setup, velocity)
    if moduli is None or abs(moduli[-1]) < CONTRAST * setup.prony.modulus_inf:
        return None
    return 1 if velocity[0] else 0


def loses_most(setup: Setup, velocity: Vector) -> bool:
    """Return whether the body loses nearly all work of waves along the sliding, if these are independent."""
    moduli = _moduli(setup, velocity)
    if moduli is None or abs(moduli[0]) >= SOFT * setup.prony.modulus_inf:
        return False
    return bool(np.any(moduli.imag > LOSSY * moduli.real))


def stiffer_lines(setup: Setup, velocity: Vector) -> Lines | None:
    """Return the lines along a velocity [m/s], with |G| of the longest wave along them over G_inf; None for an elastic
    body, on a line of points, in a free box, and for oblique velocities."""
    moduli = _moduli(setup, velocity)
    if moduli is None or not setup.prony.moduli.size:
        return None
    return Lines(1 if velocity[0] else 0, min(float(abs(moduli[0])) / setup.prony.modulus_inf, HIGHEST))


def _moduli(setup: Setup, velocity: Vector) -> NDArray[np.complex128] | None:
    """Return G of all waves along the sliding, the longest first; None if stripes cannot be used."""
    grid = setup.grid
    if setup.half_space.free or 1 in (grid.nx, grid.ny) or np.count_nonzero(velocity) != 1:
        return None
    points, size, speed = (grid.nx, grid.lx, velocity[0]) if velocity[0] else (grid.ny, grid.ly, velocity[1])
    frequencies = 2.0 * np.pi * abs(speed) / size * np.arange(1, points // 2 + 1)
    return complex_modulus(frequencies, *setup.prony)

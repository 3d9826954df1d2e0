"""Flash temperature of rubber that waves of a road deform, in closed form.

A wave of wavenumber q' dissipates the heat Q [W/m^2] with the density 2 q' exp(-2 q' z) over the depth z. After a time
t the rubber that a wave q deforms, weighted in the same way, is warmer by

    T = Q/kappa G(2 q, 2 q', D t),
    G(a, b, tau) = 2/pi int_0^inf a^2/(k^2 + a^2) b^2/(k^2 + b^2) (1 - exp(-k^2 tau))/k^2 dk
                 = 2 sqrt(tau/pi) + (b^3 X(a) - a^3 X(b))/(a b (a^2 - b^2)),     X(a) = 1 - erfcx(a sqrt(tau)),

with conductivity kappa and diffusivity D: the kernel of B. N. J. Persson, J. Phys.: Condens. Matter 18 (2006) 7789, who
writes it for the power per volume. He sums it over all waves of the spectrum, each under its own temperature; that sum
is no closed form. Here the heat of one wave is made in the contact only, while it stays there; the mean of all heat of
the slide comes on top. Strains below a wave on an incompressible body are deeper than this density, 3/(2 q) in the mean
(`effects.heat.solver`): a wave of 3/8 of the wavenumber is as warm at once, and nearly as deep. Arguments are in SI
units and broadcast.
"""

import numpy as np
from scipy.special import erfcx

from parcontact.theory.wavy import Array, Values

NEAR = 1e-3  # accuracy: relative difference of a and b below which the limit is taken, to its square


def kernel(q: Values, other: Values, reach: Values) -> Array:
    """G in m for waves q and q' [1/m] after diffusion over D t [m^2]."""
    root = np.sqrt(reach)
    a, b = 2.0 * np.asarray(q, float), 2.0 * np.asarray(other, float)
    same = np.abs(a / b - 1.0) < NEAR
    middle, apart = 0.5 * (a + b), np.where(same, 2.0 * b, a)
    whole = (b**3 * _forgotten(apart, root) - apart**3 * _forgotten(b, root)) / (apart * b * (apart**2 - b**2))
    slope = -root * (2.0 * middle * root * erfcx(middle * root) - 2.0 / np.sqrt(np.pi))
    limit = 0.5 * (slope - 3.0 * _forgotten(middle, root) / middle)
    return np.asarray(2.0 * root / np.sqrt(np.pi) + np.where(same, limit, whole))


def flash_temperature(
    heat: Values, share: Values, passing: Values, sliding: Values, q: Values, conductivity: float, diffusivity: float
) -> Array:
    """The rise in K of rubber in contact under the heat `heat` [W/m^2, mean over the nominal area], which is made by
    waves q [1/m] on the `share` in contact, where each point is for a time `passing` [s], all having slid for `sliding`
    [s]."""
    mean = np.asarray(heat) * kernel(q, q, diffusivity * np.asarray(sliding))
    local = np.asarray(heat) * (1.0 / np.asarray(share) - 1.0) * kernel(q, q, diffusivity * np.asarray(passing))
    return np.asarray((mean + local) / conductivity)


def _forgotten(a: Array, root: Values) -> Array:
    return np.asarray(1.0 - erfcx(a * root))

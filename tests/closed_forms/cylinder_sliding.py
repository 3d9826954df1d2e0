"""A rigid cylinder that slides steadily on a viscoelastic half-space (line contact, plane strain), one relaxation time.

Everything is dimensionless: lengths in a0 = sqrt(4 W R/(pi E0*)), the Hertzian half width with the instantaneous
modulus (E0* = 4 G(0), W force per length, R radius), pressures in the Hertzian peak p0 = 2 W/(pi a0), `modulus_ratio`
r = G(0)/G(inf) and `velocity` v = V tau/a0 with the creep (retardation) time tau. The cylinder moves towards +x and its
axis is at x = 0.

With l = v and m = v/r (creep and relaxation time as lengths) the body's equation in the moving frame makes q = p - m p'
the solution of Cauchy's singular equation on the contact -a < y = x - c < a,

    q(y) = (1/r) [sqrt(a^2 - y^2) + ((l - c) y + b)/sqrt(a^2 - y^2)].

The unknowns a, b, c follow from the slope at the leading edge, where the surface has no kink, from p = 0 at the
trailing edge and from the force. With k = K1(a/l)/K0(a/l) and i = I1(a/m)/I0(a/m) (modified Bessel functions) they are

    b = a c k,    c = (l - m) i/(i + k),    a^2 + 2 b = r,    and then    mu R/a0 = <x>_p = c - m + a^2 (l - c)/r.

Source: S. C. Hunter, J. Appl. Mech. 28 (1961) 611, for the problem; derived anew in this form.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import i0e, i1e, k0e, k1e

from parcontact.theory.wavy import Array

from .quadrature import graded_rule


class SlidingCylinder(NamedTuple):
    """A steady state: `half_width`, `leading_edge` and `trailing_edge` in a0, `friction` is mu R/a0."""

    friction: float
    half_width: float
    leading_edge: float
    trailing_edge: float


def sliding_cylinder(modulus_ratio: float, velocity: float) -> SlidingCylinder:
    """Friction and contact edges for G(0)/G(inf) = `modulus_ratio` >= 1 and v = V tau/a0 = `velocity` > 0."""
    if not (modulus_ratio >= 1 and velocity > 0):
        raise ValueError("The modulus ratio must be at least 1 and the velocity positive.")

    def excess(half_width: float) -> float:
        _, b = _centre_and_b(half_width, modulus_ratio, velocity)
        return half_width**2 + 2 * b - modulus_ratio

    # at the upper end b >= 0 decides; at the lower one b <= a^2 (r - 1)/2, its value for infinite velocity
    half_width = float(brentq(excess, 0.5, 2 * np.sqrt(modulus_ratio), xtol=1e-15, rtol=1e-15))
    centre, _ = _centre_and_b(half_width, modulus_ratio, velocity)
    friction = centre - velocity / modulus_ratio + half_width**2 * (velocity - centre) / modulus_ratio
    return SlidingCylinder(friction, half_width, centre + half_width, centre - half_width)


def pressure(x: ArrayLike, modulus_ratio: float, velocity: float) -> Array:
    """p(x) in p0 at distances x (in a0, any shape) ahead of the axis: int_y^a exp(-(s - y)/m) q(s) ds/m."""
    contact = sliding_cylinder(modulus_ratio, velocity)
    a, memory = contact.half_width, velocity / modulus_ratio
    centre, b = _centre_and_b(a, modulus_ratio, velocity)
    y = np.asarray(x, float) - centre
    angle = np.where(np.abs(y) < a, np.arccos(np.clip(y / a, -1, 1)), 0.0)[..., None]
    share, rest, weights = graded_rule()
    theta = angle * share  # s = a cos(theta)
    distance = 2 * a * np.sin(angle * (1 + share) / 2) * np.sin(angle * rest / 2)
    source = (a * np.sin(theta)) ** 2 + (velocity - centre) * a * np.cos(theta) + b
    return np.asarray((angle[..., 0] / velocity) * ((np.exp(-distance / memory) * source) @ weights))


def _centre_and_b(half_width: float, modulus_ratio: float, velocity: float) -> tuple[float, float]:
    """c and b of the solution in the module's docstring, for a given half width."""
    z = half_width * modulus_ratio / velocity
    i = i1e(z) / i0e(z)
    k = k1e(z / modulus_ratio) / k0e(z / modulus_ratio)
    centre = velocity * (1 - 1 / modulus_ratio) * i / (i + k)
    return float(centre), float(half_width * centre * k)

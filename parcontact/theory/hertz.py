"""A rigid sphere pressed into a half-space: elastic (Hertz), or viscoelastic (Lee and Radok; Ting).

    a^3 = 3 W R / (4 E*),   d = a^2/R,   p(r) = (2 E*/(pi R)) sqrt(a^2 - r^2),   E* = 2 G/(1 - nu)

with contact radius a, force W, radius of the sphere R, approach d, pressure p, shear modulus G and Poisson ratio nu.

On a viscoelastic half-space, without sliding, the elastic solution holds while the contact grows, with its products
replaced by history integrals (J creep compliance, G relaxation function):

    a^2 = R d,   a^3(t) = (3 R/16) int J(t-s) dW(s),   W(t) = (16/(3 R)) int G(t-s) d a^3(s),
    p(r, t) = (8/(pi R)) int G(t-s) d sqrt(a^2(s) - r^2)_+

While the contact shrinks, its radius at the time t equals the radius at an earlier time t1(t). This time follows from
int_{t1}^t G(t-s) d'(s) ds = 0, and the integral for W ends at t1. Contact is lost when t1 = 0.

Sources: K. L. Johnson, Contact Mechanics (1985), section 4.2; E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27 (1960) 438;
T. C. T. Ting, J. Appl. Mech. 33 (1966) 845. A viscoelastic body is incompressible and at rest before t = 0. Arguments
are in SI units and broadcast; for a viscoelastic body, only times and distances may be arrays.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import hyp1f1

from ..physics.prony import Moduli, normal_form, relaxation_integral
from .wavy import Array, Values


def contact_modulus(shear_modulus: Values, poisson: Values = 0.5) -> Array:
    """Return E* = E/(1 - nu^2) = 2 G/(1 - nu) [Pa]; 4 G for an incompressible body."""
    return np.asarray(2 * shear_modulus / (1 - poisson))


def contact_radius(force: Values, radius: Values, shear_modulus: Values, poisson: Values = 0.5) -> Array:
    """Return the contact radius a = (3 W R/(4 E*))^(1/3) [m] under a force [N]."""
    return np.cbrt(3 * force * radius / (4 * contact_modulus(shear_modulus, poisson)))


def approach(force: Values, radius: Values, shear_modulus: Values, poisson: Values = 0.5) -> Array:
    """Return the approach d = a^2/R [m] under a force [N]: the depth of the sphere's lowest point below the undeformed
    surface."""
    return contact_radius(force, radius, shear_modulus, poisson) ** 2 / radius


def force(approach: Values, radius: Values, shear_modulus: Values, poisson: Values = 0.5) -> Array:
    """Return the force W = (4/3) E* sqrt(R) d^(3/2) [N] for an approach d [m]; 0 for d < 0."""
    depth = np.maximum(approach, 0)
    return 4 / 3 * contact_modulus(shear_modulus, poisson) * np.sqrt(radius * depth) * depth


def peak_pressure(force: Values, radius: Values, shear_modulus: Values, poisson: Values = 0.5) -> Array:
    """Return p(0) = 2 E* a/(pi R) [Pa], 3/2 of the mean pressure over the contact."""
    a = contact_radius(force, radius, shear_modulus, poisson)
    return 2 * contact_modulus(shear_modulus, poisson) * a / (np.pi * radius)


def pressure(r: Values, force: Values, radius: Values, shear_modulus: Values, poisson: Values = 0.5) -> Array:
    """Return p(r) [Pa] at distances r [m] from the axis; 0 outside the contact."""
    a = contact_radius(force, radius, shear_modulus, poisson)
    inside = np.sqrt(np.maximum(a**2 - r**2, 0))
    return 2 * contact_modulus(shear_modulus, poisson) * inside / (np.pi * radius)


def displacement(r: Values, force: Values, radius: Values, shear_modulus: Values, poisson: Values = 0.5) -> Array:
    """Return the normal displacement u(r) of the surface [m], which vanishes far away (Johnson, Eqs. 3.41a and 3.42a):
    u = d - r^2/(2R) in the contact and ((2 a^2 - r^2) asin(a/r) + a sqrt(r^2 - a^2))/(pi R) outside."""
    a = contact_radius(force, radius, shear_modulus, poisson)
    r = np.maximum(r, 0)
    outer = np.maximum(r, a)
    ratio = np.divide(a, outer, out=np.ones(np.broadcast(a, outer).shape), where=outer > 0)
    tail = ((2 * a**2 - outer**2) * np.arcsin(ratio) + a * np.sqrt(outer**2 - a**2)) / np.pi
    return np.asarray(np.where(r < a, a**2 - r**2 / 2, tail) / radius)


# an approach that rises evenly to `peak_approach` in `rise_time` and falls back as fast


def triangle_force(t: ArrayLike, peak_approach: float, rise_time: float, radius: float, *material: *Moduli) -> Array:
    """Return the force W(t) [N] at times t >= 0 [s], any shape, for an approach that rises linearly in `rise_time` to
    `peak_approach` and falls at the same rate. The force is 0 after lift-off.

        W = 8 sqrt(R) (peak_approach/rise_time)^(3/2) int_0^{t1} G(t-s) sqrt(s) ds

    with the time t1 during the rise at which the contact was as large as at t. A term of the Prony series with the time
    tau contributes (2/3) t1^(3/2) exp(-(t - t1)/tau) M(1, 5/2, -t1/tau) to the integral, with Kummer's function M.
    """
    spring, terms, times = normal_form(*material)
    earlier = _time_of_equal_radius(t, rise_time, spring, terms, times)
    since = np.asarray(t, float) - earlier
    memory = np.exp(-since[..., None] / times) * hyp1f1(1.0, 2.5, -earlier[..., None] / times)
    stiffness = 16 / 3 * np.sqrt(radius) * (peak_approach / rise_time) ** 1.5
    return np.asarray(stiffness * earlier**1.5 * (spring + memory @ terms))


def triangle_lift_off_time(rise_time: float, *material: *Moduli) -> float:
    """Return the time [s] at which contact is lost if the approach rises and falls as in `triangle_force`. This time t
    solves int_0^t G = 2 int_0^{t - rise_time} G, and does not depend on the sphere and the depth."""
    series = normal_form(*material)

    def excess(t: float) -> float:
        return float(relaxation_integral(t, *series) - 2 * relaxation_integral(t - rise_time, *series))

    # an elastic body lets go at 2 rise_time exactly, where rounding must not hide the change of sign
    return float(brentq(excess, rise_time, 2 * rise_time * (1 + 1e-12), xtol=1e-15 * rise_time))


def _time_of_equal_radius(t: ArrayLike, rise_time: float, *material: *Moduli) -> Array:
    """Return the time during the rise at which the contact was as large as at t; 0 after lift-off. After the rise it is
    t minus the age x that solves int_0^x G = 2 int_0^{t - rise_time} G."""
    series = normal_form(*material)
    lift_off = triangle_lift_off_time(rise_time, *series)

    def earlier(t: float) -> float:
        if t <= rise_time or t >= lift_off:
            return t if t <= rise_time else 0.0
        target = 2 * relaxation_integral(t - rise_time, *series)
        age = brentq(lambda x: relaxation_integral(x, *series) - target, t - rise_time, t, xtol=1e-15 * rise_time)
        return t - float(age)

    return np.asarray(np.vectorize(earlier, otypes=[float])(t))

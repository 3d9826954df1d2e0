"""Adhesion of elastic bodies: sphere, cylinder, flat punch and wave in closed form.

The work of adhesion w [J/m^2] is what it costs to part a unit of area. Short-ranged adhesion (JKR) adds the edge of a
crack to the contact: its stress intensity follows from Griffith's G = w. Long-ranged adhesion (DMT) leaves the contact
as it is without. In between is Maugis' sphere, whose attraction is constant up to a distance (Dugdale's law).

    sphere     P = 4 E* a^3/(3 R) - sqrt(8 pi E* w a^3),   d = a^2/R - sqrt(2 pi w a/E*)
    cylinder   P/L = pi E* a^2/(4 R) - sqrt(2 pi E* w a)
    punch      P = sqrt(8 pi E* w a^3), the force that pulls it off
    wave       p/(pi E* h/lambda) = sin^2 psi - alpha sqrt(tan psi),   alpha^2 = 2 w lambda/(pi^2 E* h^2)

with contact radius or half width a, force P, approach d, radius R, contact modulus E* (`hertz.contact_modulus`), height
h cos(2 pi x/lambda) of the wave, psi = pi a/lambda. Tabor's parameter (`adhesion.attraction`) is large where a law of
attraction is near to JKR, and small where it is near to DMT. Maugis' parameter is
lambda = 2 sigma0 (R/(pi w K^2))^(1/3) for an attraction sigma0 that reaches as far as w/sigma0, K = 4 E*/3.

Sources: K. L. Johnson, K. Kendall, A. D. Roberts, Proc. R. Soc. A 324 (1971) 301; B. V. Derjaguin, V. M. Muller,
Yu. P. Toporov, J. Colloid Interface Sci. 53 (1975) 314; M. Barquins, J. Adhesion 26 (1988) 1 (cylinder); K. Kendall,
J. Phys. D 4 (1971) 1186 (punch); D. Maugis, J. Colloid Interface Sci. 150 (1992) 243; K. L. Johnson, Int. J. Solids
Struct. 32 (1995) 423 (wave). Arguments are in SI units and broadcast, unless a function says otherwise.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from parcontact.theory.wavy import Array, Values

# JKR: sphere


def sphere_force(contact_radius: Values, radius: Values, work: Values, contact_modulus: Values) -> Array:
    """P(a) in N, positive where it presses; in equilibrium, stable or not."""
    hertz = 4 * contact_modulus * contact_radius**3 / (3 * radius)
    return np.asarray(hertz - np.sqrt(8 * np.pi * contact_modulus * work * contact_radius**3))


def sphere_approach(contact_radius: Values, radius: Values, work: Values, contact_modulus: Values) -> Array:
    """d(a) in m: how far the sphere's lowest point is below the undeformed surface."""
    return np.asarray(contact_radius**2 / radius - np.sqrt(2 * np.pi * work * contact_radius / contact_modulus))


# JKR: cylinder and flat punch


def cylinder_pull_off(radius: Values, work: Values, contact_modulus: Values) -> Array:
    """-(3/4) (4 pi E* w^2 R)^(1/3) = -1.74367 (E* w^2 R)^(1/3) in N/m, the lowest force."""
    return np.asarray(-0.75 * np.cbrt(4 * np.pi * contact_modulus * np.square(work) * radius))


def punch_pull_off(radius: Values, work: Values, contact_modulus: Values) -> Array:
    """-sqrt(8 pi E* w a^3) in N for a flat circular punch of radius a (m)."""
    return np.asarray(-np.sqrt(8 * np.pi * contact_modulus * work * np.power(radius, 3)))


# Maugis: a sphere with Dugdale's law


class MaugisSphere(NamedTuple):
    """Equilibrium, without dimension: with K = 4 E*/3 `contact_radius` in (pi w R^2/K)^(1/3), `force` in pi w R and
    `approach` in (pi^2 w^2 R/K^2)^(1/3)."""

    contact_radius: Array
    force: Array
    approach: Array


def maugis_sphere(parameter: Values, outer_radius: Values) -> MaugisSphere:
    """The equilibrium with `outer_radius` m = c/a > 1, c the radius up to which the attraction acts (Maugis, Eqs. 6.17,
    6.20 and 6.21), for the `parameter` lambda > 0.

    With s = sqrt(m^2 - 1) and t = arctan s: lambda abar^2 (s + (m^2 - 2) t)/2 + (4/3) lambda^2 abar (s t - m + 1) = 1
    gives abar, then P = abar^3 - lambda abar^2 (s + m^2 t) and d = abar^2 - (4/3) lambda abar s.
    """
    m = np.asarray(outer_radius, float)
    s = np.sqrt(m**2 - 1)
    t = np.arctan(s)
    square = parameter * (s + (m**2 - 2) * t) / 2
    linear = 2 / 3 * parameter**2 * (s * t - m + 1)  # half of the coefficient
    a = 1 / (linear + np.sqrt(linear**2 + square))
    return MaugisSphere(a, a**3 - parameter * a**2 * (s + m**2 * t), a**2 - 4 / 3 * parameter * a * s)


def maugis_pull_off(parameter: float) -> float:
    """The lowest force over pi w R, negative, for the `parameter` lambda; -1.5 for large and -2 for small ones."""

    def force(log_zone: float) -> float:
        return float(maugis_sphere(parameter, np.hypot(1, np.exp(log_zone))).force)

    zones = np.linspace(-10, 10, 201)  # ln s; the lowest force is near s = 1/lambda
    best = int(np.argmin([force(zone) for zone in zones[1:-1]]))
    nearby = (zones[best], zones[best + 2])
    return float(minimize_scalar(force, bounds=nearby, method="bounded", options={"xatol": 1e-9}).fun)


# Johnson: a wave


def wave_pressure(contact_fraction: Values, adhesion: Values) -> Array:
    """Mean pressure over pi E* h/lambda with a `contact_fraction` 2a/lambda below 1, for the `adhesion` alpha; in
    equilibrium, stable or not."""
    psi = np.pi / 2 * np.asarray(contact_fraction, float)
    return np.asarray(np.sin(psi) ** 2 - adhesion * np.sqrt(np.tan(psi)))


class WaveLimits(NamedTuple):
    """Where the stable branch of a wave begins and ends: mean pressures over pi E* h/lambda, fractions 2a/lambda."""

    pull_off: float
    pull_off_fraction: float
    jump: float
    jump_fraction: float


def wave_limits(adhesion: float) -> WaveLimits:
    """The lowest pressure and the highest, from which contact jumps to full contact, for the `adhesion` alpha.

    Both are where sin(2 psi) = alpha/(2 cos^2(psi) sqrt(tan psi)). Raises ValueError from alpha = 1.0653
    on, where no partial contact is stable.
    """

    def slope(psi: float) -> float:
        return float(4 * np.sin(psi) ** 1.5 * np.cos(psi) ** 2.5 - adhesion)

    highest = np.arctan(np.sqrt(0.6))
    if not 0 < adhesion < slope(highest) + adhesion:
        raise ValueError("The adhesion must be positive and so small that partial contact is stable.")
    first = float(brentq(slope, 0, highest, xtol=1e-15)) * 2 / np.pi
    last = float(brentq(slope, highest, np.pi / 2, xtol=1e-15)) * 2 / np.pi
    return WaveLimits(float(wave_pressure(first, adhesion)), first, float(wave_pressure(last, adhesion)), last)

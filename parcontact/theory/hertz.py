"""A rigid sphere pressed into an elastic half-space (Hertz).

    a^3 = 3 W R / (4 E*),   d = a^2/R,   p(r) = (2 E*/(pi R)) sqrt(a^2 - r^2),   E* = 2 G/(1 - nu)

with contact radius a, force W, radius of the sphere R, approach d, pressure p, shear modulus G and Poisson ratio nu.
Source: K. L. Johnson, Contact Mechanics (1985), section 4.2. Arguments are in SI units and broadcast."""

import numpy as np

from .full_contact import Array, Values


def contact_modulus(shear_modulus: Values, poisson: Values = 0.5) -> Array:
    """Return E* = E/(1 - nu^2) = 2 G/(1 - nu) [Pa]; 4 G for an incompressible body."""
    return np.asarray(2 * shear_modulus / (1 - poisson))


def contact_radius(force: Values, radius: Values, shear_modulus: Values, poisson: Values = 0.5) -> Array:
    """Return a = (3 W R/(4 E*))^(1/3) [m]."""
    return np.cbrt(3 * force * radius / (4 * contact_modulus(shear_modulus, poisson)))


def approach(force: Values, radius: Values, shear_modulus: Values, poisson: Values = 0.5) -> Array:
    """Return d = a^2/R [m], the depth of the sphere's lowest point below the undeformed surface."""
    return contact_radius(force, radius, shear_modulus, poisson) ** 2 / radius


def force(approach: Values, radius: Values, shear_modulus: Values, poisson: Values = 0.5) -> Array:
    """Return W = (4/3) E* sqrt(R) d^(3/2) [N] for an approach d [m]; 0 for d < 0."""
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
    """Return the normal displacement u(r) of the surface [m], 0 far away (Johnson, Eqs. 3.41a and 3.42a). u = d -
    r^2/(2R) in the contact and ((2 a^2 - r^2) asin(a/r) + a sqrt(r^2 - a^2))/(pi R) outside."""
    a = contact_radius(force, radius, shear_modulus, poisson)
    r = np.maximum(r, 0)
    outer = np.maximum(r, a)
    ratio = np.divide(a, outer, out=np.ones(np.broadcast(a, outer).shape), where=outer > 0)
    tail = ((2 * a**2 - outer**2) * np.arcsin(ratio) + a * np.sqrt(outer**2 - a**2)) / np.pi
    return np.asarray(np.where(r < a, a**2 - r**2 / 2, tail) / radius)

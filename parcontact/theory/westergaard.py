"""A rigid wavy surface (one sinusoid) pressed on an elastic or viscoelastic half-space (Westergaard).

The surface h(x) = Delta cos(2 pi x/lambda) has its crests at x = 0, ±lambda, ...; p is the mean pressure. With
p* = pi E* Delta/lambda, at which contact becomes complete, s = min(p/p*, 1), psi = pi x/lambda and E* = 2 G/(1 - nu):

    contact fraction  f = (2/pi) asin sqrt(s)
    pressure          p(x) = 2 p* |cos psi| sqrt(s - sin^2 psi)_+               p + p* cos(2 psi) in full contact
    gap               g(x) = 2 Delta (y sqrt(y^2 - s) - s arcosh(y/sqrt(s))),   y = |sin psi| > sqrt(s)
    mean gap          Delta (1 - s + s ln s)

Source: H. M. Westergaard, J. Appl. Mech. 6 (1939) 49; K. L. Johnson, Contact Mechanics (1985), section 13.2. The gap
is the integral of its slope outside the contact; the mean gap d follows from the elastic energy U per area, dU = -p dd.
Arguments are in SI units and broadcast."""

import numpy as np

from .full_contact import Array, Values


def full_contact_pressure(amplitude: Values, wavelength: Values, shear_modulus: Values, poisson: Values = 0.5) -> Array:
    """Return p* = pi E* Delta/lambda [Pa], the mean pressure at which contact becomes complete."""
    modulus = 2 * shear_modulus / (1 - poisson)
    return np.asarray(np.pi * modulus * amplitude / wavelength)


def contact_fraction(
    mean_pressure: Values, amplitude: Values, wavelength: Values, shear_modulus: Values, poisson: Values = 0.5
) -> Array:
    """Return the share in contact, f = 2a/lambda = (2/pi) asin sqrt(p/p*)."""
    load = mean_pressure / full_contact_pressure(amplitude, wavelength, shear_modulus, poisson)
    return _fraction(load)


def pressure(
    x: Values,
    mean_pressure: Values,
    amplitude: Values,
    wavelength: Values,
    shear_modulus: Values,
    poisson: Values = 0.5,
) -> Array:
    """Return p(x) [Pa] at distances x [m] from a crest; any x."""
    full = full_contact_pressure(amplitude, wavelength, shear_modulus, poisson)
    psi = np.pi * x / wavelength
    inside = np.maximum(mean_pressure / full - np.sin(psi) ** 2, 0)
    partial = 2 * full * np.abs(np.cos(psi)) * np.sqrt(inside)
    return np.asarray(np.where(mean_pressure < full, partial, mean_pressure + full * np.cos(2 * psi)))


def peak_pressure(
    mean_pressure: Values, amplitude: Values, wavelength: Values, shear_modulus: Values, poisson: Values = 0.5
) -> Array:
    """Return p(0) [Pa]: 2 sqrt(p p*) in partial contact, p + p* in full contact."""
    return pressure(0.0, mean_pressure, amplitude, wavelength, shear_modulus, poisson)


def gap(
    x: Values,
    mean_pressure: Values,
    amplitude: Values,
    wavelength: Values,
    shear_modulus: Values,
    poisson: Values = 0.5,
) -> Array:
    """Return g(x) [m], the distance between the surfaces; 0 in contact."""
    load = mean_pressure / full_contact_pressure(amplitude, wavelength, shear_modulus, poisson)
    edge = np.sqrt(np.clip(load, np.finfo(float).tiny, 1))
    y = np.maximum(np.abs(np.sin(np.pi * x / wavelength)), edge)
    return np.asarray(2 * amplitude * (y * np.sqrt((y - edge) * (y + edge)) - edge**2 * np.arccosh(y / edge)))


def mean_gap(
    mean_pressure: Values, amplitude: Values, wavelength: Values, shear_modulus: Values, poisson: Values = 0.5
) -> Array:
    """Return the mean gap over one wave [m], Delta (1 - s + s ln s) with s = p/p*."""
    load = mean_pressure / full_contact_pressure(amplitude, wavelength, shear_modulus, poisson)
    s = np.clip(load, np.finfo(float).tiny, 1)
    return amplitude * (1 - s + s * np.log(s))


def _fraction(load: Values) -> Array:
    return np.asarray(2 / np.pi * np.arcsin(np.sqrt(np.clip(load, 0, 1))))

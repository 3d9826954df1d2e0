"""Rigid wavy surfaces on a half-space: one wave on an elastic body, and many waves in full contact.

One wave, h(x) = Delta cos(2 pi x/lambda), is in partial or full contact with an elastic half-space (Westergaard). Its
crests are at x = 0, ±lambda, ..., and p is the mean pressure. Contact is complete at p* = pi E* Delta/lambda. With s =
min(p/p*, 1), psi = pi x/lambda and E* = 2 G/(1 - nu):

    contact fraction  f = (2/pi) asin sqrt(s)
    pressure          p(x) = 2 p* |cos psi| sqrt(s - sin^2 psi)_+               partial contact
                      p(x) = p + p* cos(2 psi)                                  full contact
    gap               g(x) = 2 Delta (y sqrt(y^2 - s) - s arcosh(y/sqrt(s))),   y = |sin psi| > sqrt(s)
    mean gap          d = Delta (1 - s + s ln s)

Source: H. M. Westergaard, J. Appl. Mech. 6 (1939) 49; K. L. Johnson, Contact Mechanics (1985), section 13.2. The gap is
the integral of its slope outside the contact. The mean gap d follows from the elastic energy U per area by dU = -p dd.
Arguments are in SI units and broadcast.

Many waves slide in full contact with a viscoelastic half-space. This problem is linear, so that its solution is exact.
The surface is a sum of waves with distinct wave vectors, h(x, y) = sum Re[A exp(i (kx x + ky y))], and has been
displaced by (sx, sy). Each wave has a transfer modulus M. In steady sliding M is the complex modulus G*(omega) at omega
= kx vx + ky vy. After a change of velocity M depends on time, and in a code that steps through time also on the time
step. With k = |(kx, ky)|:

    pressure    p = p0 + sum Re[2 k A conj(M) exp(i (kx (x - sx) + ky (y - sy)))]
    traction    <p grad h> = -sum k |A|^2 (kx, ky) Im M        force on the rigid surface per nominal area
    friction    mu = -traction . v/(|v| p0)

These formulas hold while the pressure is positive everywhere. The pressure of a wave is ahead of the wave by the phase
of M.

Source: Eqs. (5) and (10) of the paper "Transient frictionless contact of a rough rigid surface on a viscoelastic
half-space" with u = h; for the steady state also B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840. The arguments
`amplitude` (in m, real or complex), `kx` and `ky` (in rad/m) have one entry for each wave, and broadcast. All are in SI
units.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..physics.prony import Moduli, complex_modulus

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Values = float | Array
ComplexValues = complex | Array | ComplexArray


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
    """Return p(x) [Pa] at any distances x [m] from a crest."""
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


class Waves(NamedTuple):
    """Complex amplitudes [m] and wave vectors [rad/m] of real waves, shape (waves,). Of two opposite wave vectors only
    one is listed, as both belong to the same real wave."""

    amplitude: ComplexArray
    kx: Array
    ky: Array


def waves(heights: ArrayLike, length_x: float, length_y: float) -> Waves:
    """Return the waves of a map of heights [m], shape (ny, nx), on a periodic rectangle of sides length_x and length_y
    [m].

    The mean is left out. Raises ValueError for a wave of two points per period (Nyquist), whose heights do not define a
    slope.
    """
    heights = np.asarray(heights, float)
    ny, nx = heights.shape
    amplitudes = 2 * np.fft.fft2(heights - heights.mean()) / heights.size
    rows, columns = (np.fft.fftfreq(count, 1 / count) for count in (ny, nx))
    row, column = np.meshgrid(rows, columns, indexing="ij")
    present = np.abs(amplitudes) > 1e-14 * np.abs(heights).max()  # the rest is rounding
    if np.any(present & ((2 * row == -ny) | (2 * column == -nx))):
        raise ValueError("The map of heights has a wave of two points per period.")
    chosen = present & ((column > 0) | (column == 0) & (row > 0))
    return Waves(amplitudes[chosen], 2 * np.pi / length_x * column[chosen], 2 * np.pi / length_y * row[chosen])


def frequency(kx: Values, ky: Values, vx: Values, vy: Values) -> Array:
    """Return omega = kx vx + ky vy [rad/s], the angular frequency at which a wave passes a point of the body."""
    return np.asarray(kx * vx + ky * vy)


def pressure_amplitude(amplitude: ComplexValues, kx: Values, ky: Values, modulus: ComplexValues) -> ComplexArray:
    """Return 2 k A conj(M) [Pa]: amplitude and phase of each wave of pressure relative to the moving surface; `modulus`
    is the transfer modulus M."""
    return 2 * np.hypot(kx, ky) * amplitude * np.conj(modulus)


def traction(amplitude: ComplexValues, kx: Values, ky: Values, modulus: ComplexValues) -> Array:
    """Return the force on the rigid surface per nominal area, <p grad h> = -sum k |A|^2 (kx, ky) Im M [Pa], shape (...,
    2). `modulus` holds the transfer moduli M [Pa], and its last axis runs over the waves."""
    strength = np.hypot(kx, ky) * np.abs(amplitude) ** 2 * np.imag(modulus)
    return -np.stack([np.sum(strength * kx, axis=-1), np.sum(strength * ky, axis=-1)], axis=-1)


def friction_coefficient(
    mean_pressure: Values, amplitude: ComplexValues, kx: Values, ky: Values, vx: float, vy: float, *material: *Moduli
) -> Array:
    """Return mu = sum k |A|^2 omega G''(omega)/(|v| p0) of all waves in steady sliding at the velocity v = (vx, vy)
    [m/s], which must not be 0."""
    modulus = complex_modulus(frequency(kx, ky, vx, vy), *material)
    return _friction(traction(amplitude, kx, ky, modulus), vx, vy, mean_pressure)


def _friction(traction: Array, vx: float, vy: float, mean_pressure: Values) -> Array:
    return np.asarray(-(traction @ np.array([vx, vy])) / (np.hypot(vx, vy) * mean_pressure))

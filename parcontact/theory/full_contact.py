"""A rigid rough surface in full contact with a viscoelastic half-space on which it slides.

The problem is linear, so that the solution is exact.

The surface is a sum of waves with distinct wave vectors, h(x, y) = sum Re[A exp(i (kx x + ky y))], displaced by s(t).
Each wave has a transfer modulus M: the complex modulus G*(omega) at omega = kx vx + ky vy in steady sliding, a function
of time after a change of velocity, and also a function of the time step for a time-stepping code. With k = |(kx, ky)|:

    pressure    p = p0 + sum Re[2 k A conj(M) exp(i (kx (x - sx) + ky (y - sy)))]
    traction    <p grad h> = -sum k |A|^2 (kx, ky) Im M        force on the surface per nominal area
    friction    mu = -traction . v/(|v| p0)

valid while the pressure is positive everywhere. The pressure of a wave is ahead of the wave by the phase of M.

Source: Eqs. (5) and (10) of the paper "Transient frictionless contact of a rough rigid surface on a viscoelastic
half-space" with u = h; for the steady state also B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840. Wave arguments
(`amplitude` in m, maybe complex, `kx`, `ky` in rad/m) have one entry per wave and broadcast; SI units.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..physics.prony import Moduli, complex_modulus

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Values = float | Array
ComplexValues = complex | Array | ComplexArray


class Waves(NamedTuple):
    """Complex amplitudes [m] and wave vectors [rad/m] of real waves; of two opposite wave vectors, one is listed."""

    amplitude: ComplexArray
    kx: Array
    ky: Array


def waves(heights: ArrayLike, length_x: float, length_y: float) -> Waves:
    """Return the waves of a map of heights [m], shape (ny, nx), on a periodic rectangle of sides length_x and length_y
    [m].

    The mean is left out. Raises ValueError for a wave of two points per period, whose heights do not define a slope.
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
    """Return omega = kx vx + ky vy [rad/s], the frequency of a wave at a point of the body."""
    return np.asarray(kx * vx + ky * vy)


# from transfer moduli to pressure and friction


def pressure_amplitude(amplitude: ComplexValues, kx: Values, ky: Values, modulus: ComplexValues) -> ComplexArray:
    """Return 2 k A conj(M) [Pa]: amplitude and phase of each wave of pressure relative to the moving surface; `modulus`
    is the transfer modulus M."""
    return 2 * np.hypot(kx, ky) * amplitude * np.conj(modulus)


def traction(amplitude: ComplexValues, kx: Values, ky: Values, modulus: ComplexValues) -> Array:
    """Return <p grad h> = -sum k |A|^2 (kx, ky) Im M [Pa], shape (..., 2); the last axis of `modulus` (M) holds the
    waves."""
    strength = np.hypot(kx, ky) * np.abs(amplitude) ** 2 * np.imag(modulus)
    return -np.stack([np.sum(strength * kx, axis=-1), np.sum(strength * ky, axis=-1)], axis=-1)


# steady sliding


def friction_coefficient(
    mean_pressure: Values, amplitude: ComplexValues, kx: Values, ky: Values, vx: float, vy: float, *material: *Moduli
) -> Array:
    """Return mu = sum k |A|^2 omega G''(omega)/(|v| p0) of all waves in steady sliding at (vx, vy) [m/s], not 0."""
    modulus = complex_modulus(frequency(kx, ky, vx, vy), *material)
    return _friction(traction(amplitude, kx, ky, modulus), vx, vy, mean_pressure)


def _friction(traction: Array, vx: float, vy: float, mean_pressure: Values) -> Array:
    return np.asarray(-(traction @ np.array([vx, vy])) / (np.hypot(vx, vy) * mean_pressure))

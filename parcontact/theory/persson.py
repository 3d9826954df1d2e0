"""Persson's theory: contact area and friction of a rough surface that slides on a viscoelastic half-space.

Seen up to the wave number k, the pressure of a surface in full contact has the variance Var p(k), and with it spreads
out from its mean p0; what would be tension is not in contact. With the transfer modulus M of each wave as in
`full_contact` (G* in steady sliding, functions of time after a change of velocity) and <h^2> = int Phi d2q/(4 pi^2):

    Var p(k) = int_{|q| < k} Phi 4 q^2 |M|^2 d2q/(4 pi^2)
    A(k)/A0 = P(k) = erf(p0/sqrt(2 Var p(k)))
    mu = (1/p0) int Phi 2 |q| (q.v/|v|) Im M P(|q|) S(|q|) d2q/(4 pi^2),   S = gamma + (1 - gamma) P^2

Exact in full contact, where P = 1; else an approximation, whose empirical factor gamma (1: none) corrects the friction.

Source: B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840; for gamma M. Scaraggi and B. N. J. Persson, J. Phys.: Condens.
Matter 27 (2015) 105102; with time the paper "Transient frictionless contact of a rough rigid surface on a viscoelastic
half-space", Sec. 3.1. Integrals are sums over waves: those of a surface (`full_contact.waves`) or of a spectrum
(`spectral_waves`), with one entry per wave on the last axis; SI units.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from . import full_contact
from .arrays import Array, ComplexValues, Values
from .full_contact import Waves

GAMMA = 0.45
EQUAL = 1e-9  # wave numbers that differ by less than this share of the largest are equal


def spectral_waves(
    spectrum: Callable[[Array], Array], smallest: float, largest: float, rings: int = 1000, angles: int = 32
) -> Waves:
    """Waves that stand for an isotropic spectrum Phi(k) in m^4 between two wave numbers (rad/m).

    Rings by the midpoint rule in x, with k = smallest (largest/smallest)^(x^2): P falls like the root of x^2 from the
    first wave on where contact is small. Sums err by the square of the spacing. In each ring, Gauss points of the angle
    in two quadrants (the others are the opposite waves).
    """
    x, logarithm = (np.arange(rings)[:, None] + 0.5) / rings, np.log(largest / smallest)
    k = smallest * np.exp(logarithm * x**2)
    nodes, weights = np.polynomial.legendre.leggauss(angles)
    angle = np.pi / 4 * np.concatenate([nodes - 1, nodes + 1])
    area = 2 * x / rings * logarithm * k**2 * np.pi / 4 * np.tile(weights, 2)
    amplitude = np.sqrt(spectrum(k) * area) / np.pi  # |A|^2/2 is the mean square of a wave and of its opposite
    return Waves(amplitude.ravel().astype(complex), (k * np.cos(angle)).ravel(), (k * np.sin(angle)).ravel())


def contact_share(
    mean_pressure: Values, amplitude: ComplexValues, kx: Array, ky: Array, modulus: ComplexValues
) -> Array:
    """P(k) at each wave, shape of `modulus` (M): the area in contact over the nominal one when seen up to its k.

    Of the waves of the same k it takes half of the variance: with the rings of a spectrum the midpoint rule.
    """
    variance = np.abs(full_contact.pressure_amplitude(amplitude, kx, ky, modulus)) ** 2 / 2
    ring, order, starts = _rings(kx, ky)
    own = np.add.reduceat(variance[..., order], starts, axis=-1)
    return _share(mean_pressure, (np.cumsum(own, axis=-1) - own / 2)[..., ring])


def contact_area(
    mean_pressure: Values, amplitude: ComplexValues, kx: Array, ky: Array, modulus: ComplexValues
) -> Array:
    """A/A0, the area in contact over the nominal one, of all waves together."""
    return _share(mean_pressure, full_contact.pressure_variance(amplitude, kx, ky, modulus))


def friction_coefficient(
    mean_pressure: float,
    amplitude: ComplexValues,
    kx: Array,
    ky: Array,
    vx: float,
    vy: float,
    modulus: ComplexValues,
    gamma: float = GAMMA,
) -> Array:
    """mu of all waves together for sliding at (vx, vy) m/s, not 0; `modulus` is M, one per wave on its last axis."""
    share = contact_share(mean_pressure, amplitude, kx, ky, modulus)
    effective = np.abs(amplitude) * np.sqrt(share * (gamma + (1 - gamma) * share**2))
    traction = full_contact.traction(effective, kx, ky, modulus)
    return np.asarray(-(traction @ np.array([vx, vy])) / (np.hypot(vx, vy) * mean_pressure))


def _share(mean_pressure: Values, variance: Array) -> Array:
    deviation = np.sqrt(2 * variance)
    ratio = np.divide(mean_pressure, deviation, out=np.full_like(deviation, np.inf), where=deviation > 0)
    return np.asarray(erf(ratio))


def _rings(kx: Array, ky: Array) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """The ring of equal k of each wave, the waves in order of their rings, and where in it each ring starts."""
    k = np.hypot(kx, ky)
    order = np.argsort(k)
    new = np.diff(k[order], prepend=-np.inf) > EQUAL * k.max()
    ring = np.empty_like(order)
    ring[order] = np.cumsum(new) - 1
    return ring, order, np.flatnonzero(new)

"""Persson's theory: contact area and friction of a rough surface that slides on a viscoelastic half-space.

If waves up to the wavenumber k are included, the pressure in full contact has the variance Var p(k), and its
distribution spreads from its mean p0; points with tension are not in contact. With the transfer modulus M of each wave
as in `full_contact` (G* in steady sliding, functions of time in any other history) and <h^2> = int Phi d2q/(4 pi^2):

    Var p(k) = int_{|q| < k} Phi 4 q^2 |M|^2 d2q/(4 pi^2)
    A(k)/A0 = P(k) = erf(p0/sqrt(2 Var p(k)))
    <p grad h> = -int Phi 2 |q| q Im M P(|q|) S(|q|) d2q/(4 pi^2),   S = gamma + (1 - gamma) P^2
    mu = -<p grad h> . v/(|v| p0)

The theory is exact in full contact, where P = 1. Otherwise it is an approximation, whose empirical factor gamma (1:
none) corrects the friction.

Source: B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840; with time B. N. J. Persson and A. I. Volokitin, Phys. Rev. B
65 (2002) 134106; for gamma M. Scaraggi and B. N. J. Persson, J. Phys.: Condens. Matter 27 (2015) 105102, as in Sec. 3.1
of the paper "Transient frictionless contact of a rough rigid surface on a viscoelastic half-space". That paper prints
no formula of the theory. The steady form above is the published one; with time, M is taken from full contact, and P is
taken at the present time. A theory with P inside the integral over the past would differ in transients of partial
contact only.

Integrals are sums over waves in `persson_rings.Rings`; `modulus` (M, Pa) has one entry per wave on its last axis, and
`mean_pressure` (p0, Pa) the shape of the axes before; SI units."""

import numpy as np
from scipy.special import erf

from . import full_contact
from .full_contact import Array, ComplexValues, Values
from .persson_rings import Rings

GAMMA = 0.45  # physics: the empirical factor of the paper


def contact_share(mean_pressure: Values, rings: Rings, modulus: ComplexValues) -> Array:
    """Return P(k) at each ring: the area in contact over the nominal one with waves up to its k."""
    return _share(mean_pressure, rings.within(_variances(rings, modulus)))


def contact_area(mean_pressure: Values, rings: Rings, modulus: ComplexValues) -> Array:
    """Return A/A0, the area in contact over the nominal one, with all waves."""
    return _share(mean_pressure, _variances(rings, modulus).sum(axis=-1, keepdims=True))[..., 0]


def traction(mean_pressure: Values, rings: Rings, modulus: ComplexValues, gamma: float = GAMMA) -> Array:
    """Return <p grad h> [Pa], shape (..., 2): the tangential force on the surface per nominal area."""
    amplitude, kx, ky = rings.waves
    share = contact_share(mean_pressure, rings, modulus)
    weight = share * (gamma + (1 - gamma) * share**2)
    strength = np.hypot(kx, ky) * np.abs(amplitude) ** 2 * np.imag(rings.stiffness * modulus)
    return -np.stack([np.sum(weight * rings.sums(strength * q), axis=-1) for q in (kx, ky)], axis=-1)


def friction_coefficient(
    mean_pressure: Values, rings: Rings, vx: float, vy: float, modulus: ComplexValues, gamma: float = GAMMA
) -> Array:
    """Return mu with all waves for sliding at (vx, vy) [m/s], not 0."""
    along = traction(mean_pressure, rings, modulus, gamma) @ np.array([vx, vy])
    return np.asarray(-along / (np.hypot(vx, vy) * mean_pressure))


def _variances(rings: Rings, modulus: ComplexValues) -> Array:
    """Return the contribution of each ring to the variance of the pressure [Pa^2]."""
    return rings.sums(np.abs(rings.stiffness * full_contact.pressure_amplitude(*rings.waves, modulus)) ** 2 / 2)


def _share(mean_pressure: Values, variance: Array) -> Array:
    """Return the share in contact: 1 without roughness, 0 without load."""
    pressure = np.broadcast_to(np.asarray(mean_pressure, float)[..., None], variance.shape)
    rough = (variance > 0) | (pressure <= 0)
    ratio = np.divide(pressure, np.sqrt(2 * variance), out=np.where(rough, 0.0, np.inf), where=variance > 0)
    return np.asarray(erf(ratio))

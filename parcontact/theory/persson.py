"""Persson's theory: contact area and friction of a rough surface that slides on a viscoelastic half-space.

With waves up to the wavenumber k only, the pressure in full contact would have the variance Var p(k) over the surface.
Around its mean p0 the distribution of the pressure broadens as k grows, and points with tension are not in contact.
With the transfer modulus M of each wave as in `wavy` (G* in steady sliding, functions of time in any other history) and
<h^2> = int Phi d2q/(4 pi^2):

    Var p(k) = int_{|q| < k} Phi 4 q^2 |M|^2 d2q/(4 pi^2)
    A(k)/A0 = P(k) = erf(p0/sqrt(2 Var p(k)))
    <p grad h> = -int Phi 2 |q| q Im M P(|q|) S(|q|) d2q/(4 pi^2),   S = gamma + (1 - gamma) P^2
    mu = -<p grad h> . v/(|v| p0)

The theory is exact in full contact, where P = 1. Otherwise it is an approximation, in which an empirical factor gamma
corrects the friction (1: no correction).

Source: for steady sliding B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840; for histories B. N. J. Persson and A. I.
Volokitin, Phys. Rev. B 65 (2002) 134106; for gamma M. Scaraggi and B. N. J. Persson, J. Phys.: Condens. Matter 27
(2015) 105102. Sec. 3.1 of the paper "Transient frictionless contact of a rough rigid surface on a viscoelastic
half-space" uses the theory, but does not print its formulas. Steady sliding is computed here as published. In
transients, this module takes M from full contact and P at the present time. A theory could also weight the past motion,
on which M depends, with the P of that time. Such a theory would differ only in transients of partial contact.

Integrals are sums over waves in `Rings`. The argument `modulus` (M, Pa) has one entry per wave on its last axis, and
`mean_pressure` (p0, Pa) has the shape of the other axes. All are in SI units.

Rings hold waves of equal wavenumber, of a spectrum or of a given surface. An isotropic spectrum is integrated by
Gauss's rule on panels of x, with k = smallest (largest/smallest)^(x^2). At small areas the share in contact falls like
the root of log(k/smallest), and this root is a smooth function of x. Partial sums within a ring follow from the
polynomial through the points of its panel, so that sums and partial sums have the same errors.

Histories have piecewise constant velocities: rest, starts, stops, reversals, changes of load. In the transfer modulus M
of a wave (see `wavy`) every term of the relaxation function has a memory m_j of how the wave has moved past a point of
the body. For constant omega = q . v and a memory m_j(0) at t = 0,

    M(t) = G_inf + sum_j G_j m_j(t)
    m_j(t) = b_j + (m_j(0) - b_j) exp(-t/tau_j - i omega t),    b_j = i omega tau_j/(1 + i omega tau_j)

exactly, for any t. At first contact a body has m_j = 1 (its instantaneous modulus), in steady sliding m_j = b_j.
Contact area and friction follow from M and the load at each instant.

The theory assumes that the body follows each wave of the surface from first contact on, as in full contact. A load
p0(t) that changes or vanishes only changes the share in contact.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from ..physics.prony import Prony, normal_form
from . import wavy
from .wavy import Array, ComplexArray, ComplexValues, Values, Waves

GAMMA = 0.45  # physics: the empirical factor of the paper
EQUAL = 1e-9  # accuracy: difference of equal wavenumbers over the largest
PANEL_POINTS = 10  # accuracy: points of Gauss's rule
HALVINGS = 14  # accuracy: halvings of panels towards the longest wave
PANEL_LOGARITHM = 1.0  # accuracy: largest logarithm of the ratio of wavenumbers at the ends of a panel
PANEL_PHASE = 12.0  # accuracy: largest difference of phases at the ends of a panel [rad]
MAX_PHASE = 400.0  # accuracy: largest phase of the shortest wave [rad]; the error of sums is 4e-5
QUADRANT_ANGLES = 24  # accuracy: number of angles without phases
ANGLES_STEP = 8  # accuracy: step in the number of angles
CHUNK = 1_000_000  # tuning: transfer moduli per chunk, of 16 bytes; about ten arrays of this size are needed


@dataclass(frozen=True)
class Rings:
    """Waves of a surface in rings of equal wavenumber, in the order of rising wavenumbers. `starts` has the index of
    the first wave of each ring.

    Each panel has n rings, and `share` has the shape (n, n): sums up to the wavenumber of ring i of a panel contain the
    part `share[i, j]` of the sum over ring j of the panel. `stiffness` is the ratio of the body's stiffness to that of
    a half space for each wave.
    """

    waves: Waves
    starts: NDArray[np.intp]
    share: Array
    stiffness: NDArray[np.floating] | float = 1.0

    def scaled(self, factor: float) -> "Rings":
        """Return the rings of the surface with heights multiplied by a factor."""
        amplitude, kx, ky = self.waves
        return replace(self, waves=Waves(factor * amplitude, kx, ky))

    def sums(self, values: Array) -> Array:
        """Return values of waves, shape (..., waves), summed over each ring: shape (..., rings)."""
        return np.asarray(np.add.reduceat(values, self.starts, axis=-1))

    def within(self, own: Array) -> Array:
        """Return sums up to the wavenumber of each ring, shape (..., rings). `own` has the sum over each ring alone, in
        the same shape."""
        panels = own.reshape(*own.shape[:-1], -1, len(self.share))
        totals = panels.sum(axis=-1)
        before = np.cumsum(totals, axis=-1) - totals
        return np.asarray((before[..., None] + panels @ self.share.T).reshape(own.shape))


def rings_of_surface(waves: Waves) -> Rings:
    """Return the rings of given waves (`wavy.waves`). A sum up to the wavenumber of a ring contains half of the sum
    over this ring."""
    k = np.hypot(waves.kx, waves.ky)
    order = np.argsort(k)
    starts = np.flatnonzero(np.diff(k[order], prepend=-np.inf) > EQUAL * k.max(initial=0.0))
    amplitude, kx, ky = waves
    return Rings(Waves(amplitude[order], kx[order], ky[order]), starts, np.array([[0.5]]))


def rings_of_spectrum(
    spectrum: Callable[[Array], Array],
    smallest: float,
    largest: float,
    distance: float = 0.0,
    kinks: Sequence[float] = (),
    refinement: int = 1,
    line: bool = False,
) -> Rings:
    """Return waves that represent an isotropic spectrum Phi(k) [m^4] between two wavenumbers [rad/m], or the spectrum
    [m^3] of a profile along x if `line` is True (`bands.choice.WaveSpectrum.moment` has the norm of both).

    `distance` [m] is the largest distance between two positions of the surface while the body remembers both. Panels
    and angles are so fine that neighbouring waves stay in phase over this distance, but at most over the distance at
    which the shortest wave has the phase MAX_PHASE. `kinks` [rad/m] are wavenumbers where Phi is not smooth. Panels and
    angles are divided by `refinement`, to test the error of the sums.
    """
    logarithm = np.log(largest / smallest)
    nodes, weights = np.polynomial.legendre.leggauss(PANEL_POINTS)
    distance = min(distance, MAX_PHASE / largest)
    edges = _edges(smallest, logarithm, distance, kinks, refinement)
    half = np.diff(edges)[:, None] / 2
    x = (edges[:-1, None] + half * (1 + nodes)).ravel()
    k = smallest * np.exp(logarithm * x**2)
    areas = 2 * x * logarithm * k**2 * (half * weights).ravel()  # k dk
    if line:
        amplitude = np.sqrt(spectrum(k) * areas / k / np.pi)
        return Rings(Waves(amplitude.astype(complex), k, 0.0 * k), np.arange(k.size), _partial_shares(nodes, weights))
    angles = refinement * QUADRANT_ANGLES + ANGLES_STEP * np.ceil(k * distance / 2 / ANGLES_STEP).astype(int)
    unit = map(_two_quadrants, angles)  # Gauss points of two quadrants
    parts = [(q * x, q * y, area * share) for q, area, (x, y, share) in zip(k, areas, unit, strict=True)]
    kx, ky, area = (np.concatenate(part) for part in zip(*parts, strict=True))
    amplitude = np.sqrt(spectrum(np.hypot(kx, ky)) * area) / np.pi  # |A|^2/2: mean square of a wave and its opposite
    starts = np.cumsum([0, *(part[0].size for part in parts[:-1])])
    return Rings(Waves(amplitude.astype(complex), kx, ky), starts, _partial_shares(nodes, weights))


def _edges(smallest: float, logarithm: float, distance: float, kinks: Sequence[float], refinement: int) -> Array:
    """Return the ends of panels in x: halving towards 0, at the kinks, and as close as phases and powers of
    k require."""
    inner = [np.sqrt(np.log(kink / smallest) / logarithm) for kink in kinks if 0 < np.log(kink / smallest) < logarithm]
    coarse = np.unique([0.0, *(0.5 ** np.arange(HALVINGS)), *inner])
    phase = np.diff(distance * smallest * np.exp(logarithm * coarse**2)) / PANEL_PHASE
    powers = np.diff(logarithm * coarse**2) / PANEL_LOGARITHM
    counts = refinement * np.maximum(1, np.ceil(np.maximum(phase, powers))).astype(int)
    panels = zip(coarse, coarse[1:], counts, strict=False)
    return np.concatenate([*(np.linspace(a, b, count, endpoint=False) for a, b, count in panels), [1.0]])


@cache
def _two_quadrants(count: int) -> tuple[Array, Array, Array]:
    """Return cosines and sines of angles in two quadrants, and the area of each over k dk; shapes (2 count,)."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    angle = np.pi / 4 * np.concatenate([nodes - 1, nodes + 1])
    return np.cos(angle), np.sin(angle), np.pi / 4 * np.tile(weights, 2)


def _partial_shares(nodes: Array, weights: Array) -> Array:
    """Return weights of the integrals over a panel from its start to each of its points; shape (points, points)."""
    legendre = np.polynomial.legendre
    coefficients = np.linalg.inv(legendre.legvander(nodes, nodes.size - 1))  # of the polynomials that are 1 at a point
    return np.asarray(legendre.legval(nodes, legendre.legint(coefficients, lbnd=-1)).T / weights)


def contact_share(mean_pressure: Values, rings: Rings, modulus: ComplexValues) -> Array:
    """Return P(k) at the wavenumber of each ring, shape (..., rings): the area in contact divided by the nominal area,
    with waves up to this wavenumber."""
    return _share(mean_pressure, rings.within(_variances(rings, modulus)))


def contact_area(mean_pressure: Values, rings: Rings, modulus: ComplexValues) -> Array:
    """Return A/A0, the area in contact divided by the nominal area, with all waves."""
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
    """Return the friction coefficient mu of the surface with all its waves. The surface slides at the velocity (vx, vy)
    [m/s], which must not be 0."""
    along = traction(mean_pressure, rings, modulus, gamma) @ np.array([vx, vy])
    return np.asarray(-along / (np.hypot(vx, vy) * mean_pressure))


def _variances(rings: Rings, modulus: ComplexValues) -> Array:
    """Return the contribution of each ring to the variance of the pressure [Pa^2]."""
    return rings.sums(np.abs(rings.stiffness * wavy.pressure_amplitude(*rings.waves, modulus)) ** 2 / 2)


def _share(mean_pressure: Values, variance: Array) -> Array:
    """Return the share in contact: 1 without roughness, 0 without load."""
    pressure = np.broadcast_to(np.asarray(mean_pressure, float)[..., None], variance.shape)
    rough = (variance > 0) | (pressure <= 0)
    ratio = np.divide(pressure, np.sqrt(2 * variance), out=np.where(rough, 0.0, np.inf), where=variance > 0)
    return np.asarray(erf(ratio))


class SlidingLeg(NamedTuple):
    """A part of a history at constant velocity [m/s]: its duration [s], instants since its start [s], and p0 [Pa] at
    these instants."""

    velocity: tuple[float, float]
    duration: float
    instants: Array
    pressures: Array


class TheoryOutcome(NamedTuple):
    """Predictions at the instants of a leg: traction <p grad h> [Pa], shape (instants, 2), and contact area A/A0, shape
    (instants,)."""

    traction: Array
    contact_area: Array

    def friction(self, pressures: Array) -> Array:
        """Return the magnitude of the tangential force divided by the normal force, under the mean `pressures` [Pa] at
        the instants; 0 without load."""
        size = np.hypot(*self.traction.T)
        return np.divide(size, pressures, out=np.zeros_like(size), where=pressures > 0)


class Memory:
    """Memory m_j of the body for each wave, shape (waves, terms)."""

    def __init__(self, rings: Rings, material: Prony) -> None:
        """Start with the memory of a body at first contact."""
        self.rings = rings
        self.spring, self.terms, self.times = normal_form(*material)
        self.shares = np.ones((rings.waves.kx.size, self.times.size), complex)

    def slide_for_ever(self, velocity: tuple[float, float]) -> None:
        """Set the memory to its values in steady sliding at a velocity [m/s]."""
        self.shares = self._steady(self._frequency(velocity))

    def moduli(self, velocity: tuple[float, float], instants: Array) -> ComplexArray:
        """Return M [Pa] at instants [s] of sliding at a velocity, shape (instants, waves). The memory stays as it
        is."""
        omega = self._frequency(velocity)
        steady = self._steady(omega)
        fading = np.exp(-instants[:, None] / self.times) @ (self.terms * (self.shares - steady)).T
        if np.any(omega):
            fading *= np.exp(-1j * instants[:, None] * omega)
        return np.asarray(self.spring + steady @ self.terms + fading)

    def slide(self, velocity: tuple[float, float], duration: float) -> None:
        """Advance the memory by sliding for a duration [s]."""
        omega = self._frequency(velocity)[:, None]
        steady = self._steady(omega[:, 0])
        self.shares = steady + (self.shares - steady) * np.exp(-duration / self.times - 1j * duration * omega)

    def _frequency(self, velocity: tuple[float, float]) -> Array:
        return wavy.frequency(self.rings.waves.kx, self.rings.waves.ky, *velocity)

    def _steady(self, omega: Array) -> ComplexArray:
        phase = 1j * omega[:, None] * self.times
        return np.asarray(phase / (1 + phase))


def follow(memory: Memory, legs: Iterable[SlidingLeg], gamma: float = GAMMA) -> Iterator[TheoryOutcome]:
    """Yield the predictions for each of the `legs` of a history, one after the other. Each leg advances the `memory` to
    its end."""
    for leg in legs:
        count = max(1, CHUNK // max(1, len(memory.shares)))
        starts = range(0, max(1, leg.instants.size), count)
        parts = [_observe(memory, leg, slice(start, start + count), gamma) for start in starts]
        yield TheoryOutcome(*(np.concatenate(part) for part in zip(*parts, strict=True)))
        memory.slide(leg.velocity, leg.duration)


def _observe(memory: Memory, leg: SlidingLeg, chosen: slice, gamma: float) -> TheoryOutcome:
    modulus, pressures = memory.moduli(leg.velocity, leg.instants[chosen]), leg.pressures[chosen]
    force = traction(pressures, memory.rings, modulus, gamma)
    return TheoryOutcome(force, contact_area(pressures, memory.rings, modulus))

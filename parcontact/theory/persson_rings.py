"""Waves in rings of equal wavenumber: the sums over k of Persson's theory, for a spectrum or for a given surface.

An isotropic spectrum is integrated by Gauss's rule on panels of x, with k = smallest (largest/smallest)^(x^2): the
share in contact falls like the root of log(k/smallest) at small areas, which is smooth in x. Partial sums within a
ring follow from the polynomial through the points of its panel, so that sums and partial sums have the same errors."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from .full_contact import Array, Waves

EQUAL = 1e-9  # accuracy: difference of equal wavenumbers over the largest
PANEL_POINTS = 10  # accuracy: points of Gauss's rule
HALVINGS = 14  # accuracy: halvings of panels towards the longest wave
PANEL_LOGARITHM = 1.0  # accuracy: largest logarithm of the ratio of wavenumbers at the ends of a panel
PANEL_PHASE = 12.0  # accuracy: largest difference of phases at the ends of a panel [rad]
MAX_PHASE = 400.0  # accuracy: largest phase of the shortest wave [rad]; the error of sums is 4e-5
QUADRANT_ANGLES = 24  # accuracy: number of angles without phases
ANGLES_STEP = 8  # accuracy: step in the number of angles


@dataclass(frozen=True)
class Rings:
    """Waves by rings, from the longest on; `starts` is the first wave of each ring.

    `share`, shape (n, n), has for each ring of a panel of n the share of each ring of the panel that lies within it.
    `stiffness` is that of the body over that of a half space for each wave, as of a layer.
    """

    waves: Waves
    starts: NDArray[np.intp]
    share: Array
    stiffness: NDArray[np.floating] | float = 1.0

    def scaled(self, factor: float) -> "Rings":
        """Return the surface with heights multiplied by a factor."""
        amplitude, kx, ky = self.waves
        return replace(self, waves=Waves(factor * amplitude, kx, ky))

    def sums(self, values: Array) -> Array:
        """Return values of waves, shape (..., waves), summed over each ring: shape (..., rings)."""
        return np.asarray(np.add.reduceat(values, self.starts, axis=-1))

    def within(self, own: Array) -> Array:
        """Return sums up to the k of each ring, from the sums of the rings; both of shape (..., rings)."""
        panels = own.reshape(*own.shape[:-1], -1, len(self.share))
        totals = panels.sum(axis=-1)
        before = np.cumsum(totals, axis=-1) - totals
        return np.asarray((before[..., None] + panels @ self.share.T).reshape(own.shape))


def rings_of_surface(waves: Waves) -> Rings:
    """Return the rings of given waves (`full_contact.waves`). Half of the sum of a ring counts as within it."""
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
) -> Rings:
    """Return waves that represent an isotropic spectrum Phi(k) [m^4] between two wavenumbers [rad/m].

    `distance` [m] is the largest displacement that the body remembers: neighbouring waves of the sums must stay in
    phase, up to MAX_PHASE. `kinks` [rad/m] are wavenumbers where Phi is not smooth. Panels and angles are divided by
    `refinement`, to test the error of the sums.
    """
    logarithm = np.log(largest / smallest)
    nodes, weights = np.polynomial.legendre.leggauss(PANEL_POINTS)
    distance = min(distance, MAX_PHASE / largest)
    edges = _edges(smallest, logarithm, distance, kinks, refinement)
    half = np.diff(edges)[:, None] / 2
    x = (edges[:-1, None] + half * (1 + nodes)).ravel()
    k = smallest * np.exp(logarithm * x**2)
    areas = 2 * x * logarithm * k**2 * (half * weights).ravel()  # k dk
    angles = refinement * QUADRANT_ANGLES + ANGLES_STEP * np.ceil(k * distance / 2 / ANGLES_STEP).astype(int)
    parts = [_ring(*ring) for ring in zip(k, areas, angles, strict=True)]
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


def _ring(k: float, area: float, angles: int) -> tuple[Array, Array, Array]:
    """Return kx, ky and the area in the plane of wave vectors of each wave of a ring: Gauss points of two quadrants."""
    cosines, sines, weights = _two_quadrants(angles)
    return k * cosines, k * sines, area * weights


@cache
def _two_quadrants(count: int) -> tuple[Array, Array, Array]:
    nodes, weights = np.polynomial.legendre.leggauss(count)
    angle = np.pi / 4 * np.concatenate([nodes - 1, nodes + 1])
    return np.cos(angle), np.sin(angle), np.pi / 4 * np.tile(weights, 2)


def _partial_shares(nodes: Array, weights: Array) -> Array:
    """Return weights of the integrals over a panel from its start to each of its points; shape (points, points)."""
    legendre = np.polynomial.legendre
    coefficients = np.linalg.inv(legendre.legvander(nodes, nodes.size - 1))  # of the polynomials that are 1 at a point
    return np.asarray(legendre.legval(nodes, legendre.legint(coefficients, lbnd=-1)).T / weights)

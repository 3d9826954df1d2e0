"""Waves in rings of equal wave number: the sums over k of Persson's theory, for a spectrum or for a given surface.

An isotropic spectrum is integrated by Gauss' rule on panels of x, with k = smallest (largest/smallest)^(x^2): the share
of the surface in contact falls like the root of log(k/smallest) where contact is small, which is smooth in x. What lies
within a ring follows from the polynomial through the points of its panel, so that sums and partial sums err alike.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from .arrays import Array
from .full_contact import Waves

EQUAL = 1e-9  # accuracy: wave numbers that differ by less than this share of the largest are equal
PANEL_POINTS = 10  # accuracy: of Gauss' rule
HALVINGS = 14  # accuracy: of panels towards the longest wave
PANEL_LOGARITHM = 1.0  # accuracy: of the wave numbers at the ends of a panel: at most this far apart
PANEL_PHASE = 12.0  # accuracy: rad by which the phases of waves at the ends of a panel may differ
MAX_PHASE = 400.0  # accuracy: rad by which the shortest wave may move (64 000 waves); then sums err by 4e-5
QUADRANT_ANGLES = 24  # accuracy: of waves whose phases all agree
ANGLES_STEP = 8  # accuracy: more of them come by so many


@dataclass(frozen=True)
class Rings:
    """Waves ring by ring, from the longest on; `starts` is the first wave of each ring.

    `share`, shape (n, n), says what is within each ring of a panel of n: that share of each ring of the panel.
    `stiffness` is by what factor the body is stiffer than a half space for each wave, as a layer is.
    """

    waves: Waves
    starts: NDArray[np.intp]
    share: Array
    stiffness: NDArray[np.floating] | float = 1.0

    def scaled(self, factor: float) -> "Rings":
        """The same surface with heights that are larger by a factor."""
        amplitude, kx, ky = self.waves
        return replace(self, waves=Waves(factor * amplitude, kx, ky))

    def sums(self, values: Array) -> Array:
        """Values of waves, shape (..., waves), summed over each ring: shape (..., rings)."""
        return np.asarray(np.add.reduceat(values, self.starts, axis=-1))

    def within(self, own: Array) -> Array:
        """Sums up to the k of each ring, from the sums of the rings themselves; both of shape (..., rings)."""
        panels = own.reshape(*own.shape[:-1], -1, len(self.share))
        totals = panels.sum(axis=-1)
        before = np.cumsum(totals, axis=-1) - totals
        return np.asarray((before[..., None] + panels @ self.share.T).reshape(own.shape))


def rings_of_surface(waves: Waves) -> Rings:
    """The rings of given waves (`full_contact.waves`). Of a ring's own sum one half counts as within it."""
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
    """Waves that stand for an isotropic spectrum Phi(k) in m^4 between two wave numbers (rad/m).

    `distance` (m) is how far the surface will be moved while the body remembers where it was: neighbouring waves of the
    sums must not go out of phase, as far as MAX_PHASE. `kinks` (rad/m) are wave numbers where Phi is not smooth. Each
    panel is divided into `refinement` ones, each angle into as many, to see what the sums err by.
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
    """Ends of panels in x: halving towards 0, at the kinks, and as close as phases and powers of k demand."""
    inner = [np.sqrt(np.log(kink / smallest) / logarithm) for kink in kinks if 0 < np.log(kink / smallest) < logarithm]
    coarse = np.unique([0.0, *(0.5 ** np.arange(HALVINGS)), *inner])
    phase = np.diff(distance * smallest * np.exp(logarithm * coarse**2)) / PANEL_PHASE
    powers = np.diff(logarithm * coarse**2) / PANEL_LOGARITHM
    counts = refinement * np.maximum(1, np.ceil(np.maximum(phase, powers))).astype(int)
    panels = zip(coarse, coarse[1:], counts, strict=False)
    return np.concatenate([*(np.linspace(a, b, count, endpoint=False) for a, b, count in panels), [1.0]])


def _ring(k: float, area: float, angles: int) -> tuple[Array, Array, Array]:
    """kx, ky and the area in the plane of wave vectors of each wave of a ring: Gauss' points of two quadrants."""
    cosines, sines, weights = _two_quadrants(angles)
    return k * cosines, k * sines, area * weights


@cache
def _two_quadrants(count: int) -> tuple[Array, Array, Array]:
    nodes, weights = np.polynomial.legendre.leggauss(count)
    angle = np.pi / 4 * np.concatenate([nodes - 1, nodes + 1])
    return np.cos(angle), np.sin(angle), np.pi / 4 * np.tile(weights, 2)


def _partial_shares(nodes: Array, weights: Array) -> Array:
    """Weights of the integrals over a panel from its start to each of its points; shape (points, points)."""
    legendre = np.polynomial.legendre
    coefficients = np.linalg.inv(legendre.legvander(nodes, nodes.size - 1))  # of the polynomials that are 1 at a point
    return np.asarray(legendre.legval(nodes, legendre.legint(coefficients, lbnd=-1)).T / weights)

"""Temperatures of bands: the rise in each band by its own heat and by that of all others.

Heat of a band lies where its waves strain the rubber, and is distributed over the contact in proportion to the
pressure. With waves cos(m z) along the depth, in which the heat of band i and the temperature of band k have the
shares g_i(m) and g_k(m) of `effects.heat.heat`, 1 on the surface, the rise of band k is

    T_k = sum_i h_i 2/pi int g_i g_k (S(m) + sum_(j <= i, k) S_j(m)) dm,

with the heat h_i [W/m^2] of band i, the uniform part `S = (1 - exp(-m^2 D t))/(kappa m^2)` after the sliding time t,
and for the waves of the pressure of band j, of power P(q) relative to the square of its mean,

    S_j(m) = sum_q P(q) Re (1 - exp(-(beta^2 + m^2) D t))/(beta^2 + m^2)/kappa.

Waves of band j modulate only bands as fine as j or finer. Heat of the interface is on the surface and the finest.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...parallel.slab import Array
from ...physics.convolution import travelling_wavenumbers, wavenumbers
from ...scene import Setup
from .effect import Thermal
from .flash import Flash
from .heat import Conductor, depths_of

Vector = tuple[float, float]
SPACING, LOWEST, HIGHEST = 0.3, 1e-4, 30.0  # accuracy: spacing of ln m; limits of m over wavenumbers of bands


def waves_along_depth(low: float, high: float) -> tuple[Array, Array]:
    """Return waves m [1/m] for bands between two wavenumbers [1/m], and their weights in `2/pi int ... dm`."""
    ends = np.log(LOWEST * low), np.log(HIGHEST * high)
    m = np.exp(np.linspace(*ends, 2 + int((ends[1] - ends[0]) / SPACING)))
    step = float(np.log(m[1] / m[0]))
    weights = 2.0 / np.pi * step * m
    weights[0] /= 1.0 - np.exp(-step)  # includes all waves below
    return m, weights


def uniform(body: Conductor, m: Array, time: float) -> Array:
    """Return S(m) [K m^2/W 1/m] after a time [s]."""
    return np.asarray(-np.expm1(-(m**2) * body.diffusivity * time) / m**2 / body.conductivity)


@dataclass(frozen=True)
class Warming:
    """S_j(m) of one band for each wave of its half spectrum, shape (m, waves), with the multiplicity of these."""

    symbols: Array

    def apply(self, setup: Setup, pressure: Array) -> Array:
        """Return S_j(m), shape (m,), for a map of pressure."""
        spectrum, total = setup.fft.forward(pressure), float(pressure.sum())
        return np.asarray(self.symbols @ ((spectrum.real**2 + spectrum.imag**2) / total**2).ravel())


def warming_of(setup: Setup, section: Thermal, time: float, velocity: Vector, m: Array) -> Warming:
    """Return S_j of a band that slides at `velocity` [m/s], after sliding for a `time` [s]."""
    fft, size, body = setup.fft, setup.grid.size, section.conductor
    q = np.hypot(*wavenumbers(fft, size))
    along_x, along_y = travelling_wavenumbers(fft, size)
    square = (q**2 - 1j * (along_x * velocity[0] + along_y * velocity[1]) / body.diffusivity).ravel()
    counts = (fft.multiplicity * np.where(q > 0.0, 1.0, 0.0)).ravel()
    reach, found = body.diffusivity * time, np.empty((m.size, square.size))
    for row, one in zip(found, m, strict=True):
        whole = np.where(counts > 0.0, square, 1.0) + one**2
        row[:] = counts * np.real(-np.expm1(-whole * reach) / whole) / body.conductivity
    return Warming(found)


def shares_of_depth(setup: Setup, pressure: Array, velocity: Vector, m: Array) -> Array:
    """Return the shares g(m) of the depths of the heat of a band, under this map of pressure."""
    depths = depths_of(
        setup.fft.forward(pressure), setup.fft, setup.half_space, setup.units.length, velocity, setup.prony
    )
    return depths.cosines(m) if depths.wavenumbers.size else np.ones_like(m)


def rises_of(
    weights: Array,
    uniform: Array,
    shares: Sequence[Array],
    warmings: Sequence[Array],
    heats: Sequence[float],
    rubbed: float,
) -> list[float]:
    """Return the rise [K] of each band, from the coarsest, from the weights of m, S, and g, S_j and the heat [W/m^2] of
    each band; `rubbed` is the heat of the interface."""
    sums = uniform + np.cumsum(warmings, axis=0)  # S and all S_j down to a band
    sources = [*zip(shares, heats, strict=True), (np.ones_like(weights), rubbed)]
    return [
        float(sum(heat * np.sum(weights * own * felt * sums[min(i, k)]) for i, (own, heat) in enumerate(sources)))
        for k, felt in enumerate(shares)
    ]


def flash_of_bands(rises: Sequence[float], heats: Sequence[float]) -> Flash:
    """Return the temperatures of a contact in bands: the mean over the heat, the highest of a band, and quartiles."""
    order = np.argsort(rises)
    values, weights = np.asarray(rises)[order], np.asarray(heats)[order]
    whole = float(weights.sum())
    if not whole > 0.0:
        return Flash()
    shares = (np.cumsum(weights) - 0.5 * weights) / whole
    lower, upper = np.interp([0.25, 0.75], shares, values)
    return Flash(float(values @ weights) / whole, float(values[-1]), float(lower), float(upper))

"""Temperatures of bands: what each feels of its own heat and of that of all others.

Heat of a band lies where its waves strain the rubber (`physics.heat`), and is spread over the contact in proportion to
the pressure. The rise that it makes has one part for each scale, the waves of the pressure of one band, and a uniform
one that couples all depths. Seen from band j, heat of finer bands is on the surface, and finer bands feel the surface:

    T_k = sum_i U_ik h_i + A_k h_k + C_k h_(>k) + sum_(j<k) (C_j h_j + D_j h_(>j)),

with the heat h_i [W/m^2] of band i, h_(>j) that of all finer bands and of the interface, and for the waves of one band
A: from the depths where its heat lies to the same depths, C: from there to the surface or back, D: on the surface;
U_ik: the uniform rise in the depths of band k by heat in those of band i, after the time of sliding.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..effects.thermal import Thermal
from ..parallel.slab import Array
from ..physics.flash import Flash
from ..physics.heat import Conductor, depths_of, sliding_heat
from ..scene import Setup

Vector = tuple[float, float]
DEEPEST, SHALLOWEST, POINTS = 1e-5, 30.0, 400  # accuracy: of waves along the depth, over wavenumbers of bands


@dataclass(frozen=True)
class Warming:
    """Rises by the waves of one band: `symbols` [K m^2/W] of A, C and D on a half spectrum, with the multiplicity of
    its waves, and the wavenumber [1/m] of the `depth` where its heat lies."""

    symbols: Sequence[Array]
    depth: float

    def of(self, setup: Setup, pressure: Array) -> Array:
        """Return A, C and D [K m^2/W] for a map of pressure, in the mean over its heat."""
        spectrum, mean = setup.fft.forward(pressure), float(pressure.mean()) * pressure.size
        power = (spectrum.real**2 + spectrum.imag**2) / mean**2
        return np.array([float(np.sum(power * symbol)) for symbol in self.symbols])


def warming_of(setup: Setup, section: Thermal, time: float, pressure: Array, velocity: Vector) -> Warming:
    """Return the rises by waves of a band that slides at `velocity` [m/s], after a `time` [s] of sliding; its heat lies
    where it does under this map of pressure."""
    fft, size = setup.fft, setup.grid.size
    depths = depths_of(fft.forward(pressure), fft, setup.half_space, setup.units.length, velocity, setup.prony)
    place = fft, size, section.conductor, velocity
    made = (
        sliding_heat(*place, depths, felt=True, time=time),
        sliding_heat(*place, depths, time=time),
        sliding_heat(*place, time=time),
    )
    weights = fft.multiplicity * np.ones(fft.shape)
    weights[0, 0] = 0.0  # the uniform rise couples all bands
    found = []
    for operator in made:
        symbol = fft.mx * fft.my * np.concatenate(operator.symbols, axis=1).real
        rows = np.abs(fft.modes[1][:, 0]) if operator.even else slice(None)
        found.append(weights * symbol[rows])
    shares = depths.shares.sum()
    depth = float(np.sum(depths.shares / depths.wavenumbers)) if shares > 0.0 else 0.0
    return Warming(found, 1.0 / depth if depth > 0.0 else math.inf)


def uniform_rise(body: Conductor, one: float, other: float, time: float) -> float:
    """Return the rise [K m^2/W] in the depths of one wavenumber [1/m] by a uniform heat in those of the other, after a
    time [s]: `2/(pi kappa) int g_1 g_2 (1 - exp(-m^2 D t))/m^2 dm`; infinite wavenumbers are the surface."""
    reach = body.diffusivity * time
    ends = [q for q in (one, other, 1.0 / math.sqrt(reach)) if q < math.inf]
    m = np.geomspace(DEEPEST * min(ends), SHALLOWEST * max(ends), POINTS)
    shares = [np.real((1.0 - 0.5j * m / q) ** -3) if q < math.inf else np.ones_like(m) for q in (one, other)]
    value = shares[0] * shares[1] * -np.expm1(-(m**2) * reach) / m**2
    beyond = 1.0 / m[-1] if one == other == math.inf else 0.0
    return float(2.0 / np.pi / body.conductivity * (np.trapezoid(value, m) + m[0] * reach + beyond))


def rises_of(
    slid: tuple[Conductor, float],
    depths: Sequence[float],
    warmings: Sequence[Array],
    heats: Sequence[float],
    rubbed: float,
) -> list[float]:
    """Return the rise [K] of each band, from the coarsest: of a body that has slid for a time [s], by the wavenumber
    [1/m] of its depth, its A, C and D, the heat [W/m^2] of each, and that of the interface."""
    body, time = slid
    finer = [sum(heats[k + 1 :]) + rubbed for k in range(len(heats))]
    found = []
    for k, depth in enumerate(depths):
        rise = sum(uniform_rise(body, own, depth, time) * heat for own, heat in zip(depths, heats, strict=True))
        rise += uniform_rise(body, math.inf, depth, time) * rubbed
        rise += warmings[k][0] * heats[k] + warmings[k][1] * finer[k]
        rise += sum(warmings[j][1] * heats[j] + warmings[j][2] * finer[j] for j in range(k))
        found.append(float(rise))
    return found


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

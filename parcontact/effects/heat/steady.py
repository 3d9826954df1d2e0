"""Temperatures of steady sliding: the map below the contact, and the one temperature of the rubber that follows.

The map is exact for its heat (`heat`, `flash`). With feedback all rubber relaxes as at the flash
temperature, `T = T_0 + F(T)`: a fixed point, found by secants within a bracket. Each round is a steady state.

Temperatures of bands: the rise in each band by its own heat and by that of all others.

Heat of a band lies where its waves strain the rubber, and is distributed over the contact in proportion to the
pressure. With waves cos(m z) along the depth, in which the heat of band i and the temperature of band k have the
shares g_i(m) and g_k(m) of `effects.heat.solver`, 1 on the surface, the rise of band k is

    T_k = sum_i h_i 2/pi int g_i g_k (S(m) + sum_(j <= i, k) S_j(m)) dm,

with the heat h_i [W/m^2] of band i, the uniform part `S = (1 - exp(-m^2 D t))/(kappa m^2)` after the sliding time t,
and for the waves of the pressure of band j, of power P(q) relative to the square of its mean,

    S_j(m) = sum_q P(q) Re (1 - exp(-(beta^2 + m^2) D t))/(beta^2 + m^2)/kappa.

Waves of band j modulate only bands as fine as j or finer. Heat of the interface is on the surface and the finest.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...contact.constraint import Mask
from ...doubts import Doubt
from ...errors import UnsolvedError
from ...job import Job, Zener
from ...march.point import Point
from ...march.scene import Setup
from ...parallel.slab import Array
from ...physics.convolution import travelling_wavenumbers, wavenumbers
from ...physics.measures import Measures
from ..relaxation import feeds_back, temperature_of
from .effect import Thermal
from .solver import Conductor, Flash, depths_of, flash_of, share_of, sliding_heat, sliding_heat_unbounded, spread_over

MOST_ROUNDS = 10  # tuning: limit on the rounds of the fixed point
LEAST_ERROR = 0.02  # accuracy: least error of the flash temperature [K]
FINEST, COARSEST = 1e-3, 3e-2  # accuracy: limits on its relative error
HOTTEST = 200.0  # physics: rise of the temperature [K] above which rubber decomposes
Vector = tuple[float, float]


def find_temperatures(
    setup: Setup,
    section: Thermal,
    pressure: Array,
    touching: Mask,
    measures: Measures,
    friction: float,
    velocity: Vector,
) -> tuple[Flash, Array]:
    """Return the temperatures of a steady state, and this rank's rows of the map of rises [K]; collective.

    `pressure` is a map in the run's units, `touching` is not 0 where the surfaces touch, and `friction` is the
    friction of the body, without the interface.
    """
    slab, fft, size, speed = setup.slab, setup.fft, setup.grid.size, math.hypot(*velocity)
    if not speed:  # no dissipation
        return Flash(), slab.zeros()
    place = fft, size, section.conductor, velocity
    made = sliding_heat_unbounded if setup.half_space.free else sliding_heat
    operator = partial(made, *place, time=section.sliding_time(setup.grid, speed))
    surface, inside, pairs = slab.zeros(), slab.zeros(), list[tuple[Array, Array]]()
    at = setup.half_space, setup.units.length, velocity, setup.prony
    depths = depths_of(fft.forward(pressure), fft, *at)
    if (power := friction * measures.pressure * speed) > 0.0:  # [W/m^2], mean over the box
        heat = spread_over(slab, pressure, power)
        surface += operator(depths).apply(heat, slab.empty())
        inside += operator(depths, felt=True).apply(heat, slab.empty())
        pairs.append((inside, heat))
    if (power := measures.friction_interface * measures.pressure * speed) > 0.0:
        rubbed = spread_over(slab, np.where(touching, 1.0, 0.0), power)
        rise = operator().apply(rubbed, slab.empty())
        if section.counterbody is not None:
            still = sliding_heat(fft, size, section.counterbody.conductor, (0.0, 0.0), time=operator.keywords["time"])
            share = share_of(slab, rubbed, rise, surface, still.apply(rubbed, slab.empty()))
            rubbed, rise = share * rubbed, share * rise
        surface += rise
        inside += operator(depths).apply(rubbed, slab.empty())
        pairs.append((surface, rubbed))
    return flash_of(slab, surface, pairs), surface


class Feedback:
    """The fixed point of the temperature. The first round is for the cold body; the second starts from the last
    fixed point if only the velocity differs."""

    def __init__(self) -> None:
        self._speed, self._rise, self._place = 1.0, 0.0, (math.nan, math.nan)

    def solve_fixed_point(
        self, warmed: Callable[[float], Point], speed: float, place: Vector, tolerance: float, most: float = math.inf
    ) -> Point:
        """Return the point `warmed(rise)` whose flash temperature is `rise` [K], to the relative `tolerance`, limited
        to FINEST and COARSEST. `place` is pressure and temperature of the body.

        No rise above `most` [K], where the material's shift ends, is tried. Raises RunError if the fixed point is above
        it, or is not found in MOST_ROUNDS rounds.
        """
        relative = min(max(tolerance, FINEST), COARSEST)
        guess = self._rise * math.sqrt(speed / self._speed) if place == self._place else 0.0
        low, high, rise, last, cold, calls, seconds = 0.0, math.inf, 0.0, (math.nan, math.nan), 0.0, 0.0, 0.0
        for rounds in range(1, MOST_ROUNDS + 1):
            point = warmed(rise)
            assert point.flash is not None
            calls, seconds, over = calls + point.operator_calls, seconds + point.seconds, point.flash.mean - rise
            cold = point.friction if rounds == 1 else cold
            if abs(over) <= max(LEAST_ERROR, relative * rise):
                self._speed, self._rise, self._place = speed, rise, place
                return replace(point, operator_calls=calls, seconds=seconds, rounds=rounds, friction_cold=cold)
            if rise == most and over > 0.0:
                raise beyond_shift(speed, *place, most, most + over)
            if rounds == 1 and guess:  # the cold body may be far from the last fixed point
                rise = min(guess, most)
                continue
            low, high = (rise, high) if over > 0.0 else (low, rise)
            slope = (over - last[1]) / (rise - last[0])
            last, found = (rise, over), rise - over / slope if slope < 0.0 else rise + over
            middle = 0.5 * (low + high) if high < math.inf else 2.0 * max(found, rise)
            rise = min(found if low < found < high else middle, most)
        raise UnsolvedError(
            describe_cold_state(speed, *place),
            f"the flash temperature did not settle in {MOST_ROUNDS} rounds: a rise of {last[0]:.4g} K gives a rise of "
            f"{last[0] + last[1]:.4g} K. Try feedback: none",
        )


def describe_cold_state(speed: float, pressure: float, temperature: float) -> str:
    """Return a text on a state: its velocity [m/s], pressure [Pa] and the temperature of the cold body [deg C]."""
    return f"steady sliding at {speed:.4g} m/s under {pressure:.4g} Pa and {temperature:.4g} C"


def beyond_shift(speed: float, pressure: float, temperature: float, most: float, rise: float) -> UnsolvedError:
    """Return the error of a fixed point above the `most` [K] that the shift of the material allows, where sliding warms
    the rubber by `rise` [K]."""
    return UnsolvedError(
        describe_cold_state(speed, pressure, temperature),
        f"the flash temperature is above {temperature + most:.4g} C, where the shift factors end; rubber of that "
        f"temperature is warmed to {temperature + rise:.4g} C. Extend the table of shift factors, or try feedback: "
        "none",
    )


def describe_hot(points: Sequence[Point]) -> Iterator[Doubt]:
    """Yield a warning if rubber, in bands that of the hottest one, would be so hot that it decomposes."""
    hot = [(rise, point.speed) for point in points if point.flash and (rise := point.flash.of_rubber) > HOTTEST]
    if hot:
        rise, speed = max(hot)
        facts = {"count": len(hot), "points": len(points), "most": HOTTEST, "rise": rise, "speed": speed}
        yield Doubt("decomposes", "", facts)


def describe_unmeasured(points: Sequence[Point], job: Job) -> Iterator[Doubt]:
    """Yield a warning if the flash temperature of relaxing rubber, in bands of the hottest one, is outside its measured
    range."""
    body = job.material.fitted
    if not feeds_back(job) or not isinstance(body, Zener) or body.temperatures is None:
        return
    own, (low, high) = temperature_of(job.material), body.temperatures
    warm = [
        ((own if math.isnan(point.temperature) else point.temperature) + point.flash.of_rubber, point.speed)
        for point in points
        if point.flash
    ]
    if beyond := [one for one in warm if not low <= one[0] <= high]:
        hottest, speed = max(beyond)
        facts = {"low": low, "high": high, "count": len(beyond), "points": len(points)}
        yield Doubt("flash temperatures", "material", {**facts, "hottest": hottest, "speed": speed})


def doubts_of_points(points: Sequence[Point], job: Job) -> Iterator[Doubt]:
    """Yield warnings about the temperatures of a friction curve."""
    yield from describe_hot(points)
    yield from describe_unmeasured(points, job)


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
    hottest = float(values[-1])
    return Flash(float(values @ weights) / whole, hottest, float(lower), float(upper), hottest)

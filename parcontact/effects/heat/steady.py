"""Temperatures of steady sliding: the map below the contact, and with feedback one temperature at which all rubber
relaxes.

The map is exact for the given heat (`effects.heat.solver`). With feedback all rubber relaxes as at one temperature T.
The heat of this steady state causes the flash temperature T_0 + F(T), where T_0 is the temperature of the cold body.
Secants within a bracket find the T for which `T = T_0 + F(T)`. Each round of this search is a steady state.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ...contact.problem import Box, Mask
from ...errors import Doubt, InputError, Kind, UnsolvedError
from ...job import Job, Zener
from ...march.scene import Setup
from ...march.steady import Point
from ...parallel.slab import Array
from ...physics.records import Measures
from ..branches import highest_temperature_of, temperature_of
from .effect import Thermal, feeds_back
from .solver import Flash, depths_of, flash_of, share_of, sliding_heat, sliding_heat_unbounded, spread_over

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
    """Return the temperatures of a steady state, and this rank's rows of the map of temperature rises of the surface
    [K]; collective.

    `pressure` is a map in the run's units, `touching` is not 0 where the surfaces touch, and `velocity` is in m/s.
    `friction` is the coefficient of friction of the body, without the interface.
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
    """Finds the flash temperature that a steady state reproduces. The first round is for cold rubber. If only the
    velocity differs from that of the last state, the second round starts from the flash temperature of that state."""

    def __init__(self) -> None:
        self._speed, self._rise, self._place = 1.0, 0.0, (math.nan, math.nan)

    def solve_fixed_point(
        self, warmed: Callable[[float], Point], speed: float, place: Vector, tolerance: float, most: float = math.inf
    ) -> Point:
        """Return the point `warmed(rise)` whose own flash temperature is `rise` [K].

        Both agree within the relative `tolerance`, or within FINEST if it is smaller, or COARSEST if it is larger.
        `speed` is in m/s, and `place` holds the mean pressure [Pa] and the temperature of the cold body [deg C]. No
        rise above `most` [K] is tried, where the material's shift ends. Raises RunError if the flash temperature is
        above `most`, or does not settle in MOST_ROUNDS rounds.
        """
        relative = min(max(tolerance, FINEST), COARSEST)
        guess = self._rise * math.sqrt(speed / self._speed) if place == self._place else 0.0
        low, high, rise, last, cold, calls, seconds = 0.0, math.inf, 0.0, (math.nan, math.nan), 0.0, 0.0, 0.0
        for rounds in range(1, MOST_ROUNDS + 1):
            point = warmed(rise)
            flash = point.effects["thermal"]
            calls, seconds, over = calls + point.operator_calls, seconds + point.seconds, flash.mean - rise
            cold = point.friction if rounds == 1 else cold
            if abs(over) <= max(LEAST_ERROR, relative * rise):
                self._speed, self._rise, self._place = speed, rise, place
                found = replace(flash, rounds=rounds, friction_cold=cold)
                return replace(point, operator_calls=calls, seconds=seconds).with_effect("thermal", found)
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


class HeatLoop:
    """Loop that finds the temperatures of steady states on one grid. With feedback all rubber relaxes at the flash
    temperature."""

    def __init__(self, setup: Setup) -> None:
        self._section, self._own = setup.job.section("thermal"), temperature_of(setup.job.material)
        self._highest = highest_temperature_of(setup.job.material)
        self._feedback = Feedback()
        self.fields: dict[str, Array] = {}

    def solve(self, sliding: Any, solve: Callable[[Vector, float], Point], velocity: Vector, pressure: float) -> Point:
        """Return the steady state with its temperatures; collective. `solve` returns a state for the present `setup` of
        `sliding`, a `march.steady.SteadySliding`. Raises RunError."""
        if self._section.feedback == "none":
            return self._heat(sliding, solve(velocity, pressure))
        cold = self._own if math.isnan(sliding.temperature) else sliding.temperature
        speed, tolerance = math.hypot(*velocity), sliding.setup.choices.numerics.tolerance

        def warmed(rise: float) -> Point:
            try:
                sliding.set_material(min(cold + rise, self._highest))
            except InputError as error:
                raise no_material(speed, pressure, cold, error) from None
            return self._heat(sliding, solve(velocity, pressure))

        return self._feedback.solve_fixed_point(warmed, speed, (pressure, cold), tolerance, self._highest - cold)

    def _heat(self, sliding: Any, point: Point) -> Point:
        """Return the last state with its temperatures added, and keep the map of temperatures; collective."""
        p, by_energy = sliding.contact.p, point.friction - point.measures.friction_interface
        contact = p, Box().touches(p), point.measures, by_energy, point.velocity
        flash, self.fields["temperature"] = find_temperatures(sliding.setup, self._section, *contact)
        return point.with_effect("thermal", flash)


def loops(setup: Setup) -> Iterator[HeatLoop]:
    """Yield the loop that finds the temperatures of steady states, if the job has a `thermal` section."""
    if setup.job.section("thermal") is not None:
        yield HeatLoop(setup)


def no_material(speed: float, pressure: float, temperature: float, error: InputError) -> UnsolvedError:
    """Return the error of a state whose flash temperature is outside the known range of the material."""
    place = describe_cold_state(speed, pressure, temperature)
    return UnsolvedError(place, f"no material at the flash temperature: {error}")


def describe_cold_state(speed: float, pressure: float, temperature: float) -> str:
    """Return a text that names a state: velocity [m/s], pressure [Pa] and temperature of the cold body [deg C]."""
    return f"steady sliding at {speed:.4g} m/s under {pressure:.4g} Pa and {temperature:.4g} C"


def beyond_shift(speed: float, pressure: float, temperature: float, most: float, rise: float) -> UnsolvedError:
    """Return the error of a steady state that is warmer than the material's shift covers. The shift ends at the rise
    `most` [K]; rubber that relaxes at this rise would be warmed by `rise` [K], which is more."""
    return UnsolvedError(
        describe_cold_state(speed, pressure, temperature),
        f"the flash temperature is above {temperature + most:.4g} C, where the shift factors end; rubber of that "
        f"temperature is warmed to {temperature + rise:.4g} C. Extend the table of shift factors, or try feedback: "
        "none",
    )


WARN_DECOMPOSES = Kind(
    "decomposes",
    "flash temperatures of {count} of {points} points are above {most:g} K, up to {rise:.3g} K at {speed:g} m/s: "
    "rubber decomposes there; take a smaller thermal.distance, velocity or pressure",
)


def describe_hot(points: Sequence[Point]) -> Iterator[Doubt]:
    """Yield a warning if the rubber, or the rubber of the hottest band, would be so hot that it decomposes."""
    known = ((point.effects.get("thermal"), point.speed) for point in points)
    hot = [(rise, speed) for flash, speed in known if flash and (rise := flash.of_rubber) > HOTTEST]
    if hot:
        rise, speed = max(hot)
        facts = {"count": len(hot), "points": len(points), "most": HOTTEST, "rise": rise, "speed": speed}
        yield WARN_DECOMPOSES("", facts)


WARN_FLASH_TEMPERATURES = Kind(
    "flash temperatures",
    "with its flash temperature the rubber is beyond the {low:g} to {high:g} C of its measurement at {count} of "
    "{points} points, up to {hottest:.3g} C at {speed:g} m/s: the shift is an extrapolation there",
)


def describe_unmeasured(points: Sequence[Point], job: Job) -> Iterator[Doubt]:
    """Yield a warning if the shift is an extrapolation at the flash temperature of any point (in bands, at the
    temperature of the hottest band), as the temperature is outside the range that was measured."""
    body = job.material.fitted
    if not feeds_back(job) or not isinstance(body, Zener) or body.temperatures is None:
        return
    own, (low, high) = temperature_of(job.material), body.temperatures
    warm = [
        ((own if math.isnan(point.temperature) else point.temperature) + flash.of_rubber, point.speed)
        for point in points
        if (flash := point.effects.get("thermal"))
    ]
    if beyond := [one for one in warm if not low <= one[0] <= high]:
        hottest, speed = max(beyond)
        facts = {"low": low, "high": high, "count": len(beyond), "points": len(points)}
        yield WARN_FLASH_TEMPERATURES("material", {**facts, "hottest": hottest, "speed": speed})


def doubts_of_points(points: Sequence[Point], job: Job) -> Iterator[Doubt]:
    """Yield warnings about the temperatures of a friction curve."""
    yield from describe_hot(points)
    yield from describe_unmeasured(points, job)

"""Temperatures of steady sliding, on one grid and in bands.

On one grid the map below the contact is exact for the given heat (`effects.heat.solver`). With feedback all rubber
relaxes as at one temperature T. The heat of this steady state causes the flash temperature T_0 + F(T), where T_0 is the
temperature of the cold body. Secants within a bracket find the T for which `T = T_0 + F(T)`. Each round of this search
is a steady state.

In bands, the rise in each band is caused by its own heat and by the heat of all other bands. The heat of a band is
released at the depths where its waves strain the rubber, and is distributed over the contact in proportion to the
pressure. The temperature is a sum of waves cos(m z) along the depth. Such a wave has the share g_i(m) in the heat of
band i, and the share g_k(m) in the mean temperature of the rubber that dissipates in band k. With the heat h_i [W/m^2]
of band i, the rise of band k is

    T_k = sum_i h_i 2/pi int g_i g_k (S(m) + sum_(j <= i, j <= k) S_j(m)) dm.

Here S belongs to uniform heat after the sliding time t,

    S(m) = (1 - exp(-m^2 D t))/(kappa m^2),

and S_j to the waves in the pressure of band j, which have the power P(q) relative to the square of the mean pressure:

    S_j(m) = sum_q P(q) Re (1 - exp(-(beta^2 + m^2) D t))/(beta^2 + m^2)/kappa.

Bands are numbered from the coarsest. Waves of band j modulate both the heat of band i and the temperature of band k
only if i and k are as fine as j or finer. Heat of the interface is released on the surface, where g = 1, and counts as
heat of the finest band.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar

import numpy as np

from ...bands.band import Means
from ...bands.cascade import Results, by_load, by_square
from ...bands.choice import Cut
from ...bands.road_sliding import RoadSliding
from ...contact.problem import Box, Contact, Mask
from ...errors import Doubt, InputError, Kind, UnsolvedError
from ...job import Job, Zener
from ...march.scene import Setup
from ...march.steady import Point
from ...parallel.slab import Array
from ...physics.records import Measures
from ..branches import highest_temperature_of, temperature_of
from .effect import Thermal, feeds_back
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
    """Return the temperatures of a steady state, and this rank's rows of a map [K]: how much warmer the surface is at
    each point. Collective.

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
    """Search for the flash temperature with feedback: rubber that relaxes at this temperature is warmed to this
    temperature by its own heat. The first iteration is for cold rubber. If only the velocity differs from that of the
    last steady state, the second iteration starts from the flash temperature of that state."""

    def __init__(self) -> None:
        self._speed, self._rise, self._place = 1.0, 0.0, (math.nan, math.nan)

    def solve_fixed_point(
        self, warmed: Callable[[float], Point], speed: float, place: Vector, tolerance: float, most: float = math.inf
    ) -> Point:
        """Return the steady state `warmed(rise)` that causes the flash temperature `rise` [K] for which it was
        calculated.

        Rise and flash temperature agree within the relative `tolerance`, which is limited to the range from FINEST to
        COARSEST. `speed` is in m/s, and `place` holds the mean pressure [Pa] and the temperature of the cold body [deg
        C]. The material's shift ends at the rise `most` [K], above which no rise is tried. Raises RunError if the flash
        temperature is above `most`, or does not settle in MOST_ROUNDS rounds.
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
        """Return the steady state of sliding with its temperatures; collective. Each call of the argument `solve`
        calculates a steady state with the moduli in `sliding.setup` (`march.steady.SteadySliding`). Raises RunError."""
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
    """Yield the loop that finds the temperatures of steady states."""
    yield HeatLoop(setup)


def no_material(speed: float, pressure: float, temperature: float, error: InputError) -> UnsolvedError:
    """Return the error for a steady state whose flash temperature is outside the known range of the material."""
    place = describe_cold_state(speed, pressure, temperature)
    return UnsolvedError(place, f"no material at the flash temperature: {error}")


def describe_cold_state(speed: float, pressure: float, temperature: float) -> str:
    """Return a text that names a steady state by velocity [m/s], pressure [Pa] and cold temperature [deg C]."""
    return f"steady sliding at {speed:.4g} m/s under {pressure:.4g} Pa and {temperature:.4g} C"


def beyond_shift(speed: float, pressure: float, temperature: float, most: float, rise: float) -> UnsolvedError:
    """Return the error of a steady state that is warmer than the end of the material's shift. The shift ends at the
    rise `most` [K]. The heat of rubber that relaxes at this rise would warm the rubber by `rise` [K], which is more."""
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


# -- bands -------------------------------------------------------------------------------------------------------------


LEAST_BAND_ERROR, RELATIVE = 0.1, 0.02  # accuracy: error of the rise of a band [K], and relative
TINY = 1e-300  # rounding: least square of a change, to avoid division by 0
SPACING, LOWEST, HIGHEST = 0.3, 1e-4, 30.0  # accuracy: spacing of ln m; limits of m over wavenumbers of bands


def waves_along_depth(low: float, high: float) -> tuple[Array, Array]:
    """Return the wavenumbers m [1/m] at which integrals `2/pi int ... dm` over the depth are evaluated, and their
    weights [1/m]; both have the shape (m,). The bands lie between the wavenumbers `low` and `high` [1/m]."""
    ends = np.log(LOWEST * low), np.log(HIGHEST * high)
    m = np.exp(np.linspace(*ends, 2 + int((ends[1] - ends[0]) / SPACING)))
    step = float(np.log(m[1] / m[0]))
    weights = 2.0 / np.pi * step * m
    weights[0] /= 1.0 - np.exp(-step)  # includes all waves below
    return m, weights


def uniform(body: Conductor, m: Array, time: float) -> Array:
    """Return the uniform part S(m) [K m^3/W] of the rise after a sliding time [s], shape (m,)."""
    return np.asarray(-np.expm1(-(m**2) * body.diffusivity * time) / m**2 / body.conductivity)


def warming_factors(setup: Setup, body: Conductor, time: float, velocity: Vector, m: Array) -> Array:
    """Return the factors of the waves of a band j in the sum S_j(m) of the module, shape (m, waves). The band has slid
    at `velocity` [m/s] for a `time` [s]. A half spectrum lacks waves: each factor is multiplied by the number of waves
    that its wave represents."""
    fft, size = setup.fft, setup.grid.size
    square = body.squared_beta(fft, size, velocity)
    counts = (fft.multiplicity * (square.real > 0.0)).ravel()
    reach, found = body.diffusivity * time, np.empty((m.size, square.size))
    for row, one in zip(found, m, strict=True):
        whole = np.where(counts > 0.0, square.ravel(), 1.0) + one**2
        row[:] = counts * np.real(-np.expm1(-whole * reach) / whole) / body.conductivity
    return found


def rises_of(
    weights: Array,
    uniform: Array,
    shares: Sequence[Array],
    warmings: Sequence[Array],
    heats: Sequence[float],
    rubbed: float,
) -> list[float]:
    """Return the temperature rise [K] of each band, from the coarsest.

    `weights` are the weights of the waves m in the integral, and `uniform` is S(m), both of shape (m,). `shares`,
    `warmings` and `heats` have one item per band: g(m) and S_j(m), of shape (m,), and the heat [W/m^2]. `rubbed`
    [W/m^2] is the heat of the interface.
    """
    sums = uniform + np.cumsum(warmings, axis=0)  # S and all S_j down to a band
    sources = [*zip(shares, heats, strict=True), (np.ones_like(weights), rubbed)]
    return [
        float(sum(heat * np.sum(weights * own * felt * sums[min(i, k)]) for i, (own, heat) in enumerate(sources)))
        for k, felt in enumerate(shares)
    ]


def flash_of_bands(
    rises: Sequence[float], heats: Sequence[float], rounds: int = 1, friction_cold: float = math.nan
) -> Flash:
    """Return the temperatures of a contact from the `rises` [K] of its bands: the mean and the quartiles, weighted by
    `heats`, and the highest rise of a band. The result also stores the number of iterations in which the rises were
    found (`rounds`), and the friction of cold rubber, `friction_cold`."""
    order = np.argsort(rises)
    values, weights = np.asarray(rises)[order], np.asarray(heats)[order]
    whole = float(weights.sum())
    if not whole > 0.0:
        return Flash(rounds=rounds, friction_cold=friction_cold)
    shares = (np.cumsum(weights) - 0.5 * weights) / whole
    lower, upper = np.interp([0.25, 0.75], shares, values)
    hottest = float(values[-1])
    return Flash(float(values @ weights) / whole, hottest, float(lower), float(upper), hottest, rounds, friction_cold)


def seconds_of(job: Job, cut: Cut, velocity: Vector) -> float:
    """Return the time [s] in which the rubber slides over `thermal.distance`, or, without this key, over the length of
    the coarsest band's box."""
    return float((job.section("thermal").distance or cut.box) / (math.hypot(*velocity) or math.inf))


class HeatProbe:
    """Measures S_j(m) and g(m) in the contacts of a band."""

    means: ClassVar[Means] = {"depths": by_load, "warming": by_square}

    def __init__(self, job: Job, cut: Cut) -> None:
        self._job, self._cut, self._velocity = job, cut, (math.nan, math.nan)
        self._waves, _ = waves_along_depth(float(cut.edges[0]), float(cut.edges[-1]))

    def slide(self, setup: Setup, velocity: Vector) -> None:
        """Prepare the measurement of S_j(m) for a velocity [m/s]."""
        if velocity != self._velocity:
            body, seconds = self._job.section("thermal").conductor, seconds_of(self._job, self._cut, velocity)
            self._factors, self._velocity = warming_factors(setup, body, seconds, velocity, self._waves), velocity

    def measure(self, setup: Setup, contact: Contact, velocity: Vector) -> dict[str, Array]:
        """Return g(m) as `depths` and S_j(m) as `warming` of a contact, both of shape (m,)."""
        spectrum, m = setup.fft.forward(contact.p), self._waves
        depths = depths_of(spectrum, setup.fft, setup.half_space, setup.units.length, velocity, setup.prony)
        shares = depths.cosines(m) if depths.wavenumbers.size else np.ones_like(m)
        power = (spectrum.real**2 + spectrum.imag**2) / float(contact.p.sum()) ** 2
        return {"depths": shares, "warming": np.asarray(self._factors @ power.ravel())}


def probes(job: Job, cut: Cut) -> Iterator[HeatProbe]:
    """Yield the probe that measures g(m) and S_j(m) of bands."""
    yield HeatProbe(job, cut)


class HeatOfBands:
    """The loop that finds the temperatures of bands.

    With feedback each band relaxes at its own temperature. The temperatures change the friction and so the heat of the
    bands, which gives new temperatures. Aitken's relaxation finds the temperatures that do not change any more. The
    first iteration is for cold rubber. No temperature above the range of the material's shift is tried.
    """

    words: ClassVar[tuple[str, str]] = ("temperatures", "feedback: none")

    def __init__(self, job: Job, cut: Cut) -> None:
        self.moves, self._job, self._cut = feeds_back(job), job, cut
        self._highest = highest_temperature_of(job.material) if self.moves else math.inf
        self._rises, self._rounds, self._cold = np.zeros(cut.count), 1, math.nan  # without feedback nothing begins

    def begin(self, road: RoadSliding) -> None:
        self._rises, self._rounds, self._cold = np.zeros(self._cut.count), 0, math.nan
        self._over, self._last, self._relax = np.zeros(0), np.zeros(0), 1.0

    def act(self, road: RoadSliding) -> None:
        try:
            road.set_temperatures(np.minimum(road.own_temperature + self._rises, self._highest).tolist())
        except InputError as error:
            raise no_material(road.speed, road.place[1], road.own_temperature, error) from None

    def settles(self, road: RoadSliding, results: Results, changes: tuple[float, float], others: bool) -> bool:
        """Return True if the temperature rises of the bands agree, within an error, with the rises that their heat
        causes. The rises stay 0 until all loops before this one have settled for cold rubber. Arguments are as in
        `bands.road_sliding.BandLoop.settles`."""
        rubbed = road.rub(results) * road.speed
        self._over = np.array(self._rises_of(road, results, rubbed)) - self._rises
        if math.isnan(self._cold):
            self._over = self._over if others else 0.0 * self._over
            self._cold = sum(result.friction for result in results) if others else math.nan
        self._rounds += 1
        self._settled = np.abs(self._over) <= np.maximum(LEAST_BAND_ERROR, RELATIVE * self._rises)
        return bool(np.all(self._settled))

    def move(self, road: RoadSliding, results: Results) -> None:
        """Set the temperature rises of the next iteration. Raises RunError if the rises cannot settle below the end of
        the shift's range."""
        over, last, most = self._over, self._last, self._highest - road.own_temperature
        at_most = (self._rises == most) & (over > 0.0)
        if not np.all(self._settled) and np.all(self._settled | at_most):
            place = road.speed, road.place[1], road.own_temperature
            raise beyond_shift(*place, most, most + float(over[self._rises == most].max()))
        if last.any():
            change = over - last
            square = max(float(change @ change), TINY)
            self._relax = float(np.clip(-self._relax * float(last @ change) / square, 0.1, 1.0))
        self._rises, self._last = np.clip(self._rises + self._relax * over, 0.0, most), over

    def found(self, road: RoadSliding, point: Point, results: Results, changes: tuple[float, float]) -> Point:
        """Return the point with the temperatures of its contact added."""
        heats = [result.friction for result in results]
        heats[-1] += point.measures.friction_interface
        self._of_bands = self._rises_of(road, results, road.rub(results) * road.speed)
        return point.with_effect("thermal", flash_of_bands(self._of_bands, heats, self._rounds, self._cold))

    def values(self, results: Results) -> Mapping[str, Sequence[float]]:
        return {"flash_temperature": self._of_bands}

    def _rises_of(self, road: RoadSliding, results: Results, rubbed: float) -> list[float]:
        """Return the rises [K] of all bands; `rubbed` is the heat of the interface [W/m^2]."""
        velocity, pressure = road.place
        m, weights = waves_along_depth(float(self._cut.edges[0]), float(self._cut.edges[-1]))
        whole = uniform(self._job.section("thermal").conductor, m, seconds_of(self._job, self._cut, velocity))
        shares, warmings = ([result.found[name] for result in results] for name in HeatProbe.means)
        heats = [result.friction * pressure * road.speed for result in results]
        return rises_of(weights, whole, shares, warmings, heats, rubbed)


def band_loops(job: Job, cut: Cut) -> Iterator[HeatOfBands]:
    """Yield the loop that finds the temperatures of bands."""
    yield HeatOfBands(job, cut)

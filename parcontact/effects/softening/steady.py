"""Amplitude of the shear strain that softens each wave of a rough contact, in steady sliding.

A wave of the surface displacement, with the amplitude A and the wavenumber q, strains an incompressible half space. At
the depth z the strain tensor e turns as the wave passes, and its magnitude stays constant:

    gamma(z) = sqrt(2 e:e) = 2 q A (q z) exp(-q z).                                                               (1)

In a rough contact the strain of all waves differs from place to place, and counts where power is dissipated. Let
gamma(x, z) be the strain and d(x, z) the dissipated power at the place x in the depth z, and let <> be the mean over x.
Then

    S(z) = <d gamma^2>/<d>/R(z)                                                                                   (2)

is the mean square strain at the depth z, weighted by power. Waves with independent phases would also have `<d
gamma^2>/(<d> <gamma^2>)` above 1; R is this ratio for waves with the amplitudes of the contact and independent phases.
In full contact phases are independent, and S is the sum of gamma^2 over all waves. The strain of one wave is a mean
over the depths at which this wave dissipates,

    gamma_q^2 = int 4 q^3 z^2 exp(-2 q z) S(z) dz,                                                                (3)

which is 3/8 (q A)^2 if there is no other wave. The square of the strain of an octave, or of a band, is the mean of (3)
over its waves, weighted by their power. S(z) of a surface is the sum of the S(z) of its bands.

Strains depend on the moduli of a steady state, and moduli on the strains. Both are found in rounds: a round solves the
state with the moduli at the last strains, and finds new strains. The strains for the next round are the power mean
`gamma_new^0.7 gamma^0.3`. Rounds end when friction changes by less than a part of the job's accuracy. In bands, the
waves of all bands strain each band.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement, pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ...bands.band import Means
from ...bands.cascade import Results, by_power
from ...bands.choice import Cut
from ...bands.road_sliding import RoadSliding
from ...contact.problem import Contact
from ...errors import Doubt, Kind, RunError
from ...job import Job
from ...march.scene import Setup
from ...march.steady import Point, count_octaves, in_rounds
from ...parallel.fft import Spectrum
from ...parallel.slab import Array
from ...physics.convolution import wavenumbers
from .effect import Softened, strains_in_full_contact

SHALLOW, DEEP = 0.2, 4.0  # accuracy: least depth times the largest wavenumber, largest depth times the smallest
BEYOND = 4.0  # accuracy: ratio by which the depths of the integral (3) go beyond these
SPACING = 1.5  # accuracy: ratio of two depths of the integral (3); S is found at every second one
TINY = 1e-300  # rounding: least square of a strain, for logarithms
Vector = tuple[float, float]


@dataclass(frozen=True)
class StrainsAtDepth:
    """Strains under a map of displacements.

    `squares` are S(z) [-] at the depths z, shape (depths,). `weights` are the weights of S(z) in the square of the
    strain of each octave (3), shape (octaves, depths). `power` is the power of each octave, shape (octaves,), up to a
    common factor.
    """

    squares: Array
    weights: Array
    power: Array

    def of_octaves(self, otherwise: Array) -> Array:
        """Return the strain [-] of each octave, shape (octaves,). The strain of an octave without power is the item of
        `otherwise`."""
        found = np.sqrt(self.weights @ self.squares)
        return np.where(found > 0.0, found, otherwise)


def depths_between(low: float, high: float) -> Array:
    """Return the depths at which strains are needed for waves between the wavenumbers `low` and `high`. If these are in
    1/m, the depths are in m."""
    ends = np.log(SHALLOW / BEYOND / high), np.log(DEEP * BEYOND / low)
    return np.exp(np.linspace(*ends, 2 + int((ends[1] - ends[0]) / math.log(SPACING))))


def ends_of(setup: Setup) -> Vector:
    """Return the smallest and the largest wavenumber of the grid, in 1 over the run's unit of length."""
    cells = setup.slab.nx / setup.size[0], setup.slab.ny / setup.size[1]
    return 2.0 * math.pi / max(setup.size), math.pi * math.hypot(*cells)


def strains_of(
    setup: Setup, u: Array, velocity: Vector, depths: Array, octave: NDArray[np.int64], count: int
) -> StrainsAtDepth:
    """Return the strains at these depths under a surface that slides at this velocity [m/s]; collective.

    The displacement u, a map, and the depths are in the run's units. `octave` has the number of the octave of each
    wave, in the shape of a spectrum; numbers are below `count`.
    """
    q = np.hypot(*wavenumbers(setup.fft, setup.size))
    spectrum = setup.fft.forward(u) * (setup.units.height / setup.units.length)
    power = _power(setup, q, velocity)
    low, high = ends_of(setup)
    there = np.flatnonzero((depths >= SHALLOW / high) & (depths <= DEEP / low))[::2]
    found = np.array([_square_at(setup, spectrum, power, q, float(depths[index])) for index in there])
    whole = power * np.abs(spectrum) ** 2 * setup.fft.multiplicity
    return StrainsAtDepth(_continued(depths, there, found), *_weights(setup, whole, q, depths, octave, count))


def _continued(depths: Array, there: NDArray[np.int64], found: Array) -> Array:
    """Return S at all depths. Within the range of depths where it was `found`, log S is a cubic spline in log z. Nearer
    to the surface S is proportional to z^2, and deeper it is 0."""
    from scipy.interpolate import CubicSpline  # slow to import, and of use to few

    first, last = depths[there[0]], depths[there[-1]]
    spline = CubicSpline(np.log(depths[there]), np.log(np.maximum(found, TINY)))
    inside = np.exp(spline(np.log(np.clip(depths, first, last))))
    return np.where(depths < first, found[0] * (depths / first) ** 2, np.where(depths > last, 0.0, inside))


def _weights(
    setup: Setup, power: Array, q: Array, depths: Array, octave: NDArray[np.int64], count: int
) -> tuple[Array, Array]:
    """Return the weights of S(z) in the square of each octave's strain, averaged over its waves with their `power`, and
    the power of each octave."""
    step = math.log(depths[1] / depths[0])  # of the trapezoidal rule in ln z
    sums = [np.bincount(octave.ravel(), power.ravel(), count)]
    for z in depths:
        s = q * z
        sums.append(np.bincount(octave.ravel(), (power * 4.0 * step * s**3 * np.exp(-2.0 * s)).ravel(), count))
    whole, *each = np.array(setup.slab.sum(*np.concatenate(sums))).reshape(-1, count)
    weights = np.array(each).T
    return np.divide(weights, whole[:, None], out=np.zeros_like(weights), where=whole[:, None] > 0.0), whole


def _power(setup: Setup, q: Array, velocity: Vector) -> Array:
    """Return the dissipated power of each wave, divided by the square of its amplitude, up to a common factor."""
    speed = setup.in_units(velocity)
    omega = np.abs(setup.half_space.frequencies(setup.fft, speed))
    modulus = setup.half_space.sliding_moduli(setup.fft, speed, setup.prony)(slice(None))
    return np.asarray(q * omega * np.abs(modulus.imag))


def _square_at(setup: Setup, spectrum: Spectrum, power: Array, q: Array, depth: float) -> float:
    """Return S of (2) at a depth; 0 without dissipation."""
    waves = spectrum * (depth * np.exp(-q * depth))  # times components of q: strains
    heavy = waves * np.sqrt(power / np.where(q > 0.0, q, 1.0))
    strain, density = (_squared(setup, one) for one in (waves, heavy))
    sums = setup.slab.sum(float((density * strain).sum()), float(density.sum()), float(strain.sum()))
    if not sums[1] * sums[2] > 0.0:
        return 0.0
    return sums[0] / sums[1] / _of_independent_waves(setup, waves, heavy)


def _squared(setup: Setup, waves: Spectrum) -> Array:
    """Return the map of `2 e:e` for displacement waves with the spectrum `waves`. The caller multiplies the spectrum by
    `z exp(-q z)` to get gamma^2 of (1) at the depth z."""
    fft, out, total = setup.fft, setup.slab.empty(), setup.slab.zeros()
    for weight, symbol in _components(setup):
        np.multiply(waves, symbol, out=fft.spectrum)
        total += weight * fft.backward(fft.spectrum, out) ** 2
    return total


def _components(setup: Setup) -> Iterator[tuple[float, NDArray[Any]]]:
    """Yield the components of the strain tensor: the weight of each in `2 e:e`, and the factor by which its spectrum
    differs from that of the displacement, for each wave."""
    qx, qy = wavenumbers(setup.fft, setup.size)
    q = np.hypot(qx, qy)
    flat = [direction for direction, points in ((qx, setup.slab.nx), (qy, setup.slab.ny)) if points > 1]
    yield 2.0, q**2
    for k, one in enumerate(flat):
        yield 4.0, 1j * one * q
        for other in flat[k:]:
            yield (2.0 if other is one else 4.0), one * other + 0.0 * q


def _of_independent_waves(setup: Setup, waves: Spectrum, heavy: Spectrum) -> float:
    """Return R of (2) for waves with independent phases, from their fourth moments.

    Let the components of the vector E be those of the strain, and of the vector W those of the strain times the root of
    a wave's power, both weighted so that E^2 = gamma^2 and W^2 = d. Then R is
    `1 + (2 sum_ij <E_i W_j>^2 - sum_k <E^2>_k <W^2>_k)/(<E^2> <W^2>)`, with a sum over the waves k.
    """
    counts = setup.fft.multiplicity
    q = np.hypot(*wavenumbers(setup.fft, setup.size))
    vectors = [math.sqrt(weight) * symbol for weight, symbol in _components(setup)]
    both = counts * np.abs(waves) * np.abs(heavy)
    own, other = (8.0 * q**4 * np.abs(one) ** 2 for one in (waves, heavy))
    pairs = list(combinations_with_replacement(vectors, 2))
    products = [float((both * (one * np.conj(two)).real).sum()) for one, two in pairs]
    whole = float((counts * own).sum()), float((counts * other).sum()), float((2.0 * counts * own * other).sum())
    first, second, same, *found = setup.slab.sum(*whole, *products)
    squares = sum((1.0 if one is two else 2.0) * product**2 for (one, two), product in zip(pairs, found, strict=True))
    return 1.0 + (2.0 * squares - same) / (first * second)


def strains_at_octaves(setup: Setup, softened: Softened, u: Array, velocity: Vector) -> StrainsAtDepth:
    """Return the strains of all octaves of softened rubber on one grid; collective. `u` and `velocity` are as in
    `strains_of`."""
    octave = softened.octave(np.hypot(*wavenumbers(setup.fft, setup.size)))
    return strains_of(setup, u, velocity, depths_between(*ends_of(setup)), octave, len(softened.strains))


SHARE = 0.2  # accuracy: allowed change of friction in a round over the accuracy of the job
MOST_ROUNDS = 40  # tuning: limit on rounds


@dataclass(frozen=True)
class Round:
    """Result of one iteration between strains and moduli: the friction coefficient, and for each octave of wavelengths
    its strain [-] and its power."""

    friction: float
    strains: Array
    power: Array

    @property
    def amplitude(self) -> float:
        """Return the root of the mean square strain, weighted by power [-]; NaN without power."""
        whole = float(self.power.sum())
        return math.sqrt(float(self.power @ self.strains**2) / whole) if whole > 0.0 else math.nan


def settle(first: Softened, solve: Callable[[Softened], Round], accuracy: float) -> None:
    """Iterate until friction changes by less than the fraction SHARE of `accuracy`, or until the factors of the moduli
    do not change. The first iteration uses the factors of `first`. Raises RunError if friction does not settle."""
    softened, last = first, math.nan
    for _ in range(MOST_ROUNDS):
        found = solve(softened)
        change = abs(found.friction - last) / found.friction if found.friction > 0.0 else 0.0
        following = replace(softened, strains=tuple(softened.table.mixed(found.strains, softened.strains).tolist()))
        if change <= SHARE * accuracy or following.same_factors(softened):
            return
        softened, last = following, found.friction
    sentence = f"the strain that softens the rubber did not settle in {MOST_ROUNDS} rounds: friction changes by"
    raise RunError(f"{sentence} {100 * change:.2g} % in the last one")


class StrainLoop:
    """Loop that finds the strains of the octaves of wavelengths on one grid; each steady state starts from the strains
    of the last one."""

    fields: ClassVar[Mapping[str, Array]] = {}

    def __init__(self, setup: Setup) -> None:
        section = setup.job.section("softening")
        self.softened = Softened(section.made, max(setup.size), (section.made.start,) * count_octaves(setup))

    def solve(self, sliding: Any, solve: Callable[[Vector, float], Point], velocity: Vector, pressure: float) -> Point:
        """Return the steady state of sliding whose moduli belong to its own strains; collective. Each call of the
        argument `solve` calculates a steady state with the moduli in `sliding.setup` (`march.steady.SteadySliding`).
        Raises RunError."""
        points, rounds = list[Point](), list[Round]()

        def once(softened: Softened) -> Round:
            self.softened, sliding.setup = softened, replace(sliding.setup, factors=softened.factors)
            points.append(solve(velocity, pressure))
            found = strains_at_octaves(sliding.setup, softened, sliding.contact.u, velocity)
            strains = found.of_octaves(np.array(softened.strains))
            rounds.append(Round(points[-1].friction, strains, found.power))
            return rounds[-1]

        settle(self.softened, once, sliding.setup.job.numerics.asked.both[0])
        return in_rounds(points).with_effect("softening", rounds[-1].amplitude)


def loops(setup: Setup) -> Iterator[StrainLoop]:
    """Yield the loop that finds the strains of steady states."""
    yield StrainLoop(setup)


WARN_STRAINS_BEYOND_THE_SWEEP = Kind(
    "strains beyond the sweep",
    "the strain is {strain:.2g} at {speed:g} m/s, beyond the {low:.3g} to {high:.3g} of the sweep at {count} of "
    "{points} points: factors of its ends are used there; measure a wider range of strains",
)


def doubts_of_points(points: Sequence[Point], job: Any) -> Iterator[Doubt]:
    """Yield a warning if strains of a friction curve are outside the table of factors."""
    table = job.section("softening").made
    strained = [(point.effects["softening"], point.speed) for point in points]
    beyond = [each for each in strained if each[0] > 0.0 and not table.reaches(each[0])]  # NaN without friction
    if beyond:
        low, high = table.strain[0], table.strain[-1]
        strain, speed = max(beyond, key=lambda each: abs(math.log(each[0] / math.sqrt(low * high))))
        facts = {"strain": strain, "speed": speed, "low": low, "high": high}
        yield WARN_STRAINS_BEYOND_THE_SWEEP("softening", {**facts, "count": len(beyond), "points": len(points)})


BINS = 12  # accuracy: bins of wavenumbers in a band


def describe_bands(job: Any, cut: Any) -> Iterator[str]:
    """Yield a sentence with the strain and the factors f and g of each band of a job. `cut` is a `bands.choice.Cut`."""
    edges = np.concatenate(
        [np.geomspace(cut.edges[k], cut.edges[k + 1], BINS + 1)[int(k > 0) :] for k in range(cut.count)]
    )
    q = np.sqrt(edges[1:] * edges[:-1])
    slopes = np.array([cut.spectrum.moment(float(a), float(b), 2) for a, b in pairwise(edges)])
    strains = strains_in_full_contact(q, slopes, np.arange(q.size) // BINS, cut.count)
    f, g = job.section("softening").made.factors(strains)
    each = (f"{strain:.2g} (f {a:.2g}, g {b:.2g})" for strain, a, b in zip(strains, f, g, strict=True))
    yield f"softening: strains of the bands in full contact {', '.join(each)}"


# -- bands -------------------------------------------------------------------------------------------------------------


class StrainProbe:
    """Measures the mean square strain S(z) at all depths in the contacts of a band, and the weights with which S(z)
    gives the square of the band's strain."""

    means: ClassVar[Means] = {"squares": by_power, "strain_weights": by_power}

    def __init__(self, job: Job, cut: Cut) -> None:
        self._depths = depths_between(float(cut.edges[0]), float(cut.edges[-1]))

    def slide(self, setup: Setup, velocity: Vector) -> None:
        """Do nothing, as this probe prepares nothing for a velocity."""

    def measure(self, setup: Setup, contact: Contact, velocity: Vector) -> dict[str, Array]:
        """Return the mean squares S(z) as `squares`, and their weights as `strain_weights`, for a contact; both have
        the shape (depths,)."""
        depths, all_waves = self._depths / setup.units.length, np.zeros(setup.fft.shape, np.int64)
        found = strains_of(setup, contact.u, velocity, depths, all_waves, 1)
        return {"squares": found.squares, "strain_weights": found.weights[0]}


def probes(job: Job, cut: Cut) -> Iterator[StrainProbe]:
    """Yield the probe that measures the strains of bands."""
    yield StrainProbe(job, cut)


class StrainsOfBands:
    """The loop that finds the strains of bands.

    The strain for the next iteration is a power mean of the old and the new strain of a band. A steady state starts
    from the strains of the last one.
    """

    moves = True
    words: ClassVar[tuple[str, str]] = ("strains", "")

    def __init__(self, job: Job, cut: Cut) -> None:
        self._table = job.section("softening").made
        self._strains = np.full(cut.count, self._table.start)
        self._enough = SHARE * job.numerics.asked.both[0]

    def begin(self, road: RoadSliding) -> None:
        """Do nothing: a new steady state starts from the strains of the last one."""

    def act(self, road: RoadSliding) -> None:
        road.set_factors(self._table.at, self._strains.tolist())

    def settles(self, road: RoadSliding, results: Results, changes: tuple[float, float], others: bool) -> bool:
        return changes[0] <= self._enough

    def move(self, road: RoadSliding, results: Results) -> None:
        self._strains = self._table.mixed(_strains_in(results), self._strains)

    def found(self, road: RoadSliding, point: Point, results: Results, changes: tuple[float, float]) -> Point:
        """Return the point with its strain amplitude added. This is the root of the mean square strain of all bands,
        weighted by their friction; NaN without friction."""
        weights = np.maximum([result.friction for result in results], 0.0)
        whole = math.sqrt(np.average(_strains_in(results) ** 2, weights=weights)) if weights.any() else math.nan
        return replace(point, errors=point.errors.with_rounds(*changes)).with_effect("softening", whole)

    def values(self, results: Results) -> Mapping[str, Sequence[float]]:
        return {"strain_amplitude": _strains_in(results).tolist()}


def _strains_in(results: Results) -> Array:
    """Return the strain of each band [-], which the waves of all bands cause, shape (bands,)."""
    squares = np.sum([result.found["squares"] for result in results], axis=0)
    return np.sqrt([result.found["strain_weights"] @ squares for result in results])


def band_loops(job: Job, cut: Cut) -> Iterator[StrainsOfBands]:
    """Yield the loop that finds the strains of bands."""
    yield StrainsOfBands(job, cut)

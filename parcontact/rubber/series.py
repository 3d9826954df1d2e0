"""Fits of Prony series, and of shifts with temperature, to measured moduli.

A Prony series gets as few branches as are needed for the loss modulus everywhere in the measured band:

    G*(w) = G_inf + sum_k G_k i w tau_k/(1 + i w tau_k),     G(t) = G_inf + sum_k G_k exp(-t/tau_k),     all G_k >= 0
    J(t)  = J_0 + sum_k J_k (1 - exp(-t/lambda_k)) + t/eta,  J*(w) = J_0 + sum_k J_k/(1 + i w lambda_k) + 1/(i w eta)

A relaxation modulus or a storage modulus hardly determines the loss modulus, on which friction depends. Therefore the
data are fitted twice. The first fit yields a dense spectrum (`Spectrum`), by non-negative least squares of the relative
errors with a penalty on the roughness of the spectrum. The penalty is the prior of a Gaussian process, so that the
spectrum has a covariance, and the loss modulus an error (G. Wahba, J. R. Statist. Soc. B 45 (1983) 133; J. Honerkamp,
J. Weese, Rheol. Acta 32 (1993) 65). The second fit yields the shortest series that fits both moduli of this spectrum
everywhere in the band. For creep data the modulus is 1/J*(w) of the spectrum (J. D. Ferry, Viscoelastic Properties of
Polymers (1980), chapter 3).

By a shift with temperature, moduli measured at several temperatures form one curve. The horizontal factors a_T, of
rates, and the vertical factors b_T, of moduli, are fitted together:

    G*(w, T) = b_T G*(a_T w, T_ref)

Rates are reduced by a_T and moduli divided by b_T, so that one series describes all sets. The constants of both laws
minimize the squared misfit of the best series (variable projection: G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10
(1973) 413). Factors b_T follow from the entropy of rubber (J. D. Ferry, Viscoelastic Properties of Polymers (1980),
chapter 11). If they were left out, the constants of a_T would have errors of a tenth and more.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, nnls

from .. import printed
from ..errors import InputError
from .moduli import Kind, Measurement, Set, scatter
from .shift import WLF, Arrhenius, Density, Factors, Shift, log_vertical

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Weigh = Literal["both", "storage", "loss"]
MOST = 48  # tuning: largest number of branches
DENSE = 6  # accuracy: times per decade of the dense spectrum
SPARE = 1.0  # accuracy: decades of the dense spectrum beyond the data on each side
ROUGH = 3.0  # fitted: prior of second differences of the spectrum over its mean (`scripts/fit_errors.py`)
BEYOND = 0.7  # fitted: prior of it beyond the data over that in the last decade (`scripts/fit_errors.py`)
FASTER = 3  # accuracy: decades of branches faster than the dense spectrum that count in the error of the loss modulus
LEAST_NOISE = 1e-4  # accuracy: least relative noise of a table
PER_DECADE = 10  # accuracy: frequencies per decade at which series and dense spectrum are compared
ENDS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)  # accuracy: decades beyond the data that a short series may have
NEAR_END = 0.5  # accuracy: length of the ends of a band [decades]
EARLIEST = 20.0  # accuracy: relaxation or creep from t on determines the loss up to a frequency of 1/(20 t)
NEGLIGIBLE = 1e-4  # accuracy: largest modulus of a dropped branch over the storage modulus
NOTHING = 1e-9  # rounding: least part of a modulus over its absolute value, as a divisor
Errors = tuple[float, float, float]


@dataclass(frozen=True)
class PronySeries:
    """A fitted Prony series: `modulus_inf` [Pa], `moduli` [Pa] and `times` [s], both of shape (n,), at the reference
    temperature.

    `error` is the rms relative misfit of the fitted data, and `best` is the smallest misfit of any series. `alone` has
    the smallest misfit if only the storage modulus is fitted, and if only the loss modulus is fitted. `scatter` is the
    relative scatter of the data of a sweep about a smooth curve, NaN if sweeps are too short. `band` [rad/s] is the
    range of frequencies in which moduli are known. `loss_errors` are the relative errors (two standard deviations) of
    the loss modulus inside this range, at its lower end and at its upper end.
    """

    modulus_inf: float
    moduli: Array
    times: Array
    error: float
    band: tuple[float, float]
    best: float
    alone: tuple[float, float]
    scatter: float
    loss_errors: Errors

    def modulus(self, omega: Array) -> ComplexArray:
        """Return G*(w) [Pa] at angular frequencies [rad/s], shape (n,)."""
        return np.asarray(complex_kernel(omega, "frequency", self.times) @ np.append(self.moduli, self.modulus_inf))

    def storage_at(self, omega: float) -> float:
        """Return G'(w) [Pa] at an angular frequency [rad/s]."""
        return float(self.modulus(np.array([omega]))[0].real)

    def response(self, kind: Kind, at: Array) -> Array:
        """Return the moduli [Pa] of the series in the form of a kind of measurement.

        With frequencies `at` [rad/s], shape (n,), these are all storage moduli followed by all loss moduli, shape
        (2 n,). With times `at` [s] they are G(t) or 1/J(t), shape (n,).
        """
        if kind == "creep":
            return 1.0 / self._creep(at)
        return np.asarray(kernel(at, kind, self.times) @ np.append(self.moduli, self.modulus_inf))

    def _creep(self, t: Array) -> Array:
        """Return J(t) [1/Pa]; retardation rates are the eigenvalues of a diagonal matrix plus a dyad."""
        instant, v = self.modulus_inf + self.moduli.sum(), np.sqrt(self.moduli / self.times)
        rates, vectors = np.linalg.eigh(np.diag(1.0 / self.times) - np.outer(v, v) / instant)
        rates = np.maximum(rates, np.finfo(float).tiny)
        weights = (v @ vectors) ** 2 / instant**2
        return np.asarray(1.0 / instant + (-np.expm1(-np.outer(t, rates)) / rates) @ weights)


def kernel(at: Array, kind: Kind, times: Array) -> Array:
    """Return the data that each term of a spectrum gives if its weight is 1, shape (number of data, number of weights).

    Terms with the relaxation or retardation `times` come first, then the spring, or for creep the instantaneous
    compliance and the fluidity. Data are those of `ReducedData` for a `kind` of measurement; data of creep are J.
    """
    if kind == "frequency":
        found = complex_kernel(at, kind, times)
        return np.vstack([found.real, found.imag])
    decay = np.exp(-at[:, None] / times)
    one = np.ones((at.size, 1))
    return np.hstack([decay, one] if kind == "time" else [1.0 - decay, one, at[:, None]])


def complex_kernel(omega: Array, kind: Kind, times: Array) -> ComplexArray:
    """Return G*, or J* for creep, of each term of a spectrum with the weight 1 at angular frequencies `omega` [rad/s].

    `omega` has the shape (n,), the result (n, number of weights), with the terms in the order of `kernel`.
    """
    z, one = 1j * omega[:, None] * times, np.ones((omega.size, 1))
    if kind == "creep":
        return np.hstack([1.0 / (1.0 + z), one, 1.0 / (1j * omega[:, None])])
    return np.hstack([z / (1.0 + z), one])


@dataclass(frozen=True)
class ReducedData:
    """The data of all sets, shifted to one temperature.

    `at`, shape (n,), are angular frequencies [rad/s] or times [s]. `moduli` [Pa] have the shape (n,) for G(t) or
    1/J(t), and (2 n,) for all storage moduli followed by all loss moduli. Only data in the slice `counts` of the moduli
    are fitted, such as the loss moduli.
    """

    kind: Kind
    at: Array
    moduli: Array
    counts: slice

    @property
    def counted(self) -> int:
        """Return the number of fitted data."""
        return len(self.moduli[self.counts])

    @property
    def rates(self) -> tuple[float, float]:
        """Return the lowest and the highest rate of the data [1/s]: angular frequencies, or inverse times."""
        rates = self.at if self.kind == "frequency" else 1.0 / self.at
        return float(rates.min()), float(rates.max())

    @property
    def band(self) -> tuple[float, float]:
        """Return the range of angular frequencies [rad/s] in which the data determine the moduli."""
        low, high = self.rates
        return (low, high) if self.kind == "frequency" else (low, 2 * math.pi / EARLIEST * high)

    def columns(self, times: Array) -> Array:
        """Return the `kernel` of the fitted data, divided by the data. Multiplied with the weights of an exact fit it
        is 1 for each of the data. For creep the kernel belongs to J, and is divided by J = 1/`moduli`."""
        found, data = kernel(self.at, self.kind, times), self.moduli[:, None]
        return np.asarray((found * data if self.kind == "creep" else found / data)[self.counts])

    def misfit(self, response: Array) -> float:
        """Return the rms difference between the logarithms of a response and of the fitted data."""
        ratio = np.maximum(response, np.finfo(float).tiny)[self.counts] / self.moduli[self.counts]
        return float(np.sqrt(np.mean(np.log(ratio) ** 2)))

    def find_spring(self, storage: Array) -> float:
        """Return the modulus [Pa] of the spring that a spectrum with the storage moduli `storage` [Pa] lacks.

        With this spring the mean relative deviation from the measured storage moduli is 0. The modulus is at least 0.
        """
        measured = self.moduli[: self.at.size]
        return max(0.0, float(np.mean(1.0 - storage / measured) / np.mean(1.0 / measured)))

    def exchanged_misfit(self) -> float:
        """Return the rms misfit of the best series after storage and loss moduli are exchanged."""
        moduli = np.roll(self.moduli, self.at.size)
        return _rms(best_residuals(replace(self, moduli=moduli, counts=slice(None))))


def reduce_sets(
    sets: Sequence[Set], kind: Kind, logs: tuple[Sequence[float], Sequence[float]] | None = None, weigh: Weigh = "both"
) -> ReducedData:
    """Return the data of all sets, shifted to one temperature. `logs` are log10 of a_T and of b_T of each set; without
    them nothing is shifted. `weigh` names the moduli that are fitted."""
    sign, (horizontal, vertical) = 1.0 if kind == "frequency" else -1.0, logs or [[0.0] * len(sets)] * 2
    shifted = list(zip(sets, horizontal, vertical, strict=True))
    at = np.concatenate([each.at * 10.0 ** (sign * a) for each, a, _ in shifted])
    moduli = [np.concatenate([getattr(each, part) / 10.0**b for each, _, b in shifted]) for part in ("storage", "loss")]
    counts = {"both": slice(None), "storage": slice(at.size), "loss": slice(at.size, None)}
    return ReducedData(kind, at, np.concatenate(moduli), counts[weigh if kind == "frequency" else "both"])


def best_residuals(data: ReducedData, per_decade: int = DENSE) -> Array:
    """Return the relative residuals of the fitted data for the series that fits them best, whose number of branches is
    free. Its relaxation times are chosen from `per_decade` times per decade."""
    low, high = data.rates
    first, last = (round(per_decade * (math.log10(1.0 / rate) + side)) for rate, side in ((high, -SPARE), (low, SPARE)))
    columns = data.columns(np.power(10.0, np.arange(first, last + 1) / per_decade))
    return np.asarray(columns @ _non_negative(columns) - 1.0)


def _non_negative(columns: Array, goal: Array | None = None) -> Array:
    goal = np.ones(len(columns)) if goal is None else goal
    return np.asarray(nnls(columns, goal, maxiter=100 * sum(columns.shape))[0])


@dataclass(frozen=True)
class Spectrum:
    """A dense spectrum: relaxation times [s] with weights [Pa], or for creep retardation times [s] with weights [1/Pa].

    `deviations` is a matrix whose product with its transpose is the covariance of the weights.
    """

    kind: Kind
    times: Array
    weights: Array
    deviations: Array

    @staticmethod
    def fit(data: ReducedData) -> "Spectrum":
        """Return the smooth spectrum that fits the data within their noise."""
        high, low = (-math.log10(rate) for rate in data.rates)
        inside = max(2, math.ceil((high - low) * DENSE)) + 1
        step, beyond = max(high - low, 0.1) / (inside - 1), round(SPARE * DENSE)
        times = np.power(10.0, low + step * np.arange(-beyond, inside + beyond))
        columns = data.columns(times)
        weights = _non_negative(columns)
        missed = columns @ weights - 1.0
        free = max(len(missed) - int(np.count_nonzero(weights)), (len(missed) + 1) // 2)
        noise = max(math.sqrt(float(missed @ missed) / free), LEAST_NOISE)
        prior = noise * _prior(inside, beyond, columns.shape[1] - times.size)
        goal = np.concatenate([np.ones(len(columns)), np.zeros(len(prior))])
        for _ in range(3):  # the scale depends on the spectrum
            scale = _scale(times, weights, slice(beyond, beyond + inside))
            system = np.vstack([columns * scale, prior])
            weights = scale * _non_negative(system, goal)
        if not columns[:, times.size].any():
            weights[times.size] = data.find_spring(kernel(data.at, data.kind, times)[: data.at.size] @ weights)
        fast, faster = _continue(times, scale)
        more = (data.columns(fast)[:, : fast.size] @ faster)[:, None]
        tail = np.vstack([more, np.zeros((len(prior), 1)), [[noise / math.hypot(1.0, BEYOND)]]])
        spread = noise * np.linalg.pinv(np.hstack([np.pad(system, ((0, 1), (0, 0))), tail]))
        deviations = np.vstack([faster[:, None] * spread[-1], scale[:, None] * spread[:-1]])
        weights = np.concatenate([np.zeros(fast.size), weights])
        return Spectrum(data.kind, np.concatenate([fast, times]), weights, deviations)

    def modulus(self, omega: Array) -> tuple[ComplexArray, Array]:
        """Return G* [Pa] at angular frequencies [rad/s], shape (n,), and the relative standard deviation of its
        imaginary part. Both parts are positive."""
        found = complex_kernel(omega, self.kind, self.times)
        modulus = found @ self.weights
        if self.kind == "creep":
            modulus = 1.0 / modulus
            found = -(modulus[:, None] ** 2) * found
        deviation = np.sqrt(np.sum((found.imag @ self.deviations) ** 2, axis=1))
        least = NOTHING * np.abs(modulus)
        storage, loss = np.maximum(modulus.real, least), np.maximum(modulus.imag, least)
        return storage + 1j * loss, deviation / loss


def _prior(inside: int, beyond: int, rest: int) -> Array:
    """Return rows that give 0 for a smooth spectrum that continues beyond the data as in the last decade."""
    count, last = inside + 2 * beyond, min(DENSE, inside)
    smooth = np.diff(np.eye(count), 2, axis=0) / ROUGH
    tails = np.eye(count)[[*range(beyond), *range(beyond + inside, count)]]
    tails[:beyond, beyond : beyond + last] -= 1.0 / last
    tails[beyond:, beyond + inside - last : beyond + inside] -= 1.0 / last
    return np.pad(np.vstack([smooth, tails / BEYOND]), ((0, 0), (0, rest)))


def _continue(times: Array, scale: Array) -> tuple[Array, Array]:
    """Return times [s] faster than all of a spectrum, the fastest last, and the weights of its power law there.

    They are 0 in the spectrum, as hardly any data determine them, but count in its covariance: weights with this mean
    and the prior BEYOND deviate from 0 by hypot(1, BEYOND) times the mean, all together.
    """
    steps = np.arange(1, FASTER * DENSE + 1)
    return times[0] * (times[0] / times[1]) ** steps, scale[0] * (scale[0] / scale[1]) ** steps


def _scale(times: Array, weights: Array, inside: slice) -> Array:
    """Return weights of a featureless spectrum: a share of the loss at each time, and a power law beyond the data."""
    z = times / times[:, None]
    logs = np.log(np.maximum((z / (1.0 + z**2)) @ weights[: times.size], 1e-30 * weights.max()))
    at = np.arange(times.size)
    for end, out in ((at[inside][: DENSE + 1], at[: inside.start]), (at[inside][-DENSE - 1 :], at[inside.stop :])):
        logs[out] = np.polyval(np.polyfit(end, logs[end], 1), out)
    share = float(np.mean(weights[: times.size][inside] / np.exp(logs[inside])))
    return np.concatenate([max(share, 1e-3) * np.exp(logs), np.ones(weights.size - times.size) * weights.max()])


def fit_series(data: ReducedData, error: float, sweeps: Sequence[tuple[Array, Array]] = ()) -> PronySeries:
    """Return the shortest series that fits the data as closely as the smooth spectrum does.

    At all rates of the data the relative differences between the moduli of the series and of the spectrum are at most
    hypot(`error`, d), where d is the relative standard deviation of the loss modulus, or `error` if this is smaller.
    The series has at least one branch per decade. `sweeps` are the rates and moduli from which the scatter is computed.
    """
    spectrum, (low, high), (slow, fast) = Spectrum.fit(data), data.band, data.rates
    decades = math.log10(fast / slow)
    within = _frequencies(slow, fast)
    omega = np.concatenate([within, _frequencies(slow / 10.0**NEAR_END, fast * 10.0**NEAR_END)])
    goal, deviation = spectrum.modulus(omega)
    least, measured = min(max(1, math.ceil(decades)), MOST), slice(within.size)
    allowed = np.hypot(error, np.minimum(deviation[measured], error))
    for count in printed.with_bar(range(least, MOST + 1), "number of branches", "branch"):
        tried = [_short(omega, goal, _times(data.rates, count, spare)) for spare in ENDS]
        distances = [_distance(omega[measured], goal[measured], allowed, *each) for each in tried]
        found = tried[int(np.argmin(distances))]
        if min(distances) <= 1.0:
            break
    times, weights = _thin(omega, goal, measured, allowed, found, least)
    omega = _frequencies(low, high)
    goal, deviation = spectrum.modulus(omega)
    missed = (complex_kernel(omega, "frequency", times) @ weights).imag / goal.imag - 1.0
    errors = 2.0 * np.hypot(deviation, missed)
    inner = (omega >= low * 10.0**NEAR_END) & (omega <= high / 10.0**NEAR_END)
    series = PronySeries(
        float(weights[-1]),
        weights[:-1],
        times,
        error=math.nan,
        band=(low, high),
        best=_rms(best_residuals(data)),
        alone=_alone(data),
        scatter=scatter(sweeps),
        loss_errors=(_rms(errors[inner if inner.any() else slice(None)]), float(errors[0]), float(errors[-1])),
    )
    return replace(series, error=data.misfit(series.response(data.kind, data.at)))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _alone(data: ReducedData) -> tuple[float, float]:
    """Return the misfits of storage and loss moduli if each is fitted alone."""
    if data.kind != "frequency":
        return math.nan, math.nan
    parts = slice(data.at.size), slice(data.at.size, None)
    storage, loss = (_rms(best_residuals(replace(data, counts=part))) for part in parts)
    return storage, loss


def _times(rates: tuple[float, float], count: int, spare: float) -> Array:
    """Return relaxation times [s] for a range of rates extended by `spare` decades, at the centres of `count` equal
    parts."""
    low, high = math.log10(1.0 / rates[1]) - spare, math.log10(1.0 / rates[0]) + spare
    step = (high - low) / count
    return np.asarray(10.0 ** (low + step * (0.5 + np.arange(count))))


def _short(omega: Array, goal: ComplexArray, times: Array) -> tuple[Array, Array]:
    """Return times and weights of the series that fits moduli best; negligible branches are dropped."""
    target = np.concatenate([goal.real, goal.imag])
    weights = _non_negative(kernel(omega, "frequency", times) / target[:, None])
    kept = weights[:-1] > _negligible(weights[:-1], times, float(weights[-1]))
    return times[kept], weights[np.append(kept, True)]


def _frequencies(low: float, high: float) -> Array:
    """Return angular frequencies [rad/s] with equal ratios, both ends included."""
    return np.geomspace(low, high, max(2, round(PER_DECADE * math.log10(high / low))) + 1)


def _distance(omega: Array, goal: ComplexArray, allowed: Array, times: Array, weights: Array) -> float:
    """Return the largest deviation of the moduli of a series from the goal, over the `allowed` deviation of the loss
    moduli, or over the least allowed one for storage moduli."""
    found = complex_kernel(omega, "frequency", times) @ weights
    loss, storage = np.abs(found.imag / goal.imag - 1.0), np.abs(found.real / goal.real - 1.0)
    return float(max((loss / allowed).max(), storage.max() / allowed.min()))


def _thin(
    omega: Array, goal: ComplexArray, measured: slice, allowed: Array, found: tuple[Array, Array], least: int
) -> tuple[Array, Array]:
    """Return times and weights without the weakest branches, as long as the series fits the goal without them."""
    while found[0].size > least:
        times, moduli = found[0], found[1][:-1]
        z = times / times[:, None]
        weakest = int(np.argmin(moduli / ((z / (1.0 + z**2)) @ moduli)))
        fewer = _short(omega, goal, np.delete(times, weakest))
        if _distance(omega[measured], goal[measured], allowed, *fewer) > 1.0:
            break
        found = fewer
    return found


def _negligible(moduli: Array, times: Array, spring: float) -> Array:
    """Return the modulus [Pa] at each time below which a branch is dropped: a share of the storage modulus at its
    frequency."""
    z = times / times[:, None]  # of the row's frequency
    return NEGLIGIBLE * (spring + (z**2 / (1.0 + z**2)) @ moduli)


Vertical = Literal["auto", "density", "free", "none"]
MOST_DECADES = 45.0  # tuning: largest shift between the coldest and the warmest set
CLOSE = 1e-4  # accuracy: relative change of constants and of the misfit at which a search ends
FAR = 1e3  # accuracy: residual assigned to impossible shifts
Ranges = tuple[tuple[float, float, int], ...]  # grid of constants of a law: from, to, number
WLF_CONSTANTS: Ranges = ((2.0, 60.0, 16), (20.0, 600.0, 16))  # physics: C1 [-], C2 [K]
ENERGIES: Ranges = ((1e4, 1e6, 40),)  # physics: J/mol
EXPANSION = 6e-4  # physics: expansion of rubbers [1/K], 5e-4 to 7e-4
COARSE = 3  # accuracy: times per decade of the series for first constants and warnings
STEP = 1e-4  # accuracy: relative step of finite differences
OVERLAP = 0.1  # accuracy: least overlap of two sweeps in a start, over the length of the shorter one
STEPS = 25  # accuracy: shifts that are tried between two neighbouring sweeps
ROUNDING = 1e-6  # accuracy: difference of misfits below which no law is better
BETTER = 0.7  # accuracy: misfit with free vertical factors over that without, below which there is a warning


@dataclass(frozen=True)
class Superposition:
    """A fitted shift, and its relative rms misfit. `free` is the result with a free vertical factor b_T at each
    temperature, or None unless its misfit is much smaller."""

    shift: Shift
    misfit: float
    free: "Superposition | None" = None


def superpose(
    measured: Measurement, reference: float, law: str | Shift, vertical: Vertical, weigh: Weigh = "both"
) -> Superposition:
    """Return the shift that joins the sets of a measurement to one curve at a reference temperature [deg C].

    `law` is the name of a law whose constants are fitted, wlf, arrhenius or free (a factor at each measured
    temperature), or a known shift. `vertical` is the law of b_T: `density`, `free` (a factor at each measured
    temperature), `none` (b_T = 1), or `auto` (density, unless none fits better). `weigh` names the moduli that are
    fitted. Raises InputError for fewer than two sets, and if no constants join them to one curve.
    """
    known = measured.temperatures
    if len(known) < 2:
        raise InputError(f"{measured.path}: a shift needs sweeps at two temperatures at least")
    if not known[0] <= reference <= known[-1] and isinstance(law, str):
        raise InputError(
            f"{measured.path}: the reference temperature must lie within {known[0]:g} and {known[-1]:g} C, "
            f"got {reference:g}"
        )
    search = _Search(measured, law, reference, weigh)
    start = search.start()
    if vertical != "auto":
        return search.refine(start, vertical)
    none, density = search.refine(start, "none"), search.refine(start, "density")
    free = search.refine(start, "free", COARSE)  # for a warning only
    chosen = density if density.misfit < none.misfit - ROUNDING else none
    return replace(chosen, free=free if free.misfit < BETTER * chosen.misfit else None)


@dataclass(frozen=True)
class _Search:
    measured: Measurement
    law: str | Shift
    reference: float
    weigh: Weigh

    @property
    def _known(self) -> list[float]:
        return self.measured.temperatures

    def start(self) -> Array:
        """Return initial constants of the horizontal law: logarithms of its constants, or log10 of the ratios of free
        factors to the first factor."""
        if not isinstance(self.law, str):
            return np.zeros(0)
        if self.law == "free":
            return self._join_neighbours()
        ranges = ENERGIES if self.law == "arrhenius" else WLF_CONSTANTS
        grid = [np.array(point) for point in itertools.product(*(np.log(np.geomspace(*each)) for each in ranges))]
        first = Density(EXPANSION, self.reference)
        points = printed.with_bar(grid, "shift with temperature", "law")
        tried = (self._residuals(replace(self._named(point), vertical=first), COARSE) for point in points)
        errors = [float(np.mean(residuals**2)) for residuals in tried]
        if min(errors) >= FAR**2:
            raise InputError(
                f"{self.measured.path}: no constants of this law join the sweeps to one curve at {self.reference:g} C"
            )
        return grid[int(np.argmin(errors))]

    def _join_neighbours(self) -> Array:
        """Return log10 of a_T over that of the coldest sweep. Each sweep continues its colder neighbour, since no law
        holds on both sides of a glass transition; sweeps that do not overlap are shifted as by WLF."""
        steps = np.array([self._step(*pair) for pair in pairwise(self.measured.sets)])
        if np.isnan(steps).any():
            law = replace(self, law="wlf")
            logs = log_factors(law.refine(law.start(), "none", COARSE).shift, self._known)[0]
            steps = np.where(np.isnan(steps), -np.diff(logs), steps)
        return -np.cumsum(steps)

    def _step(self, cold: Set, warm: Set) -> float:
        """Return log10 of a_T of the first sweep over that of the second for which both fit one series best;
        NaN if they would hardly overlap."""
        length = min(float(np.log10(each.at.max() / each.at.min())) for each in (cold, warm))
        steps = np.linspace(0.0, (1.0 - OVERLAP) * length, STEPS)
        pairs = (reduce_sets((cold, warm), self.measured.kind, ([s, 0.0], [0.0, 0.0]), self.weigh) for s in steps)
        best = int(np.argmin([np.sum(best_residuals(pair, COARSE) ** 2) for pair in pairs]))
        return float(steps[best]) if best < STEPS - 1 else math.nan

    def _named(self, constants: Array) -> WLF | Arrhenius:
        values = [float(value) for value in np.exp(constants)]
        return Arrhenius(values[0], self.reference) if len(values) == 1 else WLF(values[0], values[1], self.reference)

    def _horizontal(self, constants: Array) -> Shift:
        if not isinstance(self.law, str):
            return self.law
        if self.law == "free":
            return _factors(self._known, [0.0, *constants], self.reference)
        return self._named(constants)

    def _vertical(self, kind: Vertical, constants: Array) -> Density | Factors | None:
        if kind == "free":
            return _factors(self._known, [0.0, *constants], self.reference)
        return Density(EXPANSION, self.reference) if kind == "density" else None

    def refine(self, start: Array, kind: Vertical, per_decade: int = DENSE) -> Superposition:
        """Return the best shift near initial constants, with the vertical law `kind`. Shifts are compared by series of
        `per_decade` times per decade."""
        if self.law == "free" and kind == "free":
            return self._refine_both(start, per_decade)
        return self._refine(start, np.zeros(len(self._known) - 1 if kind == "free" else 0), kind, per_decade)

    def _refine_both(self, start: Array, per_decade: int) -> Superposition:
        """Return free factors of both kinds, from those without b_T or from WLF with b_T, whichever leaves more sweeps
        overlapping, or else fits better."""
        law = replace(self, law="wlf")
        shifts = [self.refine(start, "none", per_decade).shift, law.refine(law.start(), "free", per_decade).shift]
        logs = [[np.array(log[1:]) - log[0] for log in log_factors(shift, self._known)] for shift in shifts]
        found = [self._refine(a, b, "free", per_decade) for a, b in logs]
        return min(found, key=lambda each: (self._separate(each.shift), each.misfit))

    def _separate(self, shift: Shift) -> int:
        """Return how many sweeps do not overlap their warmer neighbour after a shift."""
        sign, ends = 1.0 if self.measured.kind == "frequency" else -1.0, []
        for each, log in zip(self.measured.sets, log_factors(shift, self._known)[0], strict=True):
            ends.append(np.log10([each.at.min(), each.at.max()]) + sign * log)
        return sum(bool(max(cold[0], warm[0]) > min(cold[1], warm[1])) for cold, warm in pairwise(ends))

    def _refine(self, start: Array, verticals: Array, kind: Vertical, per_decade: int) -> Superposition:
        begin = np.concatenate([start, verticals])

        def shift(constants: Array) -> Shift:
            return replace(
                self._horizontal(constants[: start.size]), vertical=self._vertical(kind, constants[start.size :])
            )

        if begin.size:
            begin = least_squares(
                lambda constants: self._residuals(shift(constants), per_decade),
                begin,
                x_scale=0.1,
                diff_step=STEP,
                xtol=CLOSE,
                ftol=CLOSE,
            ).x
        found = shift(begin)
        return Superposition(found, _rms(best_residuals(self._reduced(found))))

    def _residuals(self, shift: Shift, per_decade: int) -> Array:
        """Return the residuals of the best series for a shift; FAR where a law ends, and for a shift over more than
        MOST_DECADES between the measured temperatures."""
        try:
            if np.ptp([shift.log_factor(t) for t in self._known]) <= MOST_DECADES:
                return best_residuals(self._reduced(shift), per_decade)
        except InputError:
            pass
        return np.full(reduce_sets(self.measured.sets, self.measured.kind, weigh=self.weigh).counted, FAR)

    def _reduced(self, shift: Shift) -> ReducedData:
        return reduce_sets(self.measured.sets, self.measured.kind, log_factors(shift, self._known), self.weigh)


def log_factors(shift: Shift, temperatures: Sequence[float]) -> tuple[list[float], list[float]]:
    """Return log10 of a_T and of b_T at temperatures [deg C]."""
    return [shift.log_factor(t) for t in temperatures], [log_vertical(shift, t) for t in temperatures]


def _factors(temperatures: Sequence[float], logs: Sequence[float], reference: float) -> Factors:
    """Return factors that are 1 at the reference; beyond the temperatures they equal the nearest one."""
    known = sorted({*temperatures, min(reference, temperatures[0]), max(reference, temperatures[-1])})
    there = float(np.interp(reference, temperatures, logs))
    return Factors(tuple(known), tuple(float(log - there) for log in np.interp(known, temperatures, logs)), reference)

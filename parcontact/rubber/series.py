"""A Prony series from measured moduli: non-negative least squares on a logarithmic grid of relaxation times.

    G'(w) = G_inf + sum_k G_k (w tau_k)^2/(1 + (w tau_k)^2),    G''(w) = sum_k G_k w tau_k/(1 + (w tau_k)^2),
    G(t)  = G_inf + sum_k G_k exp(-t/tau_k),                    all G_k >= 0, G_inf >= 0.

Errors are relative, so that the plateau of the glass does not hide that of the rubber. As few times as meet the error
asked for are kept. (M. Baumgaertel, H. H. Winter, Rheol. Acta 28 (1989) 511; C. L. Lawson, R. J. Hanson, Solving Least
Squares Problems (1974), chapter 23.)
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize, nnls

from .. import progress
from ..errors import InputError
from .sane import scatter
from .shift import WLF, Arrhenius, Factors, Shift
from .tables import Measurement, Set

Array = NDArray[np.float64]
Weigh = Literal["both", "storage", "loss"]
DENSE = 3  # accuracy: times per decade of the best series that is looked for
MOST = 48  # tuning: branches
NEGLIGIBLE = 1e-4  # accuracy: of the storage modulus, for a branch that is left out
SPARE = 0.5  # accuracy: decades of times beyond the data, to either side
ENDS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)  # accuracy: decades beyond the data that are tried for a short series
WIDEST = 8.0  # tuning: decades: the largest shift between neighbouring temperatures that is looked for
MOST_DECADES = 30.0  # tuning: of shift between the coldest and the warmest set
Ranges = tuple[tuple[float, float, int], ...]  # from, to, how many: where the constants of a law are looked for
WLF_CONSTANTS: Ranges = ((2.0, 60.0, 24), (20.0, 600.0, 24))  # physics: C1 [-], C2 [K]
ENERGIES: Ranges = ((1e4, 1e6, 60),)  # physics: J/mol
APART = 0.1  # accuracy: rms of the differences of the logarithms of two sets that do not overlap
SHORTEST = 0.3  # accuracy: share of a sweep that must overlap with its neighbour's


@dataclass(frozen=True)
class Series:
    """`modulus_inf` [Pa], `moduli` [Pa] and `times` [s], shape (n,), at the reference temperature.

    `error` is the rms of the logarithms of fitted over measured moduli, of those that count; `best` that of a dense
    series, than which none is better; `alone` the same of storage and of loss without the other; `scatter` that of
    neighbours of one sweep about a smooth curve, nan if sweeps are too short to tell; `band` [rad/s] holds the reduced
    frequencies of the data (of relaxation: the inverse times).
    """

    modulus_inf: float
    moduli: Array
    times: Array
    error: float
    band: tuple[float, float] = (0.0, 0.0)
    best: float = math.nan
    alone: tuple[float, float] = (math.nan, math.nan)
    scatter: float = math.nan


def fit(
    sets: Sequence[Set], kind: str, error: float, shifts: Sequence[float] | None = None, weigh: Weigh = "both"
) -> Series:
    """The shortest series that meets an rms error of the logarithms; `shifts` are log10 a_T of the sets, and `weigh`
    says which of the moduli counts.

    What no series meets, as a dense one leaves it, is allowed besides, as a square.
    """
    at, data = _reduced(sets, kind, shifts or [0.0] * len(sets))
    rates = at if kind == "frequency" else 1.0 / at
    band = float(rates.min()), float(rates.max())
    weigh = weigh if kind == "frequency" else "both"
    dense = _solve(at, data, kind, _dense(*band), weigh)
    goal = math.hypot(error, dense.error)
    for count in progress.with_bar(range(1, MOST + 1), "number of branches", "branch"):
        tried = [_solve(at, data, kind, _grid(band, count, spare), weigh) for spare in ENDS]
        found = min(tried, key=lambda series: series.error)
        if found.error <= goal:
            break
    else:
        found = dense
    of_one: tuple[Weigh, Weigh] = ("storage", "loss")
    known = kind == "frequency"
    alone = [_solve(at, data, kind, _dense(*band), one).error for one in of_one] if known else [dense.error, math.nan]
    sweeps = [(each.at, moduli) for each in sets for moduli in (each.storage, each.loss) if moduli.size]
    return replace(found, band=band, best=dense.error, alone=(alone[0], alone[1]), scatter=scatter(sweeps))


def swapped(sets: Sequence[Set], shifts: Sequence[float] | None = None) -> float:
    """Return the error of a dense series for which storage and loss moduli are taken for each other."""
    other = [replace(each, storage=each.loss, loss=each.storage) for each in sets]
    at, data = _reduced(other, "frequency", shifts or [0.0] * len(sets))
    return _solve(at, data, "frequency", _dense(float(at.min()), float(at.max()))).error


def _grid(band: tuple[float, float], count: int, spare: float = SPARE) -> Array:
    """Relaxation times [s] over a band of rates and some decades beyond, in the middles of equal parts of it."""
    low, high = math.log10(1.0 / band[1]) - spare, math.log10(1.0 / band[0]) + spare
    step = (high - low) / count
    return np.asarray(10.0 ** (low + step * (0.5 + np.arange(count))))


def _reduced(sets: Sequence[Set], kind: str, shifts: Sequence[float]) -> tuple[Array, Array]:
    """Reduced rates or times of all sets, shape (n,), and their moduli, shape (n,) or (2 n,): storage before loss."""
    sign = 1.0 if kind == "frequency" else -1.0
    at = np.concatenate([each.at * 10.0 ** (sign * log) for each, log in zip(sets, shifts, strict=True)])
    storage, loss = (np.concatenate([getattr(each, name) for each in sets]) for name in ("storage", "loss"))
    return at, np.concatenate([storage, loss])


def _columns(at: Array, kind: str, times: Array) -> Array:
    """Return the contributions to the data of a unit modulus of each time, and of none (the last column)."""
    if kind == "time":
        return np.hstack([np.exp(-at[:, None] / times), np.ones((at.size, 1))])
    z = at[:, None] * times
    storage = np.hstack([z**2 / (1.0 + z**2), np.ones((at.size, 1))])
    return np.vstack([storage, np.hstack([z / (1.0 + z**2), np.zeros((at.size, 1))])])


def _solve(at: Array, data: Array, kind: str, times: Array, weigh: Weigh = "both") -> Series:
    """The best moduli >= 0 for given times; those that are 0 are left out."""
    columns = _columns(at, kind, times)
    counts = {"both": slice(None), "storage": slice(at.size), "loss": slice(at.size, None)}[weigh]
    scaled = columns[counts] / data[counts, None]
    found = nnls(scaled, np.ones(len(scaled)), maxiter=100 * times.size + 100)[0]
    fitted = np.maximum(columns[counts] @ found, np.finfo(float).tiny)
    error = float(np.sqrt(np.mean(np.log(fitted / data[counts]) ** 2)))
    if weigh == "loss":  # which does not see the spring: that is what the storage modulus lacks in the mean
        storage = data[: at.size]
        found[-1] = max(0.0, float(np.mean(1.0 - columns[: at.size] @ found / storage) / np.mean(1.0 / storage)))
    *moduli, spring = found
    kept = np.asarray(moduli) > _negligible(np.asarray(moduli), times, float(spring))
    return Series(float(spring), np.asarray(moduli)[kept], times[kept], error)


def _negligible(moduli: Array, times: Array, spring: float) -> Array:
    """Return the modulus of each time [Pa] below which nobody would see that it is left out: a share of the storage
    modulus at its frequency."""
    z = times / times[:, None]  # of the row's frequency
    return NEGLIGIBLE * (spring + (z**2 / (1.0 + z**2)) @ moduli)


# -- the shift of measured sets ----------------------------------------------------------------------------------------


def find_shift(measured: Measurement, reference: float, law: str, weigh: Weigh = "both") -> Shift:
    """A law (`wlf`, `arrhenius` or `free`, for factors at the measured temperatures) that joins the sets of a
    measurement to one curve at a reference temperature [deg C].

    The constants of a law are those for which one Prony series meets all sets best; free factors move each set until it
    overlaps best with its neighbour. Raises InputError where the sets are too few or do not overlap.
    """
    known = measured.temperatures
    if len(known) < 2:
        raise InputError(f"{measured.path}: a shift needs sweeps at two temperatures at least")
    if not known[0] <= reference <= known[-1]:
        raise InputError(
            f"{measured.path}: the reference temperature must lie within {known[0]:g} and {known[-1]:g} C, "
            f"got {reference:g}"
        )
    if law == "free":
        logs = _overlaps(measured)
        there = float(np.interp(reference, known, logs))
        return Factors(tuple(known), tuple(float(log - there) for log in logs), reference)
    return _fitted(measured, WLF_CONSTANTS if law == "wlf" else ENERGIES, reference, weigh)


def _overlaps(measured: Measurement) -> list[float]:
    """log10 of the shift of each set against the first, one neighbour after the other."""
    logs = [0.0]
    for colder, warmer in pairwise(measured.sets):
        steps = np.linspace(-WIDEST, WIDEST, 16 * int(WIDEST) + 1)
        apart = [_apart(colder, warmer, step, measured.kind) for step in steps]
        if not min(apart) < APART**2:
            raise InputError(
                f"{measured.path}: the sweeps at {colder.temperature:g} and {warmer.temperature:g} C do not overlap at "
                "any shift; measure at temperatures nearer to each other, or fit a law: --shift wlf"
            )
        near = float(steps[int(np.argmin(apart))])
        fine = np.linspace(near - 0.15, near + 0.15, 61)
        logs.append(logs[-1] + float(fine[int(np.argmin([_apart(colder, warmer, s, measured.kind) for s in fine]))]))
    return logs


def _apart(colder: Set, warmer: Set, log: float, kind: str) -> float:
    """Mean square of the differences of the logarithms where two sets overlap; infinite where they do so too little."""
    sign = 1.0 if kind == "frequency" else -1.0
    own, other = np.log10(colder.at), np.log10(warmer.at) + sign * log
    low, high = max(own[0], other[0]), min(own[-1], other[-1])
    if high - low < SHORTEST * min(np.ptp(own), np.ptp(other)):
        return math.inf
    points = np.linspace(low, high, 40)
    pairs = [(colder.storage, warmer.storage), *([(colder.loss, warmer.loss)] if colder.loss.size else [])]
    squares = [
        np.mean((np.interp(points, own, np.log(a)) - np.interp(points, other, np.log(b))) ** 2) for a, b in pairs
    ]
    return float(np.mean(squares))


def _fitted(measured: Measurement, ranges: Ranges, reference: float, weigh: Weigh) -> Shift:
    """The constants for which one dense series meets all sets best: of a grid, then near to the best of these."""

    def law(constants: Array) -> WLF | Arrhenius:
        values = [float(value) for value in np.exp(constants)]
        return WLF(values[0], values[1], reference) if len(values) == 2 else Arrhenius(values[0], reference)

    def error(constants: Array) -> float:
        try:
            shifts = [law(constants).log_factor(t) for t in measured.temperatures]
        except InputError:
            return math.inf
        if max(shifts) - min(shifts) > MOST_DECADES:
            return math.inf
        at, data = _reduced(measured.sets, measured.kind, shifts)
        rates = at if measured.kind == "frequency" else 1.0 / at
        return _solve(at, data, measured.kind, _dense(float(rates.min()), float(rates.max())), weigh).error

    grid = [np.array(point) for point in itertools.product(*(np.log(np.geomspace(*each)) for each in ranges))]
    errors = [error(point) for point in progress.with_bar(grid, "shift with temperature", "law")]
    start = grid[int(np.argmin(errors))]
    if not math.isfinite(error(start)):
        raise InputError(f"{measured.path}: no constants of this law join the sweeps to one curve at {reference:g} C")
    simplex = np.vstack([start, start + 0.05 * np.eye(start.size)])
    options = {"initial_simplex": simplex, "xatol": 1e-4, "fatol": 1e-8, "maxfev": 200}
    return law(minimize(error, start, method="Nelder-Mead", options=options).x)


def _dense(low: float, high: float) -> Array:
    """Relaxation times for rates from `low` to `high` [1/s], as many as tell one measured point from the next."""
    decades = math.log10(high / low) + 2 * SPARE
    return _grid((low, high), min(MOST, math.ceil(DENSE * decades) + 1))

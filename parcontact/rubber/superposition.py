"""Time-temperature superposition of measured sets: horizontal factors a_T and vertical factors b_T, fitted together.

    G*(w, T) = b_T G*(a_T w, T_ref)

Rates are reduced by a_T and moduli divided by b_T, so that one series describes all sets. The constants of both laws
minimize the squared misfit of the best series (variable projection: G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10
(1973) 413). Without b_T, a consequence of the entropy of rubber (J. D. Ferry, Viscoelastic Properties of Polymers
(1980), chapter 11), constants of a_T have errors of a tenth and more.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from .. import progress
from ..errors import InputError
from .measured_moduli import Measurement, Set
from .series import DENSE, ReducedData, Weigh, best_residuals, reduce_sets
from .shift import WLF, Arrhenius, Density, Factors, Shift, log_vertical

Array = NDArray[np.float64]
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
    """A fitted shift, its `misfit` (rms, relative), and the result with `free` vertical factors if that is
    much better."""

    shift: Shift
    misfit: float
    free: "Superposition | None" = None


def superpose(
    measured: Measurement, reference: float, law: str | Shift, vertical: Vertical, weigh: Weigh = "both"
) -> Superposition:
    """Return the shift that joins the sets of a measurement to one curve at a reference temperature [deg C].

    `law` is wlf, arrhenius or free (factors at the measured temperatures), whose constants are fitted, or a known
    shift. `vertical` is the law of b_T: density, free factors, none (1), or (auto) density unless the data prefer
    none. Raises InputError if the sets are too few or do not overlap.
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
        """Return initial constants of the horizontal law: their logarithms, or log10 of free factors over the first."""
        if not isinstance(self.law, str):
            return np.zeros(0)
        if self.law == "free":
            return self._join_neighbours()
        ranges = ENERGIES if self.law == "arrhenius" else WLF_CONSTANTS
        grid = [np.array(point) for point in itertools.product(*(np.log(np.geomspace(*each)) for each in ranges))]
        first = Density(EXPANSION, self.reference)
        points = progress.with_bar(grid, "shift with temperature", "law")
        errors = [self._misfit(replace(self._named(point), vertical=first)) for point in points]
        if not math.isfinite(min(errors)):
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
        """Return the best shift near initial constants, with a vertical law of a kind. Shifts are compared by series of
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

        def missed(constants: Array) -> Array:
            try:
                tried = shift(constants)
                if self._spread(tried) <= MOST_DECADES:
                    return best_residuals(self._reduced(tried), per_decade)
            except InputError:  # where a law ends
                pass
            return np.full(self._reduced(None).counted, FAR)

        if begin.size:
            begin = least_squares(missed, begin, x_scale=0.1, diff_step=STEP, xtol=CLOSE, ftol=CLOSE).x
        found = shift(begin)
        return Superposition(found, float(np.sqrt(np.mean(best_residuals(self._reduced(found)) ** 2))))

    def _reduced(self, shift: Shift | None) -> ReducedData:
        sets, kind = self.measured.sets, self.measured.kind
        if shift is None:
            return reduce_sets(sets, kind, weigh=self.weigh)
        return reduce_sets(sets, kind, log_factors(shift, self._known), self.weigh)

    def _spread(self, shift: Shift) -> float:
        """Return the shift between the measured temperatures [decades]."""
        return float(np.ptp([shift.log_factor(t) for t in self._known]))

    def _misfit(self, shift: Shift) -> float:
        try:
            if not self._spread(shift) <= MOST_DECADES:
                return math.inf
        except InputError:
            return math.inf
        return float(np.mean(best_residuals(self._reduced(shift), COARSE) ** 2))


def log_factors(shift: Shift, temperatures: Sequence[float]) -> tuple[list[float], list[float]]:
    """Return log10 of a_T and of b_T at temperatures [deg C]."""
    return [shift.log_factor(t) for t in temperatures], [log_vertical(shift, t) for t in temperatures]


def _factors(temperatures: Sequence[float], logs: Sequence[float], reference: float) -> Factors:
    """Return factors that are 1 at the reference; beyond the temperatures they equal the nearest one."""
    known = sorted({*temperatures, min(reference, temperatures[0]), max(reference, temperatures[-1])})
    there = float(np.interp(reference, temperatures, logs))
    return Factors(tuple(known), tuple(float(log - there) for log in np.interp(known, temperatures, logs)), reference)

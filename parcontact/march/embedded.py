"""The embedded pair: the difference between a step by one integrator and the same step by another.

Both integrators start from the same state and assume the same motion. An integrator turns the branch maps h_k at the
start of a step and the increments du of the displacement into `A p = G_inf u + sum_k h_k` at its end. The quadratic
integrator is compared with the linear one, from which it differs by

    e = (sum_k G_k kappa q_k) (du - r du_before)                                               (`physics.body`),

and a linear step, as after a jump, with backward Euler, with z_k = dt/tau_k,

    e = sum_k (exp(-z_k) - 1/(1 + z_k)) h_k + sum_k G_k ((1 - exp(-z_k))/z_k - 1/(1 + z_k)) du.

The comparison takes no further solve. The rms of e divided by the rms of `A p`, both weighted by the pressure, measures
the time error. A sample suffices: evenly spaced rows, SAMPLED_ROWS in full contact, more at smaller contact areas (by
the square root of the ratio). If the sample misses the contact, as for a small sphere, all rows are used.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..parallel.slab import Array, Slab
from ..physics import loops
from ..physics.body import BodyMemory, Trial, ZenerBody, surface_of
from ..physics.prony import Advance, coefficients

SAMPLED_ROWS = 8  # accuracy: least number of sampled rows; the error of the difference is 5 %
LEAST_VARIANCE = 1e-6  # accuracy: least variance of heights over their mean square, set by rounding
MISSED = 0.5  # accuracy: relative error of the load of a sample above which all rows are used


@dataclass(frozen=True)
class IntegratorDifference:
    """Result of the embedded pair for one step. All rms values are weighted by the pressure.

    `difference` is relative, and grows with the step length to the power `order`. `slope` is the rms slope of the
    surface along x, in units of heights per unit of length. `angle` is the rms change of the displacement in the step
    divided by the standard deviation of heights: in full contact the angle by which a wave turns.
    """

    difference: float
    slope: float
    order: float = 2.0
    angle: float = 0.0


class _Weights(NamedTuple):
    """Weights in e of the branch maps, of du and of du_before, and the order of e in dt."""

    decay: Array
    gain: float
    back: float
    order: float


class EmbeddedPair:
    """Comparison of integrators in the steps of a relaxing body, on cells of length `dx`. It allocates no maps."""

    def __init__(self, slab: Slab, material: ZenerBody, dx: float) -> None:
        self.slab, self.material, self.dx = slab, material, dx
        self._kept: tuple[tuple[float, ...], _Weights] | None = None

    def compare(
        self,
        dt: float,
        trial: Trial,
        memory: BodyMemory,
        pressure: Array,
        displacement: Array,
        load: float,
        share: float,
        growth: float = 0.0,
    ) -> IntegratorDifference:
        """Compare the integrators in a step under load; `memory` is the memory of the body after the step. One or two
        messages; collective.

        `pressure` has the sum `load` over all ranks, on a `share` of the points; `displacement` is `A p/alpha`.
        `growth` is dt over the length of the step before.
        """
        weights = self._weights(dt, growth)
        seen, *sums = self._add(weights, trial, memory, pressure, displacement, self.stride(share))
        if abs(self.stride(share) * seen - load) > MISSED * load:
            seen, *sums = self._add(weights, trial, memory, pressure, displacement, 1)
        if seen <= 0.0:
            return IntegratorDifference(0.0, 0.0)
        change, size, rise, height, square, turned = sums
        slope = math.sqrt(rise / seen) / (2.0 * self.dx)
        variance = square / seen - (height / seen) ** 2
        angle = math.sqrt(turned / seen / variance) if variance > LEAST_VARIANCE * square / seen else 0.0
        difference = math.sqrt(change / size) if size > 0.0 else 0.0
        return IntegratorDifference(difference, slope, weights.order, angle)

    def compare_without_load(
        self, dt: float, trial: Trial, memory: BodyMemory, growth: float = 0.0
    ) -> IntegratorDifference:
        """Compare the integrators in a step without load; `memory` is the memory of the body after the step. The result
        is the rms difference divided by the rms displacement; collective."""
        u, weights = surface_of(memory), self._weights(dt, growth)
        _, change, size, *_ = self._add(weights, trial, memory, np.ones_like(u), u, self.stride(1.0))
        return IntegratorDifference(math.sqrt(change / size) if size > 0.0 else 0.0, 0.0, weights.order)

    def stride(self, share: float) -> int:
        """Return the distance between sampled rows if a `share` of the points is in contact."""
        return max(1, int(self.slab.ny * math.sqrt(share) / SAMPLED_ROWS))

    def _add(
        self, weights: _Weights, trial: Trial, memory: BodyMemory, pressure: Array, displacement: Array, stride: int
    ) -> list[float]:
        """Return the sums of `loops.embedded` over all ranks."""
        decay, gain, back = weights.decay / trial.alpha, weights.gain / trial.alpha, weights.back / trial.alpha
        maps = (memory.branches, decay, memory.increment, gain, memory.before, back, pressure, displacement)
        return self.slab.sum(*loops.embedded(*maps, *trial.heights.parts, -self.slab.rows.start % stride, stride))

    def _weights(self, dt: float, growth: float) -> _Weights:
        """Return the weights of a step; they are kept for further steps of the same length."""
        step = dt, growth, self.material.time_factor
        if self._kept is None or self._kept[0] != step:
            body, pair = self.material, self._pair(dt, growth)
            gain, back = float(pair.gain[body.moving].sum()), float(pair.back[body.moving].sum())
            self._kept = step, _Weights(pair.decay[body.kept], gain, back, self._order(dt, growth, gain))
        return self._kept[1]

    def _pair(self, dt: float, growth: float) -> Advance:
        """Return the differences of the coefficients of two integrators."""
        curved = self.material.integrator == "exponential" and growth > 0.0
        names = ("exponential", "exponential-linear") if curved else ("exponential-linear", "backward-euler")
        one, other = (coefficients(self.material.prony, name, dt, growth) for name in names)
        return Advance(one.decay - other.decay, one.gain - other.gain, one.back - other.back)

    def _order(self, dt: float, growth: float, gain: float) -> float:
        """Return the order of e in dt from the weight `gain` of du, which is proportional to dt. With the linear step
        and backward Euler it is 2 if all branches are slow, and 1 if some are fast; with the quadratic step it is one
        more."""
        more = 1.0 if self.material.integrator == "exponential" and growth > 0.0 else 0.0
        shorter = float(self._pair(0.5 * dt, growth).gain[self.material.moving].sum())
        return 1.0 + more + math.log2(gain / shorter) if dt > 0.0 and gain > 0.0 and shorter > 0.0 else 2.0 + more

"""The embedded pair: what a step would have been with another integrator, from the same state and motion.

Integrators turn the branch maps h_k of the start of a step and the increments du of the displacement into
`A p = G_inf u + sum_k h_k` of its end. The quadratic one is compared with the linear one, which differs by

    e = (sum_k G_k kappa q_k) (du - r du_before)                                               (`physics.body`),

and where a step is linear, as after a jump, the linear one with backward Euler, with z_k = dt/tau_k,

    e = sum_k (exp(-z_k) - 1/(1 + z_k)) h_k + sum_k G_k ((1 - exp(-z_k))/z_k - 1/(1 + z_k)) du.

This takes no further solve. Its size over that of `A p`, both as rms under the pressure, is the measure of the time
error. A sample will do: rows dealt evenly, SAMPLED_ROWS of them in full contact, more by the root of the ratio where
the contact is a smaller share of the map, which costs a small part of a pass over the branches. Where the sample misses
the contact, as that of a small sphere, all rows are looked at.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..parallel.slab import Array, Slab
from ..physics import loops
from ..physics.body import BodyMemory, Trial, ZenerBody, surface_of
from ..physics.prony import Advance, coefficients

SAMPLED_ROWS = 8  # accuracy: at least, if a map has as many: the difference is then within 5 % of that on all rows
LEAST_VARIANCE = 1e-6  # accuracy: of heights, over their mean square: less is rounding
MISSED = 0.5  # accuracy: of the load, by which that of a sample is off where it does not stand for all rows


@dataclass(frozen=True)
class IntegratorDifference:
    """Relative difference of the pair; the rms slope along x of the surface under the pressure, in the unit of
    heights over that of lengths; the power of the length of the step with which the difference grows; the rms of what
    the displacement changes by in the step over the standard deviation of heights, both under the pressure: in full
    contact the angle by which a wave turns that is as high and changes as much."""

    difference: float
    slope: float
    order: float = 2.0
    angle: float = 0.0


class EmbeddedPair:
    """Observations at the steps of a relaxing body on cells of length `dx`; allocates nothing."""

    def __init__(self, slab: Slab, material: ZenerBody, dx: float) -> None:
        self.slab, self.material, self.dx = slab, material, dx

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
        """Compare the integrators in a step, with the `memory` of the body after it: the solver's pressure, whose sum
        over all ranks is `load`, on a `share` of the points, and displacement, `A p/alpha`. The step is `growth` times
        as long as the one before. One message, or two; collective."""
        pair = self._pair(dt, growth)
        seen, *sums = self._add(pair, trial, memory, pressure, displacement, self.stride(share))
        if abs(self.stride(share) * seen - load) > MISSED * load:
            seen, *sums = self._add(pair, trial, memory, pressure, displacement, 1)
        if seen <= 0.0:
            return IntegratorDifference(0.0, 0.0)
        apart, size, rise, height, square, turned = sums
        slope = math.sqrt(rise / seen) / (2.0 * self.dx)
        variance = square / seen - (height / seen) ** 2
        angle = math.sqrt(turned / seen / variance) if variance > LEAST_VARIANCE * square / seen else 0.0
        difference = math.sqrt(apart / size) if size > 0.0 else 0.0
        return IntegratorDifference(difference, slope, self._order(dt, growth), angle)

    def compare_without_load(
        self, dt: float, trial: Trial, memory: BodyMemory, growth: float = 0.0
    ) -> IntegratorDifference:
        """Compare the integrators in a step in which nothing presses, with the `memory` of the body after it: the
        difference over the displacement, both as rms; collective."""
        u = surface_of(memory)
        _, apart, size, *_ = self._add(self._pair(dt, growth), trial, memory, np.ones_like(u), u, self.stride(1.0))
        return IntegratorDifference(math.sqrt(apart / size) if size > 0.0 else 0.0, 0.0, self._order(dt, growth))

    def stride(self, share: float) -> int:
        """Return the rows from one sampled row to the next, where that share of the points is in contact."""
        return max(1, int(self.slab.ny * math.sqrt(share) / SAMPLED_ROWS))

    def _add(
        self, pair: Advance, trial: Trial, memory: BodyMemory, pressure: Array, displacement: Array, stride: int
    ) -> list[float]:
        """Return the sums of `loops.embedded` over all ranks."""
        gain, back = (float(each[self.material.moving].sum()) / trial.alpha for each in (pair.gain, pair.back))
        decay = pair.decay[self.material.kept] / trial.alpha
        maps = (memory.branches, decay, memory.increment, gain, memory.before, back, pressure, displacement)
        return self.slab.sum(*loops.embedded(*maps, *trial.heights.parts, -self.slab.rows.start % stride, stride))

    def _pair(self, dt: float, growth: float) -> Advance:
        """Return the coefficients of one integrator minus those of the other: what h_k, du and du_before weigh in e."""
        curved = self.material.integrator == "exponential" and growth > 0.0
        names = ("exponential", "exponential-linear") if curved else ("exponential-linear", "backward-euler")
        one, other = (coefficients(self.material.prony, name, dt, growth) for name in names)
        return Advance(one.decay - other.decay, one.gain - other.gain, one.back - other.back)

    def _order(self, dt: float, growth: float) -> float:
        """Return the order in dt of what du weighs, du being proportional to dt, and du - r du_before to its square:
        with the linear step and backward Euler 2 where all branches are slow, 1 where some are as fast as the step is
        short, however short it is; with the quadratic step one more."""
        more = 1.0 if self.material.integrator == "exponential" and growth > 0.0 else 0.0
        weights = (float(self._pair(step, growth).gain[self.material.moving].sum()) for step in (dt, 0.5 * dt))
        gain, shorter = weights
        return 1.0 + more + math.log2(gain / shorter) if dt > 0.0 and gain > 0.0 and shorter > 0.0 else 2.0 + more

"""Flow through a seal whose fluid carries a part of the load.

Contact carries the load p0 less the pressure p of the fluid over the ambient one, p_a. In a long seal the contact at a
place is that under the local load, whose conductivity K is known from loads that a run has saved. The flow per width is

    liquid     1/(12 eta L) int K(p0 + p_a - p) dp,
    gas        M/(12 eta R T L) int K(p0 + p_a - p) p dp    [kg/(m s)],

from the low to the high pressure, where K of a gas has the slip at p (`fluids`). K p of a gas over the mean pressure
takes the place of K of a liquid below. Its logarithm is interpolated over the load without new extrema (F. N. Fritsch
and R. E. Carlson, SIAM J. Numer. Anal. 17 (1980) 238), and its value over p by a parabola, as it is almost linear.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from ...errors import InputError
from ...printed import per_cent, prefixed, quantity, span
from .fluids import PressureDrop

Array = NDArray[np.float64]
LOADS = (
    6  # accuracy: loads in the range of the integral; three leave errors of 1 to 20 % in a wavy channel, six below 1 %
)
POINTS = 2001  # accuracy: of the integral; errors of 1e-6
SAME = 1e-3  # accuracy: relative difference below which loads count as the same
RISE = 0.01  # accuracy: relative rise of K over the load above which K depends on more than the load
NOTABLE = 1.1  # ratio of both flows above which a sentence tells them apart


@dataclass(frozen=True)
class LoadCurve:
    """Conductivities of a gap over the load: `loads` [Pa] rise, shape (n,), and `flows` [m^3], shape (n, m), are the
    conductivities at the m pressures of a fluid (`PressureDrop.pressures`), 0 where contact closes the gap."""

    loads: Array
    flows: Array

    def covers(self, least: float, most: float) -> bool:
        """Return whether the saved loads include this range [Pa]."""
        slack = SAME * most
        return bool(least > 0.0 and self.loads[0] <= least + slack and most <= self.loads[-1] + slack)

    def inside(self, least: float, most: float) -> int:
        """Return the number of saved loads in a range [Pa]."""
        return int(np.count_nonzero((self.loads >= least - SAME * most) & (self.loads <= most + SAME * most)))

    def conductivity(self, drop: PressureDrop, load: float) -> float:
        """Return the conductivity [m^3] that gives the flow of a fluid under a load [Pa] of which it carries its part;
        NaN if K is not known at all local loads."""
        least, most = drop.local_loads(load)
        if not self.covers(least, most):
            return np.nan
        share = np.linspace(0.0, 1.0, POINTS)
        at = self._at(np.clip(most - share * (most - least), self.loads[0], self.loads[-1]))
        ends = (4.0 * share * (1.0 - share), (1.0 - share) * (1.0 - 2.0 * share), share * (2.0 * share - 1.0))
        local = sum(part * k for part, k in zip(ends, at.T, strict=True)) if at.shape[1] > 1 else at[:, 0]
        return float(np.trapezoid(local, share))

    def _at(self, loads: Array) -> Array:
        """Return the conductivities at local loads; 0 above the last load that leaves the gap open."""
        opened = int(np.count_nonzero(self.flows[:, 0]))
        if opened < 2:
            return np.where(loads[:, None] <= self.loads[0], self.flows[0], 0.0)
        last = self.loads[opened - 1]
        logs = PchipInterpolator(self.loads[:opened], np.log(self.flows[:opened]))(np.minimum(loads, last))
        return np.where(loads[:, None] <= last, np.exp(logs), 0.0)


def load_curve(loads: ArrayLike, flows: ArrayLike) -> LoadCurve:
    """Return the curve through conductivities [m^3], shape (n, m), at saved loads [Pa], of which those above 0 count.

    Raises InputError if K is no function of the load.
    """
    given = np.asarray(loads, dtype=float)
    kept = np.flatnonzero(given > 0.0)
    order = kept[np.argsort(given[kept], kind="stable")]
    load, flow = given[order], np.asarray(flows, dtype=float)[order]
    if not load.size:
        raise InputError("--load total needs the gap at loads above 0, and none is saved")
    same, change = np.diff(load) <= SAME * load[1:], np.diff(flow[:, 0])
    wrong = np.where(same, np.abs(change), change) > RISE * np.maximum(flow[1:, 0], flow[:-1, 0])
    if wrong.any():
        at = int(np.argmax(wrong))
        between = span(float(load[at]), float(load[at + 1]), "Pa")
        raise InputError(
            f"--load total needs K as a function of the load, and K does not fall between {between}: save the gap of "
            "one loading, without unloading"
        )
    last = np.append(~same, True)
    return LoadCurve(load[last], flow[last])


def refuse_uncovered(curve: LoadCurve, drop: PressureDrop, loads: Sequence[float]) -> None:
    """Raise InputError if the saved loads cover the local loads of no row."""
    if not any(curve.covers(*drop.local_loads(load)) for load in loads):
        highest = float(curve.loads[-1])
        least, most = drop.local_loads(highest)
        if least <= 0.0:
            raise InputError(
                f"the fluid's pressure, {quantity(drop.high - drop.outside, 'Pa')} over the ambient one, lifts the "
                f"seal off: the highest saved load is {quantity(highest, 'Pa')}; save higher loads"
            )
        raise InputError(
            f"--load total under {quantity(highest, 'Pa')} needs K between {span(least, most, 'Pa')}, and the saved "
            f"loads lie between {span(float(curve.loads[0]), highest, 'Pa')}: {_advice(least, most)}"
        )


def describe_cover(curve: LoadCurve, drop: PressureDrop, loads: Sequence[float], shown: float) -> Iterator[str]:
    """Yield sentences on rows, under `loads` [Pa], whose local loads are not all saved, and on too few loads for the
    row under the load `shown`."""
    ends = [drop.local_loads(load) for load in loads if load > 0.0]
    empty = [end for end in ends if not curve.covers(*end)]
    if empty:
        lifted = sum(least <= 0.0 for least, _ in empty)
        off = f", under {lifted} of which the fluid lifts the seal off" if lifted else ""
        needed = span(max(0.0, min(least for least, _ in empty)), max(most for _, most in empty), "Pa")
        saved = span(float(curve.loads[0]), float(curve.loads[-1]), "Pa")
        yield (
            f"flow_rate_total is left empty under {len(empty)} of {len(ends)} loads{off}: it needs K at loads between "
            f"{needed}, and those saved lie between {saved}"
        )
    least, most = drop.local_loads(shown)
    if (count := curve.inside(least, most)) < LOADS:
        there = f"K is known at {count} of the local loads between {span(least, most, 'Pa')}"
        yield f"{there}, and three leave errors of up to 20 %: {_advice(least, most)}"


def _advice(least: float, most: float) -> str:
    """Return the advice to save six loads in a range [Pa]."""
    unit, size = prefixed("Pa", most)
    values = [f"{load / size:.4g}" for load in np.linspace(least, most, LOADS)]
    return f"save the gap under {', '.join(values[:-1])} and {values[-1]} {unit}, as stages of the history"


def describe_part(axis: str, net: float, total: float) -> str:
    """Return a sentence on what the pressure of the fluid does to the flow along an axis, from the conductivities [m^3]
    if contact carries all of the load, and if the fluid carries its part."""
    if not total:
        return f"along {axis} contact closes the gap, also if the fluid carries its part of the load"
    if not net:
        return (
            f"along {axis} contact closes the gap if it carries all of the load, and the pressure of the fluid opens it"
        )
    ratio = total / net
    if 1.0 / NOTABLE <= ratio <= NOTABLE:
        return f"along {axis} the pressure of the fluid changes the flow by {per_cent(abs(ratio - 1.0))}"
    does, wrong, factor = ("opens", "small", ratio) if ratio > 1.0 else ("closes", "large", 1.0 / ratio)
    return (
        f"along {axis} the pressure of the fluid {does} the gap: flow_rate_total holds if the fluid carries its part "
        f"of the load, and flow_rate, too {wrong} then by a factor of {factor:.3g}, only if the load of the job is net "
        "of it"
    )

"""The error of friction by the length of a time step, estimated in two ways.

A linear step takes the displacement as linear in time. For a harmonic wave that turns by an angle theta in a step, the
force of a branch with z = dt/tau then has an error of theta^2/12 of its loss if the branch is slow, theta^2/6 if it is
fast, and is delayed by L/2 of a step,

    L(z) = coth(z/2) - 2/z,      z/6 for small z, 1 for large ones.

In full contact friction is the loss, with the error theta^2 (1 + <L>)/12, where <L> = sum w L/sum w over the shares of
friction of the branches, w = G omega tau/(1 + (omega tau)^2). theta is the angle of a wave with the height and the
change of the surface; shorter waves contribute more to friction, so that the error of many waves is 1.5 times as large
(LINEAR_TURNING). Where contact spots of radius a pass by x = (way of the step)/a, delayed forces move their edges:

    E = LINEAR_PASSING (1 - A^4) x (<L> + PASSING_LOSS x),      omega = x/dt.

A quadratic step also follows the bend of the motion. In full contact the error of its loss is 0.25 to 0.33 of theta^2
<L> plus theta^4/75 (`prony.discrete_modulus`); TURNING and TURNING_4 are 1.5 times as large. Edges leave an error of
third order, PASSING x^3.

The embedded pair (`embedded`) shows jumps, changes of load, and creep. The error of a quadratic step is its difference
to a linear one. The pair of a linear step differs in second order if all branches are slow, and in first order if some
are fast; the accumulated error of linear steps has the order 1.7. In a slide PAIR_SHARE of the pair counts, for errors
not caused by edges. Backward Euler is of first order: its error varies as the root of the difference.

Friction that changes from step to step is delayed by at most <L> of the change, CURVED_RISE of it in quadratic steps
(`error_of_rise`). Right after a jump of the load friction is 0 up to mesh errors, as for an elastic body, so that the
next change is unknown. The error of the area is a share of that of friction, which falls with the open area.
"""

import math

import numpy as np

from ..physics.prony import Prony, complex_modulus
from .constants import (
    CURVED_RISE,
    EQUAL_DIFFERENCE,
    EULER,
    EULER_AREA,
    LINEAR_PAIR,
    LINEAR_PASSING,
    LINEAR_TURNING,
    PAIR,
    PAIR_SHARE,
    PASSING,
    TIME_AREA,
    TURNING,
    TURNING_4,
)
from .observation import RunProperties, StepObservation, radius_of

PASSING_LOSS = 0.19  # accuracy: relative error of the loss in a linear step over x
SLOW = 1e-3  # rounding: z below which L is computed by its series
LEAST_POWER = 0.25  # accuracy: least difference of the orders of error and of a linear pair
FULL_POWER = 4  # accuracy: power of the contact area that weights the error in full contact
FIXED_EDGES = 0.9  # accuracy: share of the error of a linear pair that edges cause


def time_error(run: RunProperties, observed: StepObservation) -> float:
    """Return the error of friction by the length of a time step, also at rest; at most 1."""
    if observed.own_error is not None:
        return observed.own_error
    if not run.exponential:
        return EULER.value * observed.difference**EULER.order
    pair = _error_by_pair(observed)
    if not observed.slid or run.prony is None:
        return pair
    full, late = observed.area**FULL_POWER, _late(run.prony, observed.angle, observed.seconds)
    x, angle = _share_passed(run, observed), observed.angle
    if observed.curved:
        passing, turning = PASSING.value * x**3, TURNING.value * late * angle**2 + TURNING_4.value * angle**4
        least = PAIR_SHARE.value
    else:
        passing = LINEAR_PASSING.value * x * (_late(run.prony, x, observed.seconds) + PASSING_LOSS * x)
        turning = LINEAR_TURNING.value * angle**2 * (1.0 + late)
        least = full + (1.0 - full) * PAIR_SHARE.value
    return min(1.0, max((1.0 - full) * passing + full * turning, least * pair))


def _error_by_pair(observed: StepObservation) -> float:
    """Return the error by the embedded pair. For linear steps it has the order LINEAR_PAIR.order, the difference
    `order`."""
    if observed.curved:
        return PAIR.value * observed.difference
    power = max(LEAST_POWER, LINEAR_PAIR.order / max(observed.order, 1.0) - 1.0)
    fixed = 1.0 - FIXED_EDGES * observed.area**2
    more = (observed.difference / EQUAL_DIFFERENCE.value) ** power
    return min(1.0, fixed * LINEAR_PAIR.value * observed.difference * more)


def error_of_rise(run: RunProperties, observed: StepObservation) -> float:
    """Return the error of a change of friction since the step before, as after rest: it is delayed by <L> of a step.
    After a jump the change is the slope times the sine of the loss angle, times `uneven`."""
    if run.prony is None or not run.exponential or not observed.slid or observed.body <= 0.0:
        return 0.0
    x = max(_share_passed(run, observed), observed.angle)
    if x == 0.0:
        return 0.0
    change = observed.change
    if math.isinf(change):
        modulus = complex_modulus(np.array(x / observed.seconds), *run.prony)
        change = observed.uneven * observed.slope * float(modulus.imag / abs(modulus))
    late = _late(run.prony, x, observed.seconds) * (CURVED_RISE.value if observed.curved else 1.0)
    return late * abs(change) / observed.body


def share_of_area(run: RunProperties, observed: StepObservation) -> float:
    """Return the error of area by the time steps over that of friction."""
    open_share = 1.0 - observed.area
    if run.exponential:
        return TIME_AREA.value * open_share**TIME_AREA.order
    return EULER_AREA.value * open_share**EULER_AREA.order + observed.correction


def order_of_time_error(integrator: str, curved: bool) -> float:
    """Return the order of the error in the length of a step; `curved` if the displacement is quadratic in time."""
    if integrator == "backward-euler":
        return 1.0
    return PASSING.order if integrator == "exponential" and curved else LINEAR_PAIR.order


def _share_passed(run: RunProperties, observed: StepObservation) -> float:
    """Return the distance slid in a step over the radius of spots."""
    radius = radius_of(run, observed)
    return observed.slid / radius if radius > 0.0 else 0.0


def _late(prony: Prony, angle: float, seconds: float) -> float:
    """Return the delay of forces over half a step, <L>, averaged over the branches that cause friction."""
    z = seconds / prony.relaxation_times
    slow = np.maximum(z, SLOW)
    late = np.where(z > SLOW, 1.0 / np.tanh(0.5 * slow) - 2.0 / slow, z / 6.0)
    lost = prony.moduli * angle * z / (z**2 + angle**2)
    total = float(lost.sum())
    return float((lost * late).sum()) / total if total > 0.0 else 0.0

"""How wrong friction is by the length of a time step, part of the error budget (`budget`), from two looks at it.

The displacement is taken to change evenly within a step. Where contact spots of radius a pass, that is wrong by a share
of x = (way of the step)/a: friction of a body whose branches are slow, by x^2; where they are faster than the step,
z = dt/tau > 1, their forces are those in the middle of the step, late by half of it, and friction is wrong by x. With
the share of friction that each branch makes, w = G omega tau/(1 + (omega tau)^2) at omega = x/dt,

    E = PASSING_FRICTION (1 - A^2) x (<z/(1 + z)> + x/2),      <z/(1 + z)> = sum w z/(1 + z)/sum w,

in full contact, A = 1, there are no edges. It knows nothing else of the material or of the speed: over spheres,
cylinders and rough surfaces from 0.2 to 85 % of contact, 0.01 to 10 m/s, bodies of one branch and of five, spots of 1
to 80 cells and steps of a quarter of a cell to one, it is 0.6 to 2.2 times the true error.

Jumps, loads that change, creep and full contact are seen by the embedded pair (`embedded`). Over one step the pair
differs in the second order of the step where all branches are slow, in the first where some are as fast as the step is
short; the error that all steps of the exponential integrator leave in the end is of an order of 1.7. In a slide the
pair is two or three times too large in partial contact, and as much as ten times too small where the branches are far
slower or faster than the contact passes: it counts half there.

Backward Euler is of the first order, its error goes with the root of the difference. The area, which is wrong now by
more and now by less than none, has a share of the error of friction: less where little is open.
"""

from .prony import Prony
from .seen import Known, Seen, radius_of

PASSING_FRICTION = 0.36  # times the share of the radius of a spot that a step is, times what of friction it blurs
EXPONENTIAL_FRICTION = 1.7  # times the difference of the pair
LEAST_POWER = 0.25  # by which the error falls faster than the difference of the pair, at least
TIME_ORDER = 1.7  # of the error of the exponential integrator in the step, with contacts that begin and end
EQUAL_DIFFERENCE = 0.0072  # of the pair, at which a material of many branches is no worse than one of a single branch
FIXED_EDGES = 0.9  # of the error is from the edges of contacts: in full contact there are none
EULER_FRICTION = 0.9  # times its root
EXPONENTIAL_AREA, EXPONENTIAL_OPEN_POWER = 0.15, 1.0 / 3.0  # of the error of friction, times this power of what is open
EULER_AREA, EULER_OPEN_POWER = 0.15, 0.8  # of it, times this power of it, and more by what the corrected area is less


def time_error(known: Known, seen: Seen, points: int) -> float:
    """What the length of a step adds to the error of friction, or would where something slides.

    In contacts the error of the exponential integrator goes with the power TIME_ORDER of the step, the difference of
    the pair with `order`.
    """
    if not known.exponential:
        return EULER_FRICTION * seen.difference**0.5
    power = max(LEAST_POWER, TIME_ORDER / max(seen.order, 1.0) - 1.0)
    fixed = 1.0 - FIXED_EDGES * seen.area**2
    pair = fixed * EXPONENTIAL_FRICTION * seen.difference * (seen.difference / EQUAL_DIFFERENCE) ** power
    if not seen.slid or known.prony is None:
        return pair
    return max(_passing(known, known.prony, seen, points), 0.5 * (1.0 + seen.area**2) * pair)


def _passing(known: Known, prony: Prony, seen: Seen, points: int) -> float:
    """Of friction, as edges of contact pass a point within a step: of a share x of the radius of spots."""
    radius = radius_of(known, seen, points)
    x = seen.slid / radius if radius > 0.0 else 0.0
    times = prony.relaxation_times
    turns = x * times / seen.seconds
    lost = prony.moduli * turns / (1.0 + turns**2)
    if not (total := float(lost.sum())):
        return 0.0
    relaxed = float((lost * seen.seconds / (seen.seconds + times)).sum()) / total
    return PASSING_FRICTION * (1.0 - seen.area**2) * x * (relaxed + 0.5 * x)


def share_of_area(known: Known, seen: Seen) -> float:
    """What the error of area by the time steps is of that of friction."""
    open_share = 1.0 - seen.area
    if known.exponential:
        return EXPONENTIAL_AREA * open_share**EXPONENTIAL_OPEN_POWER
    return EULER_AREA * open_share**EULER_OPEN_POWER + seen.correction

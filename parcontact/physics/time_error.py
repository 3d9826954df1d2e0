"""How wrong friction is by the length of a time step, part of the error budget (`budget`), from two looks at it.

The displacement is taken to change evenly within a step. Where contact spots of radius a pass, that is wrong by a share
of x = (way of the step)/a: friction of a body whose branches are slow, by x^2; where they are faster than the step,
z = dt/tau > 1, their forces are those in the middle of the step, late by half of it, and friction is wrong by x. With
the share of friction that each branch makes, w = G omega tau/(1 + (omega tau)^2) at omega = x/dt,

    E = PASSING_FRICTION (1 - A^4) x (<z/(1 + z)> + x/2),      <z/(1 + z)> = sum w z/(1 + z)/sum w,

in full contact, A = 1, there are no edges. It knows nothing else of the material or of the speed. Jumps, loads that
change, creep and full contact are seen by the embedded pair (`embedded`). Together they are 0.7 to 3.4 times the true
error, over spheres, cylinders and rough surfaces from 0.2 % to full contact, 0.01 to 10 m/s, bodies of one branch and
of five, spots of 1 to 30 cells and steps of a quarter of a cell to one; the pair alone, of the same 45 slides, 0.08 to
6.

Over one step the pair differs in the second order of the step where all branches are slow, in the first where some are
as fast as the step is short; the error that all steps of the exponential integrator leave in the end is of an order of
1.7. In a slide in partial contact the pair is as a rule two or three times too large, and ten times too small where the
branches are far slower or faster than the contact passes: PAIR_SHARE of it counts there, for what edges do not show.

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
FULL_POWER = 4  # of the area: so much of the error is as in full contact, where no edges pass
PAIR_SHARE = 0.5  # of the error that the pair shows, at least, where something slides
FIXED_EDGES = 0.9  # of the error is from the edges of contacts: in full contact there are none
EULER_FRICTION = 1.1  # times its root
EXPONENTIAL_AREA, EXPONENTIAL_OPEN_POWER = 0.15, 1.0 / 3.0  # of the error of friction, times this power of what is open
EULER_AREA, EULER_OPEN_POWER = 0.18, 2.0  # of it, times this power of it, and more by what the corrected area is less


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
    full = seen.area**FULL_POWER
    return max((1.0 - full) * _passing(known, known.prony, seen, points), (full + (1.0 - full) * PAIR_SHARE) * pair)


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
    return PASSING_FRICTION * x * (relaxed + 0.5 * x)


def share_of_area(known: Known, seen: Seen) -> float:
    """What the error of area by the time steps is of that of friction."""
    open_share = 1.0 - seen.area
    if known.exponential:
        return EXPONENTIAL_AREA * open_share**EXPONENTIAL_OPEN_POWER
    return EULER_AREA * open_share**EULER_OPEN_POWER + seen.correction

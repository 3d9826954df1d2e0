"""How wrong friction is by the length of a time step, part of the error budget (`budget`), from two looks at it.

A linear step takes the displacement to change evenly. Of a harmonic wave, which turns by an angle theta in a step,
the force of a branch with z = dt/tau is then wrong by theta^2/12 of its loss where the branch is slow, by theta^2/6
where it is fast, and late by L/2 of a step,

    L(z) = coth(z/2) - 2/z,      z/6 for small z, 1 for large ones.

In full contact friction is the loss, wrong by theta^2 (1 + <L>)/12, with <L> = sum w L/sum w over the shares of
friction that branches make, w = G omega tau/(1 + (omega tau)^2). The angle is taken of a wave as high as the surface
which changes as much in the step; as shorter ones weigh more in friction, the error of many is half as much again
(FULL_LOSS). Where contact spots of radius a pass by x = (way of the step)/a, there are edges, which move with what
forces are late by:

    E = PASSING_FRICTION (1 - A^4) x (<L> + PASSING_LOSS x),      omega = x/dt.

A quadratic step follows the bend of the motion as well. In full contact its loss is wrong by 0.25 to 0.33 of
theta^2 <L> and by theta^4/75 (`prony.discrete_modulus`), of which CURVED_TURN and CURVED_TURN_4 are 1.5 times as much.
Edges leave an error of third order in what passes in a step, CURVED_PASSING x^3 (`scripts/march_errors.py`).

It knows nothing else of the material or of the speed. Jumps, loads that change and creep are seen by the embedded pair
(`embedded`). Together they are 0.5 to 2.7 times the true error of 36 slides in steps of a cell, a half and a quarter:
spheres, cylinders and rough surfaces from 0.8 % to full contact, 0.005 to 10 m/s, bodies of one branch, of five and of
twelve, steady or at three hundred times the speed of before; but for one error of 42 % (0.43). The constants are
fitted to these; most scenes of `scripts/error_coverage.py` are others.

After a jump at rest a quadratic step is as wrong as it differs from a linear one, 0.3 to 1.2 times.

Over one step the pair of a linear step differs in the second order of the step where all branches are slow, in the
first where some are as fast as the step is short; the error that all linear steps leave in the end is of an order of
1.7. In a slide in partial contact the pair is as a rule two or three times too large, and ten times too small where the
branches are far slower or faster than the contact passes: PAIR_SHARE of it counts there, for what edges do not show.

Friction that changes from step to step comes late, by <L> of the change at most, CURVED_RISE of it in quadratic steps
(`error_of_rise`). Right after a jump of the load it is that of an elastic body: none, but for errors of the mesh. So
the next change is not known. In all of 155 slides over a few cells from rest, one cell in a step, the estimate in all
was at least half of the true error.

Backward Euler is of the first order, its error goes with the root of the difference. The area, which is wrong now by
more and now by less than none, has a share of the error of friction: less where little is open.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..physics.measures import excess_of
from ..physics.prony import Prony, complex_modulus

Vector = tuple[float, float]

# accuracy: these constants are fitted to true errors, as the text above says
ROUND = 8.0 / math.pi  # cells of a round spot over its sides on the edge, times this: its radius in cells
PASSING_FRICTION = 0.66  # times the share of the radius of a spot that a step is, and what forces are late by
PASSING_LOSS = 0.19  # times that share: by what the loss is wrong
FULL_LOSS = 1.0 / 8.0  # times the square of the angle by which waves turn in a step: short ones weigh more in friction
SLOW = 1e-3  # of its relaxation time: a step that is shorter, in which L has no digits left
EXPONENTIAL_FRICTION = 1.7  # times the difference of the pair
LEAST_POWER = 0.25  # by which the error falls faster than the difference of the pair, at least
TIME_ORDER = 1.7  # of the error of linear steps in their length, with contacts that begin and end
CURVED_ORDER = 3.0  # of the error of quadratic steps
CURVED_PASSING = 0.4  # times the cube of the share of the radius of a spot that a step is
CURVED_TURN, CURVED_TURN_4 = 0.45, 0.02  # times <L> and the square of the angle, and its fourth power
CURVED_PAIR = 1.0  # times the difference of the pair
CURVED_RISE = 0.5  # of what comes late in a linear step
EQUAL_DIFFERENCE = 0.0072  # of the pair, at which a material of many branches is no worse than one of a single branch
FULL_POWER = 4  # of the area: so much of the error is as in full contact, where no edges pass
PAIR_SHARE = 0.3  # of the error that the pair shows, at least, where something slides
FIXED_EDGES = 0.9  # of the error is from the edges of contacts: in full contact there are none
EULER_FRICTION = 1.1  # times its root
EXPONENTIAL_AREA, EXPONENTIAL_OPEN_POWER = 0.21, 1.0 / 3.0  # of the error of friction, times this power of what is open
EULER_AREA, EULER_OPEN_POWER = 0.18, 2.0  # of it, times this power of it, and more by what the corrected area is less


@dataclass(frozen=True)
class RunProperties:
    """Properties of a run that are known before it begins.

    `cells_per_wave` of the shortest wave of a rough surface, None without one; `straight`: on a grid of one row or
    column every edge of contact follows the grid; `folded`: the bound; `exponential`: the integrator; `prony`: what
    relaxes, None of an elastic body; `cell`: its sides [m]; `free`: the box; `alike`: all contacts are, as
    those of waves; `measured`: the surface has a map. `cells_per_wave` counts the longer sides.
    """

    cells_per_wave: float | None
    straight: bool
    folded: float
    exponential: bool
    prony: Prony | None = None
    cell: Vector = (1.0, 1.0)
    free: bool = False
    alike: bool = False
    measured: bool = False

    @property
    def mean_cell(self) -> float:
        """The mean of the sides of a cell, in which radii of spots are counted."""
        return 0.5 * (self.cell[0] + self.cell[1])

    @property
    def cells(self) -> float:
        """The area of a cell over that of a square of its mean side."""
        return self.cell[0] * self.cell[1] / self.mean_cell**2


@dataclass(frozen=True)
class StepObservation:
    """Observation of a step: the certificate's complementarity; by how much the embedded pair differs, with its order
    in the step; the rms slope of the surface under the pressure; friction; contact area, counted and corrected, as
    shares; by how many cells (of mean sides) the surface slid in it, in how many seconds; the points that penetrate
    without pressure, as a share of those in contact; by what angle a wave turned that is as high as the surface under
    the pressure and changes as much; by how much friction by the slopes of the rigid surface and of the body differ;
    what an interface adds to friction; the direction in which the surface slides, 0 at rest; whether the displacement
    is quadratic in time within the step."""

    complementarity: float
    difference: float
    order: float
    slope: float
    friction: float
    area: float
    corrected: float
    slid: float = 0.0
    seconds: float = 0.0
    penetrating: float = 0.0
    angle: float = 0.0
    views_apart: float = 0.0
    interface: float = 0.0
    way: Vector = (0.0, 0.0)
    curved: bool = False

    @property
    def correction(self) -> float:
        """The counted area less the corrected one, over the latter."""
        return (self.area - self.corrected) / self.corrected if self.corrected > 0.0 else 0.0


def spot_radius(run: RunProperties, observed: StepObservation, points: int) -> float:
    """Return the radius of round spots of contact, or of the gaps between them where these are the smaller, in cells of
    mean sides; infinite where there are no edges."""
    sides = (observed.area - observed.corrected) * points / excess_of(*run.cell, run.straight)
    return ROUND * min(observed.area, 1.0 - observed.area) * points / sides if sides > 0.0 else math.inf


def radius_of(run: RunProperties, observed: StepObservation, points: int) -> float:
    """Return the radius of spots, or half the width of a straight one."""
    return spot_radius(run, observed, points) / (ROUND if run.straight else 1.0)


def count_spots(run: RunProperties, observed: StepObservation, points: int) -> float:
    """Return the number of spots of contact; in full contact as many as half waves of the shortest length."""
    radius = radius_of(run, observed, points)
    if run.cells_per_wave is not None:
        radius = min(radius, 0.5 * run.cells_per_wave * (max(run.cell) / run.mean_cell))
    one = 2.0 * radius if run.straight else math.pi * radius**2 / run.cells
    return max(1.0, observed.area * points / one) if one > 0.0 else 1.0


def time_error(run: RunProperties, observed: StepObservation, points: int) -> float:
    """Return what the length of a step adds to the error of friction, or would where something slides.

    In contacts the error of linear steps goes with the power TIME_ORDER of the step, the difference of the pair with
    `order`.
    """
    if not run.exponential:
        return EULER_FRICTION * observed.difference**0.5
    if observed.curved:
        pair = CURVED_PAIR * observed.difference
        if not observed.slid or run.prony is None:
            return pair
        return max(_error_of_curved(run, run.prony, observed, points), PAIR_SHARE * pair)
    power = max(LEAST_POWER, TIME_ORDER / max(observed.order, 1.0) - 1.0)
    fixed = 1.0 - FIXED_EDGES * observed.area**2
    pair = fixed * EXPONENTIAL_FRICTION * observed.difference * (observed.difference / EQUAL_DIFFERENCE) ** power
    if not observed.slid or run.prony is None:
        return pair
    full = observed.area**FULL_POWER
    sliding = (1.0 - full) * _passing(run, run.prony, observed, points) + full * _turning(run.prony, observed)
    return max(sliding, (full + (1.0 - full) * PAIR_SHARE) * pair)


def _passing(run: RunProperties, prony: Prony, observed: StepObservation, points: int) -> float:
    """Return the error of friction as edges of contact pass a point within a step: by a share x of the spot radius."""
    x = _share_passed(run, observed, points)
    return PASSING_FRICTION * x * (_late(prony, x, observed.seconds) + PASSING_LOSS * x)


def _error_of_curved(run: RunProperties, prony: Prony, observed: StepObservation, points: int) -> float:
    """Return the error of friction in a quadratic step, as edges of contact pass and as waves turn."""
    full, late = observed.area**FULL_POWER, _late(prony, observed.angle, observed.seconds)
    turning = CURVED_TURN * late * observed.angle**2 + CURVED_TURN_4 * observed.angle**4
    return (1.0 - full) * CURVED_PASSING * _share_passed(run, observed, points) ** 3 + full * turning


def _share_passed(run: RunProperties, observed: StepObservation, points: int) -> float:
    """Return by what share of the radius of spots the surface slides in a step."""
    radius = radius_of(run, observed, points)
    return observed.slid / radius if radius > 0.0 else 0.0


def error_of_rise(run: RunProperties, observed: StepObservation, points: int, change: float, uneven: float) -> float:
    """Return the error of friction that has changed by so much since the step before, as after rest: the change comes
    <L> of a step late.

    After a jump `change` is infinite. It counts as the slope times the sine of the loss angle, of pressures that are
    `uneven` by such a share of their mean, 1 at most.
    """
    if run.prony is None or not run.exponential or not observed.slid or observed.friction <= 0.0:
        return 0.0
    x = max(_share_passed(run, observed, points), observed.angle)
    if x == 0.0:
        return 0.0
    if math.isinf(change):
        modulus = complex_modulus(np.array(x / observed.seconds), *run.prony)
        change = uneven * observed.slope * float(modulus.imag / abs(modulus))
    late = _late(run.prony, x, observed.seconds) * (CURVED_RISE if observed.curved else 1.0)
    return late * abs(change) / observed.friction


def _turning(prony: Prony, observed: StepObservation) -> float:
    """Return the error of friction in full contact, as waves of the surface turn by an angle within a step."""
    return FULL_LOSS * observed.angle**2 * (1.0 + _late(prony, observed.angle, observed.seconds))


def _late(prony: Prony, angle: float, seconds: float) -> float:
    """Return by what share of half a step forces are late, <L>, in the mean over the branches that make friction."""
    z = seconds / prony.relaxation_times
    slow = np.maximum(z, SLOW)
    late = np.where(z > SLOW, 1.0 / np.tanh(0.5 * slow) - 2.0 / slow, z / 6.0)
    lost = prony.moduli * angle * z / (z**2 + angle**2)
    total = float(lost.sum())
    return float((lost * late).sum()) / total if total > 0.0 else 0.0


def order_of_time_error(integrator: str, curved: bool) -> float:
    """Return the order of the error in the length of a step, which is `curved` or linear."""
    if integrator == "backward-euler":
        return 1.0
    return CURVED_ORDER if integrator == "exponential" and curved else TIME_ORDER


def share_of_area(run: RunProperties, observed: StepObservation) -> float:
    """Return the error of area by the time steps over that of friction."""
    open_share = 1.0 - observed.area
    if run.exponential:
        return EXPONENTIAL_AREA * open_share**EXPONENTIAL_OPEN_POWER
    return EULER_AREA * open_share**EULER_OPEN_POWER + observed.correction

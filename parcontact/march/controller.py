"""The tolerance of solves and the length of steps, both from the error budget of the steps made so far.

**Tolerance.** `numerics.tolerance` is small enough for the scenes in which friction depends most on the solver. If
`numerics.accuracy` has chosen this tolerance, solves may use a larger one, by a factor that follows from the last
steps. The estimated error of the solver must stay below OF_SOLVER times the accuracy of friction, and below
OF_SOLVER_IN_AREA times the accuracy of the area. If the other parts of the error budget exceed the accuracy, the limits
are OF_SOLVER and OF_SOLVER_IN_AREA times these parts. The error is proportional to the residual of a solve
(`contact.certificate`). Each step thus gives a factor by which its tolerance might have been larger, and the factor of
the next solve is the mean over the last steps. This mean is rounded to a power of the square root of two, so that
rounding errors do not change the tolerance. It belongs to the state of a run, so that a restarted run continues
identically.

The last solve before a change of velocity or load, and a steady start, have a small tolerance: the body remembers the
error of the displacement, and a much larger modulus may multiply this error after the change. The first and the last
step of a stage have a small tolerance, too. Their solves have worse starts than the solves of other steps, from which
the factor follows: the last step of a stage seldom moves the surface by whole cells.

**Length.** The error E of a step of length dt is estimated from that step alone (`time_error`). E0 is OF_STEPS times
the accuracy. E varies as dt^p, with p = 3 for a displacement quadratic in time, 1.7 for a linear one, and 1 for
backward Euler. The next step is therefore

    dt <- dt clip(SAFETY (E0/E)^(1/p), 1, MOST_GROWTH).

A step with E > REJECTED E0 is repeated from the same state, `max((REJECTED E0/E)^(1/p), MOST_SHRINK)` times as long,
and the step after the repeated one does not grow (E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential
Equations I (1993), II.4). At rest the length of a step is the shortest length times a power of the fourth root of two,
so that rounding errors do not change it.

While the surface slides, steps end at multiples of their length, counted in cells from the first position of the
surface (block time steps; S. L. W. McMillan, in The Use of Supercomputers in Stellar Dynamics (1986) 156). After a
jump, steps of parts of a cell, as long as E allows, lead back to multiples of whole cells, where heights are moved
without a transform. Steps of a half, a third or a quarter of a cell start from the pressure one whole cell earlier
(`march.laws`).

**Embedded pair.** The time error is estimated from the difference between a step by one integrator and the same step by
another. Both start from the same state and assume the same motion. An integrator turns the branch maps h_k at the start
of a step and the increments du of the displacement into `A p = G_inf u + sum_k h_k` at its end. A quadratic step is
compared with a linear one, from which it differs by

    e = (sum_k G_k kappa q_k) (du - r du_before)                                               (`physics.body`).

A linear step, as after a jump, is compared with backward Euler, from which it differs, with z_k = dt/tau_k, by

    e = sum_k (exp(-z_k) - 1/(1 + z_k)) h_k + sum_k G_k ((1 - exp(-z_k))/z_k - 1/(1 + z_k)) du.

The comparison takes no further solve. The rms of e divided by the rms of `A p`, both weighted by the pressure, measures
the time error. Both are taken from a sample of evenly spaced rows: SAMPLED_ROWS in full contact, and more for a share A
of the points in contact, in proportion to 1/A^(1/2). If the sample misses the contact, as for a small sphere, all rows
are used.
"""

import math
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from ..job import Job
from ..job.advice import one_cell
from ..job.calculation import Accuracy
from ..job.history import Bounds, ChosenEnds, ChosenSteps, MadeStep, Span, Step, Timeline, reached
from ..parallel.slab import Array, Slab
from ..physics import loops
from ..physics.body import Body, BodyMemory, Trial, ZenerBody, remembers, surface_of
from ..physics.prony import Advance, coefficients
from ..physics.records import Entry, Saved, Units
from .budget import ErrorBudget, ErrorParts
from .time_error import order_of_time_error

SAMPLED_ROWS = 8  # accuracy: least number of sampled rows; the error of the difference is 5 %
LEAST_VARIANCE = 1e-6  # accuracy: least variance of heights over their mean square, set by rounding
MISSED = 0.5  # accuracy: relative error of the load of a sample above which all rows are used


@dataclass(frozen=True)
class IntegratorDifference:
    """Difference of two integrators over one step (the embedded pair). All rms values are weighted by the pressure.

    `difference` is the relative difference of both integrators, which grows with the step length to the power `order`.
    `slope` is the rms slope of the surface along x, in the run's unit of height per unit of length. `angle` is the rms
    change of the displacement in the step, divided by the standard deviation of heights. In full contact this is the
    angle by which a wave turns.
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
    """Comparison of integrators in the steps of a relaxing body. No maps are allocated. `dx` is the length of a cell
    along x."""

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
        """Compare the integrators in a step under load. The comparison takes one sum over all ranks, or two;
        collective.

        `memory` is the memory of the body after the step. The sum of `pressure` over all ranks is `load`, and a `share`
        of the points is under pressure. `displacement` is `A p/alpha`. `growth` is dt divided by the length of the step
        before.
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
        """Compare the integrators in a step without load; collective. `memory` is the memory of the body after the
        step, and `growth` is dt divided by the length of the step before. The result is the rms difference divided by
        the rms displacement."""
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


OF_STEPS = 0.8  # tuning: estimated error of friction by time steps over the accuracy; it is twice the error or more
OF_SOLVER, OF_SOLVER_IN_AREA = 0.1, 0.4  # tuning: the same by the solver, of friction and area
MOST = 8.0  # accuracy: largest tolerance of a solve over the tolerance of the job
LOOSEST = 0.05  # accuracy: largest tolerance of a solve
CLOSE = 2.5e-4  # accuracy: largest tolerance before a change of velocity or load
FIRST = 0.01  # accuracy: largest tolerance in the first and the last step of a stage
NEWEST = 0.25  # tuning: weight of the last step in the mean factor
NAME = "mean logarithm"  # its name in a checkpoint
SAFETY = 0.98  # tuning: length of a step over that with the allowed error
REJECTED = 1.19  # accuracy: error of a rejected step over the allowed one
MOST_GROWTH, MOST_SHRINK = 2.0, 1.0 / 16.0  # tuning: limits on a step over the one before, or over a rejected one
LEAST_SHEAR = 1.0 / 1024.0  # accuracy: cells in the first step if shear comes first; spots slide in a hundredth
LEVELS = 2  # tuning: log2 of the number of lengths per factor of two, for steps below a quarter of a cell
REST_LEVELS = 4  # tuning: number of lengths per factor of two at rest
LEAST_WAY_LEFT = 0.35  # tuning: least length of a step that ends at a multiple, over its nominal length
STRETCH = 1.1  # tuning: largest stretch of the last step of a stage, to avoid a short rest
SNAP_SHARE = 1.0 / 64.0  # accuracy: step over the longest of the stage, below which the edge of contact may snap
RELAXING = 0.1  # accuracy: the same over the shortest relaxation time; and the first step at rest after a jump
SAME_LEVEL = 1e-6  # rounding: relative tolerance on a length


@dataclass(frozen=True)
class StepTolerance:
    """Memory of the tolerance of solves: the mean, over the last steps, of log2(allowed tolerance divided by the
    tolerance of the job)."""

    mean: float = 0.0


class TolerancePart:
    """The memory of the solver's tolerance, an optional part of checkpoints."""

    def at_rest(self) -> StepTolerance:
        return StepTolerance()

    def entries(self, memory: StepTolerance, units: Units) -> dict[str, Entry]:
        return {NAME: Entry(memory.mean, optional=True)}

    def restored(self, memory: StepTolerance, saved: Saved) -> StepTolerance:
        return StepTolerance(float(saved[NAME])) if NAME in saved else StepTolerance()


@dataclass(frozen=True)
class Controller:
    """Controller of the tolerances and the lengths of steps in a run.

    `timeline` states the stages of the `job`. `energies` is True if the job asks for energies. `exact` is True if all
    contacts must be solved to the job's tolerance, whatever the error budget allows.
    """

    job: Job
    timeline: Timeline
    body: Body
    energies: bool = False
    exact: bool = False

    @property
    def relaxes(self) -> bool:
        return remembers(self.body)

    @cached_property
    def asked(self) -> Accuracy:
        """The accuracies that the job requests."""
        return self.job.numerics.asked

    # -- tolerance ----------------------------------------------------------------------------------------------------

    @cached_property
    def follows(self) -> bool:
        """True if the tolerance of solves follows the error budget: `numerics.accuracy` has chosen the tolerance of the
        job, at least one stage has steps, and the run is not `exact`."""
        return "tolerance" in self.job.numerics.chosen and self.timeline.lasts and not self.exact

    def tolerance(self, memory: StepTolerance, step: Step) -> float | None:
        """Return the tolerance for the solve of a step, or None for the tolerance of the job. Jumps are solved to the
        tolerance of the job. The tolerance is smaller in the first and last step of a stage, and before a change of
        velocity or load."""
        if step.dt == 0.0:
            return None
        own, most = self.job.numerics.tolerance, self.largest_tolerance(step)
        if not self.follows:
            return most if most < own else None
        return float(min(own * 2.0 ** (0.5 * round(2.0 * memory.mean)), max(LOOSEST, own), most))

    def largest_tolerance(self, step: Step) -> float:
        """Return the limit on the tolerance of a step. It is finite in the first and last step of a stage and before a
        change of velocity or load, and infinite in other steps and in jumps."""
        if step.dt == 0.0:
            return math.inf
        span = self.timeline.spans[step.stage]
        ends = reached(step.time, span.time(span.count))
        most = tolerance_before(self.job, step.stage + 1, self.relaxes) if ends else math.inf
        return min(most, FIRST) if (step.growth == 0.0 or ends) and self.relaxes else most

    def learn(self, memory: StepTolerance, certificate: float, budget: ErrorBudget | None) -> StepTolerance:
        """Return, after a step, the memory from which the next tolerance follows. `certificate` is the error that the
        solve of the step has reached, and `budget` is the error budget of the step."""
        if not self.follows or budget is None or certificate <= 0.0:
            return memory
        room = _room(budget.area, OF_SOLVER_IN_AREA, self.asked.area)
        if budget.friction is not None:
            room = min(room, _room(budget.friction, OF_SOLVER, self.asked.friction))
        ratio = certificate * room / self.job.numerics.tolerance
        now = min(max(math.log2(ratio) if ratio > 0.0 else 0.0, 0.0), math.log2(MOST))
        return StepTolerance(memory.mean + NEWEST * (now - memory.mean))

    # -- length of steps ----------------------------------------------------------------------------------------------

    def propose(self, chosen: ChosenSteps, span: Span, number: int) -> Step:
        """Return step `number` of a stage that chooses its steps. `chosen` is the record of the steps made so far."""
        first = number == span.before + span.jumps + 1
        return self._step(chosen, span, number, self._first(chosen, span) if first else chosen.next)

    def decide(
        self,
        chosen: ChosenSteps,
        span: Span,
        step: Step,
        end: float,
        rejected: bool,
        error: float,
        front: float = 0.0,
        begins: bool = False,
    ) -> Step | MadeStep:
        """Return a shorter step to try if the error of a step is too large, else the record of the accepted step.

        The step ends `end` [s] after the start of the stage, and `error` is its estimated relative error. `rejected` is
        True if a longer step was tried before.

        Under attraction the edge of contact has moved by `front` half process zones in the step. It may move by one
        half process zone. If the body relaxes and the job asks for energies, the edge may move only by the square root
        of the accuracy times a half process zone. `begins` is True if a contact begins or ends in the step.

        Because of `front` or `begins`, no step becomes shorter than SNAP_SHARE times the longest step of the stage, or
        than RELAXING times the shortest relaxation time. In a step so short a jump of the contact is over before the
        body relaxes.
        """
        order = order_of_time_error(self.job.numerics.integrator, step.growth > 0.0)
        ratio = error / (OF_STEPS * self.asked.of_steps)
        jump = min(SNAP_SHARE * _bounds(span).most, RELAXING * self.body.shortest_time)
        if step.dt > jump:
            allowed = math.sqrt(self.asked.of_steps) if self.relaxes and self.energies else 1.0
            at_once = (step.dt / jump) ** order if begins and self.relaxes else 0.0
            ratio = max(ratio, (front / allowed) ** order, at_once)
        wanted = SAFETY * ratio ** (-1.0 / order) if ratio > 0.0 else MOST_GROWTH
        if ratio > REJECTED:
            share = max((REJECTED / ratio) ** (1.0 / order), MOST_SHRINK)
            if shorter := self._shorter(chosen, span, step, share):
                return shorter
            rejected = True
        most = 1.0 if rejected else MOST_GROWTH
        return MadeStep(span.index, end, self._level(span, step.dt * min(max(wanted, 1.0), most)))

    def limit(self, made: MadeStep, dt: float, turned: float) -> MadeStep:
        """Return the record of a step of length dt with a limit on the next step, which follows from the mean traction.
        In a step, the traction may change by the root of the accuracy times its largest value. In the step made it has
        changed by `turned` times this value."""
        most = math.sqrt(self.asked.of_steps)
        if turned * made.next <= most * dt:
            return made
        return made._replace(next=self._level(self.timeline.spans[made.stage], most / turned * dt))

    def _shorter(self, chosen: ChosenSteps, span: Span, step: Step, share: float) -> Step | None:
        """Return a step of at most this share of a step, None if that one is the shortest."""
        least, dt = _bounds(span).least, share * step.dt
        while True:
            wanted = self._level(span, dt)
            shorter = self._step(chosen, span, step.number, wanted, rejected=True)
            if shorter.dt < step.dt * (1.0 - SAME_LEVEL):
                return shorter
            if wanted <= least:
                return None
            dt = 0.5 * wanted

    def _level(self, span: Span, dt: float) -> float:
        """Return the longest admissible length of a step that does not exceed dt."""
        limits = _bounds(span)
        if dt <= limits.least or dt >= limits.most:
            return min(max(dt, limits.least), limits.most)
        if span.stage.slides:
            cell = one_cell(span.stage, self.job.grid)
            return min(cell * cells_per_step(dt / cell), limits.most)
        power = math.floor(REST_LEVELS * math.log2(dt / limits.least) + SAME_LEVEL)
        return min(limits.least * 2.0 ** (power / REST_LEVELS), limits.most)

    def _first(self, chosen: ChosenSteps, span: Span) -> float:
        """Return the length of the first step of a stage."""
        limits = _bounds(span)
        if self._goes_on(span) and chosen.next:
            return self._level(span, chosen.next)
        if span.stage.speed:
            cell = one_cell(span.stage, self.job.grid)
            return min(limits.most, max(limits.least, self._first_shear() * cell) if self.job.sheared_first else cell)
        return self._level(span, RELAXING * self.body.shortest_time)

    def _first_shear(self) -> float:
        """Return the cells slid in the first step of a stage if points are sheared first. A body that is stiffer at
        once reaches the bounds of tractions, which belong to the relaxed body, after a shorter way."""
        body = self.job.material.fitted
        return LEAST_SHEAR * body.long_modulus / body.instant_modulus

    def _goes_on(self, span: Span) -> bool:
        """Return whether the stage before chose its steps and had the same velocity and load."""
        if span.index == 0 or span.jumps:
            return False
        before = self.timeline.history[span.index - 1]
        return before.chooses and before.velocity == span.stage.velocity

    def _step(self, chosen: ChosenSteps, span: Span, number: int, dt: float, rejected: bool = False) -> Step:
        """Return a step of about this length that ends at a multiple of its length, or with the stage."""
        ends = span.ends
        assert isinstance(ends, ChosenEnds)
        now = ends.made[-1] if ends.made else 0.0
        stop = ends.next_stop(now)
        if span.stage.slides:
            dt = self._to_a_multiple(span, now, dt)
        elif STRETCH * dt < stop - now < 2.0 * dt:
            dt = 0.5 * (stop - now)
        if stop - now <= (STRETCH if not span.stage.slides else 1.0 + SAME_LEVEL) * dt:
            return self._ending(chosen, span, number, stop - now, stop, rejected)
        return self._ending(chosen, span, number, dt, now + dt, rejected)

    def _to_a_multiple(self, span: Span, now: float, dt: float) -> float:
        """Return the time until the surface is at a multiple of the way of such a step: at least LEAST_WAY of it.

        After half a multiple the step is a half, so that a step that has just grown is not three times as long as
        the last one.
        """
        if span.stage.velocity[1]:
            return dt
        (x, _), (along, _) = span.origin, span.stage.velocity
        cell = one_cell(span.stage, self.job.grid)
        at = math.copysign(1.0, along) * x / self.job.grid.dx + now / cell
        size = dt / cell
        if at + SAME_LEVEL * size == at:  # positions do not resolve the step
            return dt
        way = (math.ceil(at / size + LEAST_WAY_LEFT) * size - at) * cell
        return dt if math.isclose(way, dt, rel_tol=SAME_LEVEL) else way

    def _ending(self, chosen: ChosenSteps, span: Span, number: int, dt: float, end: float, rejected: bool) -> Step:
        """Return the step of this length and end [s after the start of the stage]."""
        (x, y), (along_x, along_y), moving = span.origin, span.stage.velocity, span.stage.moving(end)
        made = chosen.ends.get(span.index, [])
        last = made[-1] - (made[-2] if len(made) > 1 else 0.0) if made else 0.0
        step = Step(
            number,
            span.index,
            span.start + end,
            dt,
            (x + along_x * moving, y + along_y * moving),
            span.mean_velocity(end, dt),
            span.stage.control,
            span.stage.load.at(end / span.stage.seconds, end),
            dt / last if last > 0.0 else 0.0,
        )
        return step._replace(decide=partial(self.decide, chosen, span, step, end, rejected))


def tolerance_before(job: Job, stage: int, relaxes: bool) -> float:
    """Return the largest tolerance of the last solve before a stage. It is CLOSE if the body relaxes and the velocity,
    control or load changes where the stage starts; otherwise it is infinite."""
    history, start = job.history, job.initial
    if stage == len(history) or not relaxes:
        return math.inf
    before = start.velocity, "pressure", start.pressure or 0.0
    if stage:
        before = history[stage - 1].velocity, history[stage - 1].control, history[stage - 1].load.end
    after = history[stage].velocity, history[stage].control, history[stage].load.start
    return math.inf if before == after else CLOSE


def cells_per_step(most: float) -> float:
    """Return the longest admissible distance of a step that is at most `most`, in cells. Admissible are 1, 2, 4, ...
    cells, and 1/2, 1/3, ... 1/8, 1/10, ... of a cell."""
    if most >= 1.0 - SAME_LEVEL:
        return 2.0 ** math.floor(math.log2(most) + SAME_LEVEL)
    count = (1.0 - SAME_LEVEL) / most
    unit = max(1, 2 ** (math.floor(math.log2(count)) - LEVELS))
    return 1.0 / (math.ceil(count / unit) * unit)


def _room(parts: ErrorParts, share: float, accuracy: float) -> float:
    """Return the factor by which the estimated error of the solver may grow; infinite if it is 0."""
    allowed = share * max(accuracy, parts.total - parts.solver)
    return allowed / parts.solver if parts.solver > 0.0 else math.inf


def _bounds(span: Span) -> Bounds:
    assert isinstance(span.ends, ChosenEnds)
    return span.ends.limits

"""Time steps that follow the error of a step.

The error E of a step of length dt is estimated from that step alone (`accuracy.time_error`). It is to be `allowed` E0,
a share of `numerics.accuracy`. As E goes with dt^p (p = 3 for steps in which the displacement is quadratic, 1.7 where
it is linear, 1 for backward Euler), the next is

    dt <- dt clip(SAFETY (E0/E)^(1/p), 1, MOST_GROWTH),

and a step with E > REJECTED E0 is made anew from the same state, `max((REJECTED E0/E)^(1/p), MOST_SHRINK)` times as
long; the one after it does not grow (E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I
(1993), II.4). At rest steps are a shortest one times powers of the fourth root of two, so that rounding has no part in
their length.

While the surface slides, steps end at multiples of their length, counted in cells from where the surface was at first
(block time steps; S. L. W. McMillan, in The Use of Supercomputers in Stellar Dynamics (1986) 156): after a jump,
parts of a cell, as large as E allows, lead back to whole cells, by which heights are moved without a transform. Halves,
thirds and quarters start from the pressure of a whole cell ago (`starts`).
"""

import math
from dataclasses import dataclass
from functools import partial

from ..accuracy.time_error import order_of_time_error
from ..history.chosen import Bounds, ChosenEnds, ChosenSteps, MadeStep, reached
from ..history.timeline import Span, Step
from ..job.checks.cells import one_cell
from ..scene import Scene

TIME_SHARE = 0.8  # accuracy: of numerics.accuracy, for the error of a step
SAFETY = 0.98  # tuning: of the length with which the error would be the one allowed
REJECTED = 1.19  # accuracy: times the error allowed; that of a slide varies from step to step, and its mean counts
MOST_GROWTH, MOST_SHRINK = 2.0, 1.0 / 16.0  # tuning: of a step over the one before it, or over one rejected
LEVELS = 2  # tuning: the power of two of the number of lengths, of steps below a quarter of a cell, per factor of two
REST_LEVELS = 4  # tuning: the same at rest
LEAST_WAY = 0.35  # tuning: of a step that ends at a multiple of its length
STRETCH = 1.1  # tuning: of the last step of a stage: no step shorter than a tenth of the one before is left over
SNAP_SHARE = 1.0 / 64.0  # accuracy: of the longest step of a stage: in a shorter one the edge of contact may snap
RELAXING = 0.1  # accuracy: of the shortest relaxation time: the same; and the first step at rest after a jump
SAME_LEVEL = 1e-6  # rounding: of a level


def cells_per_step(most: float) -> float:
    """Return the longest way of a step that is no longer: 1, 2, 4 cells, or a half, a 3rd, ... 8th, 10th, ... of
    one."""
    if most >= 1.0 - SAME_LEVEL:
        return 2.0 ** math.floor(math.log2(most) + SAME_LEVEL)
    count = (1.0 - SAME_LEVEL) / most
    unit = max(1, 2 ** (math.floor(math.log2(count)) - LEVELS))
    return 1.0 / (math.ceil(count / unit) * unit)


@dataclass(frozen=True)
class StepChooser:
    """Proposes the next step of a stage that chooses its own, and judges it when it has been tried.

    `chosen` are the steps made so far.
    """

    scene: Scene
    chosen: ChosenSteps

    def propose(self, span: Span, number: int) -> Step:
        """Return the next step of a stage; it has this number."""
        first = number == span.before + span.jumps + 1
        return self._step(span, number, self._first(span) if first else self.chosen.next)

    def judge(
        self, span: Span, step: Step, end: float, rejected: bool, error: float, front: float = 0.0, begins: bool = False
    ) -> Step | MadeStep:
        """Return the shorter step to make instead of one with such an error, or how the step is noted as made.

        It ends the stage at `end` [s]; `rejected` says whether a longer one was tried before. The `front` of a contact
        with adhesion has moved by so many half process zones, of which one is allowed, but where it snaps. Steps in
        which it snaps, `begins` or ends are a share of the shortest relaxation time: what is sudden meets the body
        before it relaxes. Where energies are asked for, so is what each point loses as it closes: then the root of the
        accuracy is allowed.
        """
        numerics = self.scene.choices.numerics
        order = order_of_time_error(numerics.integrator, step.growth > 0.0)
        ratio = error / (TIME_SHARE * numerics.asked.of_steps)
        sudden = min(SNAP_SHARE * self._bounds(span).most, RELAXING * self.scene.material.shortest_time)
        if step.dt > sudden:
            relaxes = self.scene.material.branched is not None
            allowed = math.sqrt(numerics.asked.of_steps) if relaxes and self.scene.energy is not None else 1.0
            ratio = max(ratio, (front / allowed) ** order, (step.dt / sudden) ** order if begins and relaxes else 0.0)
        wanted = SAFETY * ratio ** (-1.0 / order) if ratio > 0.0 else MOST_GROWTH
        if ratio > REJECTED:
            share = max((REJECTED / ratio) ** (1.0 / order), MOST_SHRINK)
            if shorter := self._shorter(span, step, share):
                return shorter
            rejected = True
        most = 1.0 if rejected else MOST_GROWTH
        return MadeStep(span.index, end, self._level(span, step.dt * min(max(wanted, 1.0), most)))

    def _shorter(self, span: Span, step: Step, share: float) -> Step | None:
        """Return a step that is at most that share of one, None if that one is the shortest."""
        least, dt = self._bounds(span).least, share * step.dt
        while True:
            wanted = self._level(span, dt)
            shorter = self._step(span, step.number, wanted, rejected=True)
            if shorter.dt < step.dt * (1.0 - SAME_LEVEL):
                return shorter
            if wanted <= least:
                return None
            dt = 0.5 * wanted

    # -- parts --------------------------------------------------------------------------------------------------------

    def _bounds(self, span: Span) -> Bounds:
        assert isinstance(span.ends, ChosenEnds)
        return span.ends.limits

    def _level(self, span: Span, dt: float) -> float:
        """Return the longest of the lengths that steps may have which is no longer than dt."""
        limits = self._bounds(span)
        if dt <= limits.least or dt >= limits.most:
            return min(max(dt, limits.least), limits.most)
        if span.stage.speed:
            cell = one_cell(span.stage, self.scene.choices.grid)
            return min(cell * cells_per_step(dt / cell), limits.most)
        power = math.floor(REST_LEVELS * math.log2(dt / limits.least) + SAME_LEVEL)
        return min(limits.least * 2.0 ** (power / REST_LEVELS), limits.most)

    def _first(self, span: Span) -> float:
        """Return how long to try the first step of a stage."""
        limits = self._bounds(span)
        if self._goes_on(span) and self.chosen.next:
            return self._level(span, self.chosen.next)
        if span.stage.speed:
            return min(limits.most, one_cell(span.stage, self.scene.choices.grid))
        return self._level(span, RELAXING * self.scene.material.shortest_time)

    def _goes_on(self, span: Span) -> bool:
        """Return whether nothing has changed since the stage before, which chose its steps too."""
        if span.index == 0 or span.jumps:
            return False
        before = self.scene.choices.timeline.history[span.index - 1]
        return before.chooses and before.velocity == span.stage.velocity

    def _step(self, span: Span, number: int, dt: float, rejected: bool = False) -> Step:
        """Return the step that is about so long: it ends at a multiple of its length, or with the stage."""
        ends = span.ends
        assert isinstance(ends, ChosenEnds)
        now = ends.made[-1] if ends.made else 0.0
        stop = next(stop for stop in ends.stops if not reached(now, stop))
        if span.stage.speed:
            dt = self._to_a_multiple(span, now, dt)
        elif STRETCH * dt < stop - now < 2.0 * dt:
            dt = 0.5 * (stop - now)
        if stop - now <= (STRETCH if not span.stage.speed else 1.0 + SAME_LEVEL) * dt:
            return self._ending(span, number, stop - now, stop, rejected)
        return self._ending(span, number, dt, now + dt, rejected)

    def _to_a_multiple(self, span: Span, now: float, dt: float) -> float:
        """Return how long until the surface is at a multiple of the way of such a step: LEAST_WAY of it, or longer.

        From half a multiple it is half of one: a step that has just grown is not three times the one before.
        """
        if span.stage.velocity[1]:
            return dt
        (x, _), (along, _) = span.origin, span.stage.velocity
        cell = one_cell(span.stage, self.scene.choices.grid)
        at = math.copysign(1.0, along) * x / self.scene.choices.grid.dx + now / cell
        size = dt / cell
        way = (math.ceil(at / size + LEAST_WAY) * size - at) * cell
        return dt if math.isclose(way, dt, rel_tol=SAME_LEVEL) else way

    def _ending(self, span: Span, number: int, dt: float, end: float, rejected: bool) -> Step:
        """Return the step that is so long and ends so long after the start of the stage."""
        (x, y), (along_x, along_y) = span.origin, span.stage.velocity
        made = self.chosen.ends.get(span.index, [])
        last = made[-1] - (made[-2] if len(made) > 1 else 0.0) if made else 0.0
        step = Step(
            number,
            span.index,
            span.start + end,
            dt,
            (x + along_x * end, y + along_y * end),
            span.stage.velocity,
            span.stage.control,
            span.stage.load.at(min(end / span.stage.seconds, 1.0)),
            dt / last if last > 0.0 else 0.0,
        )
        return step._replace(judge=partial(self.judge, span, step, end, rejected))

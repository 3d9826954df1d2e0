"""One step: one contact solve makes the next state of a march."""

import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from ..effects.effect import Instant, values_of
from ..history.chosen import SYMBOLS, ChosenSteps
from ..history.timeline import Step, Timeline
from ..parallel.slab import Array
from ..physics.body import Trial, ZenerBody
from ..physics.energy import Pressed
from ..physics.entries import Entry
from ..physics.measures import Measures
from ..scene import Scene, solver_in_double, solver_on
from ..solve.contact import Contact, ContactSolver
from ..solve.fallback import cold_start, retry
from ..solve.problem import Approach, MeanPressure, Operators, Problem
from ..storage.checkpoint import Contents
from ..storage.row import Row
from . import failure, state
from .errors import Errors, Estimate
from .failure import StepError
from .starts import Starts
from .state import FURTHER, Past, State

FULL_CONTACT_ROUNDING = 1e-14  # relative to lengths whose sum is compared with 0


class March:
    """A scene at an instant, and how it advances.

    A step works in maps of its own, and its state replaces the last one when it has succeeded: then the two exchange
    their maps. So one that fails leaves the state as it was.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        slab = scene.slab
        earlier = slab.zeros() if scene.choices.extrapolated_starts.on else None
        further = tuple(Past(slab.zeros()) for _ in range(FURTHER * scene.choices.further_starts.on))
        setup, highest = scene.setup, scene.setup.heights.highest  # at no load the surface just touches the body
        touching = Measures(approach=0.0 - highest - setup.surface.datum, mean_gap=highest - setup.heights.mean)
        row, d = self._complete(Row(measures=touching)), -highest / scene.units.height
        self.state = State(row, slab.zeros(), earlier, approach=d, further=further)
        self._next_pressure = slab.zeros()
        self._errors = Errors(scene)
        self.starts = Starts(scene)
        self._elastic_displacement: Array | None = None  # of the solver: until its next solve
        self.chosen = ChosenSteps.of(scene.job) if Timeline.of(scene.job).chooses else None

    @property
    def row(self) -> Row:
        """What the last step is recorded as."""
        return self.state.row

    def timeline(self, until: float = 0.0) -> Timeline:
        """All steps of the history, as `Timeline.of` has them, with those that have been chosen so far."""
        return Timeline.of(self.scene.job, until, self.chosen)

    def advance(self, step: Step) -> Row:
        """Make the next state, or with a shorter step if its judge asks for it; collective.

        Raises StepError, and leaves the last state, when that cannot be.
        """
        began, tally, scene, old = time.perf_counter(), self.scene.slab.tally, self.scene, self.state
        calls = tally["operator"]
        while True:
            trial, contact, remark, measures = self._try(step)
            errors = self._commit(step, trial, contact, measures)
            shorter = self._judge(step, errors)
            if shorter is None:
                break
            step = shorter
        if scene.energy is not None:
            now, before = Pressed(contact.p, trial.alpha), Pressed(old.pressure, old.alpha)
            scene.energy.advance(step.dt, now, before, contact.u)
        self._elastic_displacement = contact.u
        slid = math.dist(step.position, old.position)
        row = Row(
            step.number,
            step.time,
            old.row.distance + slid,
            measures,
            contact.iterations,
            contact.certificate,
            tally["operator"] - calls,
            seconds=time.perf_counter() - began,
            remark=remark,
            errors=errors.budget,
        )
        self.starts.learn(contact.iterations)
        earlier, further, self._next_pressure = _shifted(old)
        here, there = step.position, old.position
        self.state = State(row, contact.p, earlier, trial.alpha, old.alpha, contact.d, here, there, further)
        if scene.followers:
            instant = Instant(step, contact.p, trial.alpha, self._displacement(), slid, measures)
            for follower in scene.followers.values():
                follower.follow(instant)
        self.state = replace(self.state, row=self._complete(row))
        return self.row

    def entries(self) -> dict[str, Entry]:
        """Everything remembered after the last step, by names `part/name`; maps are the run's own, not copies."""
        own = {**self._chosen_entries(), **self._errors.entries(), **self.starts.entries()}
        return {**state.entries(self.scene, self.state), **own}

    def restore(self, contents: Contents) -> None:
        """Go on from a checkpoint; collective. Raises InputError for one that does not fit."""
        restored = state.restore(self.scene, self.state, contents)
        self._errors.restore(contents.numbers)
        self.starts.restore(contents.numbers)
        if self.chosen is not None:
            self.chosen = ChosenSteps.of(self.scene.job, contents.numbers)
        self.begin_with(replace(restored, row=self._complete(restored.row)))

    def begin_with(self, begun: State) -> None:
        """Go on from another state; its pressures are copied unless they are the run's own."""
        self.state.pressure[...] = begun.pressure
        if self.state.earlier is not None:
            self.state.earlier[...] = begun.pressure if begun.earlier is None else begun.earlier
        further = begun.further or tuple(Past(past.pressure) for past in self.state.further)
        self.state = replace(begun, pressure=self.state.pressure, earlier=self.state.earlier, further=further)
        self._elastic_displacement = None

    # -- the parts of a step ------------------------------------------------------------------------------------------

    def _try(self, step: Step) -> tuple[Trial, Contact, str, Measures]:
        """The contact of a step, what was unusual about it and what it measures; collective. Raises StepError."""
        scene = self.scene
        trial = scene.material.begin(step.dt, scene.motion.at(step.position))
        contact, remark = self._solve(step, trial)
        measures = scene.ledger.measures(
            contact.p, trial.alpha, contact.u, trial.effective, contact.d, step.position, step.velocity
        )
        if not measures.finite:
            raise failure.not_finite(scene, step, measures)
        return trial, contact, remark, measures

    def _commit(self, step: Step, trial: Trial, contact: Contact, measures: Measures) -> Estimate:
        """Let the body go on; how wrong the step is. The displacement before it is kept if it may be taken back."""
        material = self.scene.material
        if step.judge is not None and isinstance(material, ZenerBody):
            self._kept()[...] = material.u
        material.commit(trial, contact.u)
        return self._errors.of(step, trial, contact, measures)

    def _judge(self, step: Step, error: Estimate) -> Step | None:
        """The shorter step to make instead, the body being as before this one; None for a step that is good."""
        if step.judge is None:
            return None
        shorter = step.judge(step, self.scene.slab.agree(error.step))
        if shorter is not None and isinstance(self.scene.material, ZenerBody):
            self.scene.material.take_back(self._kept())
            self._errors.take_back()
        return shorter

    def _chosen_entries(self) -> dict[str, Entry]:
        """The steps that stages have chosen; none where no stage chooses."""
        if self.chosen is None:
            return {}
        return {name: Entry(np.array(numbers), 1.0, SYMBOLS[name]) for name, numbers in self.chosen.numbers().items()}

    def _kept(self) -> Array:
        """A map for the displacement before a step, until the next solve."""
        return self.scene.solver.workspace.pressure

    def _solve(self, step: Step, trial: Trial) -> tuple[Contact, str]:
        """The contact of a step, and what was unusual about it; collective. Raises StepError."""
        scene = self.scene
        control, constraint = self._control(step, trial), scene.constraint(trial.alpha)
        problem = Problem(*scene.operators, trial.effective, constraint, control)
        start = self.starts.make(step, self.state, trial.alpha, self._next_pressure)
        self._elastic_displacement = None
        if self.state.alpha == 0.0:  # nothing has been solved before
            cold_start.prepare(scene.solver, problem, start, partial(solver_on, scene.setup))
        contact, remark = scene.solver.solve(problem, start), ""
        if contact.failure:
            in_double = solver_in_double(scene.setup)
            if in_double is not None or not self._accepts(contact):
                contact, remark = self._retry(step, problem, contact, in_double)
        if step.passed:
            remark = "; ".join(filter(None, (remark, self._passed(step))))
        return contact, remark

    def _control(self, step: Step, trial: Trial) -> MeanPressure | Approach:
        scene, grid = self.scene, self.scene.job.grid
        if step.control == "approach":
            d = (step.load + scene.setup.surface.datum) / scene.units.height
            self._refuse_beyond_full_contact(step, d, trial.effective)
            return Approach(d)
        mean = step.load / (grid.lx * grid.ly) if step.control == "force" else step.load
        return MeanPressure(mean / (trial.alpha * scene.units.pressure))

    def _refuse_beyond_full_contact(self, step: Step, d: float, effective: Array) -> None:
        """A periodic half space cannot follow an approach that puts its mean surface below its undeformed level, but
        where the rigid surface yields."""
        scene = self.scene
        if scene.job.grid.boundary == "periodic" and scene.job.material.hardness is None:
            mean = scene.slab.sum(float(effective.sum(dtype=np.float64)))[0] / scene.slab.points
            datum = scene.setup.surface.datum
            rounding = FULL_CONTACT_ROUNDING * (abs(step.load) + abs(datum) + scene.setup.height) / scene.units.height
            if d + mean > rounding:
                most = -mean * scene.units.height - datum
                raise StepError(
                    f"step {step.number}: an approach of {step.load:g} m is beyond full contact, which a periodic body "
                    f"reaches at {most:g} m; prescribe a pressure instead"
                )

    def _accepts(self, contact: Contact) -> bool:
        """Whether the job takes a solve that did not reach the tolerance."""
        return self.scene.job.numerics.accept_unconverged and math.isfinite(contact.certificate.worst)

    def _retry(
        self,
        step: Step,
        problem: Problem,
        failed: Contact,
        in_double: Callable[[], tuple[ContactSolver, Operators]] | None,
    ) -> tuple[Contact, str]:
        """Retry a solve that failed, one that would do as it is only in double precision; the contact, and what to say
        of it. Raises StepError when nothing helps."""
        scene, would_do, on = self.scene, self._accepts(failed), partial(solver_on, self.scene.setup)
        most = 1 if would_do else None
        contact, tried = retry.again(scene.solver, problem, failed, on, in_double, most)
        if contact.failure:
            if would_do and self._accepts(contact):
                return contact, ""
            moved = math.hypot(*self.starts.cells(step, self.state.position))
            raise failure.of_solve(scene, step, failed, contact, tried, problem.heights, moved)
        what = f"{failure.where(scene, step)}: the contact solve {failed.failure}"
        return contact, f"{what}; solved when retried with {', with '.join(tried)}"

    def _passed(self, step: Step) -> str:
        what = f"{failure.where(self.scene, step)} stands for the {step.passed} before it"
        return f"{what}: at rest under a constant load nothing changes by more than the tolerance"

    # -- what is recorded ---------------------------------------------------------------------------------------------

    def _complete(self, row: Row) -> Row:
        """A row with the energies, and with the columns of effects."""
        work, stored, lost, split = self._energies()
        added = values_of(self.scene.followers)
        return replace(row, work=work, stored=stored, dissipated=lost, branch_dissipation=split, added=added)

    def _energies(self) -> tuple[float, float, float, tuple[float, ...]]:
        """Work, stored and dissipated energy [J], and the dissipation of each branch; NaN if not asked for."""
        energy = self.scene.energy
        if energy is None:
            return math.nan, math.nan, math.nan, ()
        balance, unit = energy.balance, energy.unit
        lost = tuple(float(value) * unit for value in balance.dissipated)
        return balance.work * unit, balance.stored * unit, math.fsum(lost), lost

    def _displacement(self) -> Array:
        """Of the body's surface; collective. An elastic body does not remember it: it follows from the pressure."""
        if isinstance(self.scene.material, ZenerBody):
            return self.scene.material.u
        if self._elastic_displacement is None:
            image = self.scene.solver.workspace.displacement
            self._elastic_displacement = self.scene.operators.operator.apply(self.state.pressure, image)
            self._elastic_displacement *= self.state.alpha / self.scene.material.modulus  # 1 after a step of ours
        return self._elastic_displacement

    def field(self, name: str) -> Array:
        """This rank's rows of `pressure` [Pa], `displacement`, `gap` or `height` [m], as a new array.

        `height` is that of the rigid surface where it is now, so that `gap = displacement - height - approach`.
        """
        scene, units = self.scene, self.scene.units
        if name == "pressure":
            return self.state.pressure * (self.state.alpha * units.pressure)
        u = self._displacement()
        if name == "displacement":
            return u * units.height
        base, offset = scene.motion.at(self.state.position).parts
        heights = np.roll(base, offset, axis=1)
        if name == "height":
            return heights * units.height + scene.setup.surface.datum
        return (u - heights - self.state.approach) * units.height


def _shifted(old: State) -> tuple[Array | None, tuple[Past, ...], Array]:
    """The earlier and the further pressures after a step, and the map that is free for the next one."""
    if old.earlier is None:
        return None, (), old.pressure
    *kept, oldest = old.pasts[1:]
    return old.pressure, tuple(kept), oldest.pressure

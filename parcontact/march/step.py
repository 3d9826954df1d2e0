"""The time loop: one contact solve per step, then everything that is due."""

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ..effects.effect import Instant
from ..job.timeline import Step
from ..parallel import rows
from ..parallel.slab import Array
from ..physics import loops
from ..physics.body import Elastic, Zener
from ..physics.energy import Pressed
from ..physics.entries import Entry, Remembers, Saved
from ..physics.units import Units
from ..record.checkpoint import Contents
from ..record.row import Row
from ..scene import Scene, solver_on
from ..solve import retry
from ..solve.contact import Approach, Contact, MeanPressure
from . import failure, state
from .failure import StepError
from .rest import steps_to_make

Task = Callable[["March"], bool | None]
ROUND_OFF = 1e-14  # relative to lengths whose sum is compared with 0


class March:
    """A scene at an instant, and how it advances."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        work, stored, lost, split = self._energies()
        self.row = Row(work=work, stored=stored, dissipated=lost, branch_dissipation=split, added=self._added())
        self.position = (0.0, 0.0)
        self.alpha = self.alpha_old = self.d = 0.0
        slab, dtype = scene.slab, scene.solver.p.dtype
        self.p_old = slab.zeros(dtype) if scene.lasts else None
        self._u = scene.solver.u

    @property
    def p(self) -> Array:
        """The pressure over `alpha`, in the run's units."""
        return self.scene.solver.p

    def advance(self, step: Step) -> Row:
        """Solve one step and commit it; collective. Raises StepError, and is as before, when that cannot be."""
        began, tally = time.perf_counter(), self.scene.slab.tally
        calls = tally["operator"]
        heights = self.scene.path.at(step.position)
        alpha, effective = self.scene.material.begin(step.dt, heights)
        control = self._control(step, alpha, effective)
        self._start(step, alpha)
        contact, remark = self.scene.solver.solve(effective, control), ""
        if contact.failure and not self._accepts(contact):
            contact, remark = self._again(step, effective, control, contact)
        if step.passed:
            remark = "; ".join(filter(None, (remark, self._passed(step))))
        measures = self.scene.ledger.measures(contact.p, alpha, contact.u, effective, contact.d, step.position)
        self.scene.material.commit(contact.u, heights)
        self.alpha_old, self.alpha = self.alpha, alpha
        if self.scene.energy is not None:
            before = None if self.p_old is None else Pressed(self.p_old, self.alpha_old)
            self.scene.energy.advance(step.dt, Pressed(contact.p, alpha), before, contact.u)
        slid = math.dist(step.position, self.position)
        self.position = step.position
        self._u, self.d = contact.u, contact.d
        self.row = Row(
            step.number,
            step.time,
            self.row.distance + slid,
            measures,
            contact.iterations,
            contact.certificate,
            tally["operator"] - calls,
            *self._energies(),
            seconds=time.perf_counter() - began,
            remark=remark,
        )
        if self.scene.followers:
            instant = Instant(step, contact.p, alpha, self._displacement, slid, measures)
            for follower in self.scene.followers.values():
                follower.follow(instant)
            self.row = replace(self.row, added=self._added())
        return self.row

    def entries(self) -> dict[str, Entry]:
        """Everything remembered after the last step, by names `part/name`; maps are the run's own, not copies."""
        return state.entries(self._parts, self.scene.units)

    def restore(self, contents: Contents) -> None:
        """Go on from a checkpoint, before the first step; collective. Raises InputError for one that does not fit."""
        state.restore(self._parts, self.scene, contents, self.scene.slab)
        work, stored, lost, split = self._energies()
        self.row = replace(
            self.row,
            step=contents.step,
            time=contents.time,
            work=work,
            stored=stored,
            dissipated=lost,
            branch_dissipation=split,
            added=self._added(),
        )
        if isinstance(self.scene.material, Elastic):
            self._u = self.scene.solver.operator.apply(self.p, self.scene.solver.u)

    def _added(self) -> tuple[float, ...]:
        """What effects have for their columns."""
        return tuple(float(value) for follower in self.scene.followers.values() for value in follower.values())

    @property
    def _parts(self) -> dict[str, Remembers]:
        return {"clock": _Clock(self), "contact": _Pressures(self), **self.scene.parts}

    @property
    def _displacement(self) -> Array:
        material = self.scene.material
        return material.u if isinstance(material, Zener) else self._u

    # -- the parts of a step ------------------------------------------------------------------------------------------

    def _start(self, step: Step, alpha: float) -> None:
        """Put the start of the next solve into the solver: the last pressure, moved with the surface by whole cells and
        extrapolated."""
        if self.p_old is None:
            return
        grid, slab, solver = self.scene.job.grid, self.scene.slab, self.scene.solver
        now, before = (1.0 + step.growth) * self.alpha / alpha, step.growth * self.alpha_old / alpha
        along_x, along_y = (
            round((new - old) / cell) % count  # a step may pass more boxes than a machine's whole numbers reach
            for new, old, cell, count in zip(step.position, self.position, (grid.dx, grid.dy), grid.points, strict=True)
        )
        if along_y:
            self.p_old, solver.w = rows.roll(slab, self.p_old, along_y, solver.w), self.p_old
        loops.travel(self.p, self.p_old, now, before, along_x)
        if along_y:
            solver.p, solver.w = rows.roll(slab, self.p, along_y, solver.w), self.p

    def _control(self, step: Step, alpha: float, effective: Array) -> MeanPressure | Approach:
        scene, grid = self.scene, self.scene.job.grid
        if step.control == "approach":
            d = (step.load + scene.frame.surface.datum) / scene.units.height
            self._refuse_beyond_full_contact(step, d, effective)
            return Approach(d)
        mean = step.load / (grid.lx * grid.ly) if step.control == "force" else step.load
        return MeanPressure(mean / (alpha * scene.units.pressure))

    def _refuse_beyond_full_contact(self, step: Step, d: float, effective: Array) -> None:
        """A periodic half space cannot follow an approach that puts its mean surface below its undeformed level."""
        scene = self.scene
        if scene.job.grid.boundary == "periodic":
            mean = scene.slab.sum(float(effective.sum(dtype=np.float64)))[0] / scene.slab.points
            datum = scene.frame.surface.datum
            rounding = ROUND_OFF * (abs(step.load) + abs(datum) + scene.frame.height) / scene.units.height
            if d + mean > rounding:
                most = -mean * scene.units.height - datum
                raise StepError(
                    f"step {step.number}: an approach of {step.load:g} m is beyond full contact, which a periodic body "
                    f"reaches at {most:g} m; prescribe a pressure instead"
                )

    def _accepts(self, contact: Contact) -> bool:
        """Whether the job takes a solve that did not reach the tolerance."""
        return self.scene.job.numerics.accept_unconverged and math.isfinite(contact.certificate.worst)

    def _again(
        self, step: Step, effective: Array, control: MeanPressure | Approach, failed: Contact
    ) -> tuple[Contact, str]:
        """Retry a solve that failed; the contact, and what to say of it. Raises StepError when nothing helps."""
        scene = self.scene
        contact, tried = retry.again(scene.solver, effective, control, failed, partial(solver_on, scene.frame))
        if contact.failure:
            error = failure.of_solve(scene, step, failed, contact, tried, effective, self._cells(step))
            self._take_back()
            raise error
        what = f"{failure.where(scene, step)}: the contact solve {failed.failure}"
        return contact, f"{what}; solved when retried with {', with '.join(tried)}"

    def _passed(self, step: Step) -> str:
        what = f"{failure.where(self.scene, step)} stands for the {step.passed} before it"
        return f"{what}: at rest under a constant load nothing changes by more than the tolerance"

    def _cells(self, step: Step) -> float:
        """By how many cells the surface moves in a step."""
        grid, (x, y), (new_x, new_y) = self.scene.job.grid, self.position, step.position
        return math.hypot((new_x - x) / grid.dx, (new_y - y) / grid.dy)

    def _take_back(self) -> None:
        """Be as before a step whose solve has failed.

        The last pressure is kept, the one before it, from which the next would be extrapolated, is lost. A history of
        single solves keeps no pressure but the one that the solve has spoilt: its next solve starts from none.
        """
        solver = self.scene.solver
        last = self.p_old
        if last is None:
            solver.p.fill(0.0)
        else:
            solver.p, self.p_old = last, solver.p
            self.p_old.fill(0.0)
        self._u = solver.operator.apply(solver.p, solver.u)

    def _energies(self) -> tuple[float, float, float, tuple[float, ...]]:
        """Work, stored and dissipated energy [J], and the dissipation of each branch; NaN if not asked for."""
        energy = self.scene.energy
        if energy is None:
            return math.nan, math.nan, math.nan, ()
        balance, unit = energy.balance, energy.unit
        lost = tuple(float(value) * unit for value in balance.dissipated)
        return balance.work * unit, balance.stored * unit, math.fsum(lost), lost

    def field(self, name: str) -> Array:
        """This rank's rows of `pressure` [Pa], `displacement`, `gap` or `height` [m], as a new array.

        `height` is that of the rigid surface where it is now, so that `gap = displacement - height - approach`.
        """
        scene, units = self.scene, self.scene.units
        if name == "pressure":
            return self.p * (self.alpha * units.pressure)
        u = self._displacement
        if name == "displacement":
            return u * units.height
        base, offset = scene.path.at(self.position).parts
        heights = np.roll(base, offset, axis=1)
        if name == "height":
            return heights * units.height + scene.frame.surface.datum
        return (u - heights - self.d) * units.height


class _Clock:
    """Where a run is: its step and time are said by the checkpoint itself."""

    def __init__(self, march: March) -> None:
        self._march = march

    def entries(self, units: Units) -> dict[str, Entry]:
        march = self._march
        return {
            "distance": Entry(march.row.distance, 1.0, "m"),
            "position": Entry(np.array(march.position), 1.0, "m"),
        }

    def restore(self, saved: Saved) -> None:
        x, y = saved["position"].tolist()
        self._march.position = (x, y)
        self._march.row = replace(self._march.row, distance=float(saved["distance"]))


class _Pressures:
    """Pressures, over the modulus of their step. The earlier one is kept by no history of single solves."""

    def __init__(self, march: March) -> None:
        self._march = march

    def entries(self, units: Units) -> dict[str, Entry]:
        march, strain = self._march, units.height / units.length
        earlier = {} if march.p_old is None else {"earlier pressure": Entry(march.p_old, strain, "1", optional=True)}
        return {
            "pressure": Entry(march.p, strain, "1"),
            "modulus": Entry(march.alpha, units.modulus, "Pa"),
            "earlier modulus": Entry(march.alpha_old, units.modulus, "Pa"),
            "approach": Entry(march.d, units.height, "m"),
            **earlier,
        }

    def restore(self, saved: Saved) -> None:
        march = self._march
        march.alpha, march.alpha_old = float(saved["modulus"]), float(saved["earlier modulus"])
        march.d = float(saved["approach"])
        if march.p_old is not None and "earlier pressure" not in saved:
            march.p_old.fill(0.0)


def run(march: March, tasks: Sequence[Task], timeline: Iterable[Step] | None = None) -> bool:
    """Advance through a timeline, after every step doing the tasks in order, until it ends or a task says True.

    Without a timeline it is all of the job's, and the tasks are done for the initial state too. Returns whether a task
    has ended the march.
    """
    job = march.scene.job
    if timeline is None:
        if done(march, tasks):
            return True
        timeline = steps_to_make(march, job.timeline())
    for step in timeline:
        march.advance(step)
        if done(march, tasks):
            return True
    return False


def done(march: March, tasks: Sequence[Task]) -> bool:
    """Do all tasks; whether one of them ends the march."""
    return any([task(march) for task in tasks])  # noqa: C419  # not one less when one ends it

"""A march: a scene, its state, and the loop over the steps of a timeline with the tasks of a caller after each step."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from ..effects.effect import Detached, nothing_holds
from ..errors import InputError
from ..files.checkpoint import Contents, Facts
from ..files.recorder import StepRow
from ..job.calculation import FIELDS_NEED, components_of
from ..job.history import Step, Timeline
from ..parallel.slab import Array
from ..physics.body import remembers
from ..physics.records import Entry
from .budget import ErrorSums
from .laws import DetachedError, choose_contact_law
from .scene import Scene
from .state import State, entries, first_state, restored, save_state
from .step import make_step

FIELDS_OF_EFFECTS = {part: need for name, need in FIELDS_NEED.items() for part in components_of(name)}


class March:
    """A calculation in time: a scene and its state at an instant, which advances step by step."""

    def __init__(self, scene: Scene, state: State | None = None) -> None:
        self.scene = scene
        self.state = self._weighed(first_state(scene) if state is None else state)

    @property
    def row(self) -> StepRow:
        return self.state.row

    @property
    def detached(self) -> str:
        """A sentence if the surfaces have detached and no step follows; '' otherwise."""
        row, end = self.row, choose_contact_law(self.scene).detached(self.state.law)
        if end is None:
            return ""
        time, load = end
        lost = nothing_holds(self.timeline(time).span(row.step + 1).stage.control, load)
        last = f"the last equilibrium was at {row.measures.pressure:g} Pa, t = {row.time:g} s"
        return f"detached at t = {time:g} s: {lost}; {last}"

    def timeline(self, until: float = 0.0) -> Timeline:
        """Return all steps of the history (`Timeline.from_job`), including the steps chosen so far."""
        return Timeline.from_job(self.scene.job, until, self.state.chosen)

    def steps(self, timeline: Timeline | None = None, until: float | None = None) -> Iterator[Step]:
        """Yield the steps after the last one made, each decided on demand; collective. A step that replaces several
        steps ends at the latest with the first one that reaches `until` [s]."""
        timeline = self.timeline() if timeline is None else timeline
        stop = len(timeline) if until is None else timeline.first_reaching(until)
        while self.row.step < len(timeline) and not self.detached:
            yield next_step(self.scene, self.state, timeline, stop)

    def advance(self, step: Step) -> StepRow:
        """Make a step and return its record; collective. Raises StepError and keeps the state if the step fails."""
        try:
            self.state = self._weighed(make_step(self.scene, self.state, step), self.row)
        except DetachedError as end:
            memory = choose_contact_law(self.scene).with_end(self.state.law, Detached(end.time, end.load))
            self.state = self.state.after(law=memory)
        return self.row

    def _weighed(self, state: State, since: StepRow | None = None) -> State:
        """Return the state with its errors added to the sums; the sums begin with a first state."""
        row = state.row
        if row.errors is None:
            return state
        friction = row.measures.friction if row.distance > 0.0 else 0.0
        if since is None:
            return self._with_sums(state, ErrorSums().plus(row.errors, friction, 0.0))
        seconds, slid = row.time - since.time, row.distance - since.distance
        return self._with_sums(state, state.errors.plus(row.errors, friction, seconds, slid))

    @staticmethod
    def _with_sums(state: State, sums: ErrorSums) -> State:
        return state.after(errors=replace(state.memories["errors"], sums=sums))

    def restore(self, contents: Contents) -> None:
        """Restore the state of a checkpoint; collective. Raises InputError for a checkpoint that does not fit."""
        self.state = restored(self.scene, self.state, contents)

    def entries(self) -> dict[str, Entry]:
        """Return all entries of a checkpoint by their names; maps are not copied."""
        return entries(self.scene, self.state)

    def save(self, path: Path, facts: Facts) -> None:
        """Write a checkpoint; collective. Raises RunError."""
        save_state(path, self.scene, self.state, facts)

    def field(self, name: str) -> Array:
        """Return the rows of this rank of `pressure` [Pa], `displacement`, `gap` or `height` [m], or of the rise of
        `temperature` [K], as a new array; collective. Raises InputError for a temperature that is not computed.

        `height` belongs to the rigid surface at its present position, so that `gap = displacement - height - approach`.
        """
        scene, state, units = self.scene, self.state, self.scene.units
        last, gap = state.contact.last, choose_contact_law(scene).gap(state.law)
        for part, effect in scene.effects.items():
            if name in effect.fields:
                return effect.field(state.memories[part], name)
        if name in FIELDS_OF_EFFECTS:
            raise InputError(f"there is no field {name!r} without {FIELDS_OF_EFFECTS[name]} in the job")
        if name == "gap" and gap is not None:
            return gap * units.height
        if name == "pressure":
            return last.pressure * (last.alpha * units.pressure)
        if name == "displacement":
            return self._displacement() * units.height
        if name == "height":
            return scene.heights(last.position) * units.height + scene.setup.surface.datum
        return scene.gap(self._displacement(), last.position, state.contact.approach)

    def _displacement(self) -> Array:
        """Return the displacement of the body, computed from the pressure if needed; collective."""
        scene, last = self.scene, self.state.contact.last
        image, apply = scene.solver.workspace.displacement, scene.operators.operator.apply
        return scene.material.displacement(self.state.body, lambda: apply(last.pressure, image), last.alpha)


def next_step(scene: Scene, state: State, timeline: Timeline, stop: int) -> Step:
    """Return the step after the last one made.

    At rest under a constant load a body without memory does not change: one step then replaces all further steps of a
    stage whose time steps grow. This step ends where fields are due next, or with the step number `stop`. The decision
    follows from the state, so that it is the same after a restart.
    """
    number = state.row.step + 1
    span = timeline.span(number)
    if state.chosen is not None and span.stage.chooses and span.place(number) > 0:
        return scene.controller.propose(state.chosen, span, number)
    if remembers(scene.material) or not span.rests or span.place(number) < 1:
        return span.step(number)
    output = scene.choices.output
    due = [-(-number // output.every) * output.every] if output.fields else []
    target = min([span.last, *due, *([stop] if stop >= number else [])])
    return span.leap(number, target) if target > number else span.step(number)


Task = Callable[[March], bool | None]


def run_steps(march: March, tasks: Sequence[Task], steps: Iterable[Step] | None = None) -> bool:
    """Advance the march step by step, and do the tasks in order after each step, until a task returns True.

    Without `steps` all steps of the job are made, and the tasks are also done before the first one. Return True if a
    task has ended the march.
    """
    if steps is None:
        if run_tasks(march, tasks):
            return True
        steps = march.steps()
    for step in steps:
        march.advance(step)
        if march.detached:
            return False
        if run_tasks(march, tasks):
            return True
    return False


def run_tasks(march: March, tasks: Sequence[Task]) -> bool:
    """Do all tasks. Return True if a task ends the march."""
    return any([task(march) for task in tasks])  # noqa: C419  # all tasks run, also when one ends the march

"""A march: a scene, its state, and the loop over the steps of a timeline with the tasks that a caller has."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from ..effects.thermal import rise_of
from ..history.timeline import Step, Timeline
from ..parallel.slab import Array
from ..physics.budget import ErrorSums
from ..physics.entries import Entry
from ..scene import Scene
from ..storage.checkpoint import Contents, Facts
from ..storage.row import Row
from .choosing import StepChooser
from .failure import DetachedError, nothing_holds
from .state import State, entries, first_state, restored, save
from .step import make_step
from .sticking import NEVER


class March:
    """A scene at an instant; it advances step by step."""

    def __init__(self, scene: Scene, state: State | None = None) -> None:
        self.scene = scene
        self.state = self._weighed(first_state(scene) if state is None else state)

    @property
    def row(self) -> Row:
        return self.state.row

    @property
    def detached(self) -> str:
        """Say that surfaces which stick have come off under their load: there is no further step then; '' otherwise."""
        memory, row = self.state.sticking, self.row
        if memory is None or memory.detached == NEVER:
            return ""
        time, load = memory.detached
        lost = nothing_holds(self.timeline(time).span(row.step + 1).stage.control, load)
        return f"detached at t = {time:g} s: {lost}; {row.measures.pressure:g} Pa at t = {row.time:g} s was held"

    def timeline(self, until: float = 0.0) -> Timeline:
        """Return all steps of the history, as `Timeline.of` has them, with those that have been chosen so far."""
        return Timeline.of(self.scene.job, until, self.state.chosen)

    def steps(self, timeline: Timeline | None = None, until: float | None = None) -> Iterator[Step]:
        """Yield the steps after the last one made, each decided on when it is asked for; collective.

        A step that stands for several does not pass the first that reaches `until` [s].
        """
        timeline = self.timeline() if timeline is None else timeline
        stop = len(timeline) if until is None else timeline.first_reaching(until)
        while self.row.step < len(timeline) and not self.detached:
            yield next_step(self.scene, self.state, timeline, stop)

    def advance(self, step: Step) -> Row:
        """Make the next state; collective. Raises StepError, and stays where it is, when that cannot be."""
        try:
            self.state = self._weighed(make_step(self.scene, self.state, step), self.row)
        except DetachedError as end:
            assert self.state.sticking is not None
            memory = replace(self.state.sticking, detached=(end.time, end.load))
            self.state = replace(self.state, sticking=memory)
        return self.row

    def _weighed(self, state: State, since: Row | None = None) -> State:
        """Return the state with its errors added to the sums; a first state begins the sums."""
        row = state.row
        if row.errors is None:
            return state
        friction = row.measures.friction if row.distance > 0.0 else 0.0
        if since is None:
            return replace(state, errors=ErrorSums().plus(row.errors, friction, 0.0))
        seconds, slid = row.time - since.time, row.distance - since.distance
        return replace(state, errors=state.errors.plus(row.errors, friction, seconds, slid))

    def restore(self, contents: Contents) -> None:
        """Go on from a checkpoint; collective. Raises InputError for one that does not fit."""
        self.state = restored(self.scene, self.state, contents)

    def entries(self) -> dict[str, Entry]:
        """Return everything that is remembered, by its names in a checkpoint; maps are the run's own, not copies."""
        return entries(self.scene, self.state)

    def save(self, path: Path, facts: Facts) -> None:
        """Write a checkpoint; collective. Raises RunError."""
        save(path, self.scene, self.state, facts)

    def field(self, name: str) -> Array:
        """Return this rank's rows of `pressure` [Pa], `displacement`, `gap` or `height` [m], or the rise of
        `temperature` [K], a new array; collective. Raises InputError for a temperature that is not calculated.

        `height` is that of the rigid surface where it is now, so that `gap = displacement - height - approach`.
        """
        scene, state, units = self.scene, self.state, self.scene.units
        if name == "temperature":
            return rise_of(scene.followers)
        if name == "gap" and state.sticking is not None and state.sticking.pasts[0].known:
            return state.sticking.pasts[0].gap * units.height
        if name == "pressure":
            return state.pressure * (state.alpha * units.pressure)
        if name == "displacement":
            return self._displacement() * units.height
        if name == "height":
            return scene.heights(state.position) * units.height + scene.setup.surface.datum
        return scene.gap(self._displacement(), state.position, state.approach)

    def _displacement(self) -> Array:
        """Return the displacement of the body, from the pressure where it is not at hand; collective."""
        scene, state = self.scene, self.state
        image, apply = scene.solver.workspace.displacement, scene.operators.operator.apply
        return scene.material.displacement(state.body, lambda: apply(state.pressure, image), state.alpha)


def next_step(scene: Scene, state: State, timeline: Timeline, stop: int) -> Step:
    """Return the step after the last one made.

    At rest under a constant load nothing changes in a body without memory, where one step takes the place of all others
    of a stage whose time steps grow. It does not pass a step after which fields are due, nor the step number `stop`.
    What is decided follows from the state, and so is the same after a restart.
    """
    number = state.row.step + 1
    span = timeline.span(number)
    if state.chosen is not None and span.stage.chooses and span.place(number) > 0:
        return StepChooser(scene, state.chosen).propose(span, number)
    if scene.material.branched is not None or not span.rests or span.place(number) < 1:
        return span.step(number)
    output = scene.choices.output
    due = [-(-number // output.every) * output.every] if output.fields else []
    target = min([span.last, *due, *([stop] if stop >= number else [])])
    return span.leap(number, target) if target > number else span.step(number)


Task = Callable[[March], bool | None]


def run(march: March, tasks: Sequence[Task], steps: Iterable[Step] | None = None) -> bool:
    """Advance, after every step doing the tasks in order, until the steps end or a task says True.

    Without steps they are all of the job's, and the tasks are done for the state of now too. Returns whether a task has
    ended the march.
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
    """Do all tasks; whether one of them ends the march."""
    return any([task(march) for task in tasks])  # noqa: C419  # not one less when one ends it

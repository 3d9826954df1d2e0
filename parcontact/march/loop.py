"""The loop over the steps of a timeline: after every step, the tasks that a caller has."""

from collections.abc import Callable, Iterable, Sequence

from ..history.timeline import Step
from .rest import steps_to_make
from .step import March

Task = Callable[[March], bool | None]


def run(march: March, tasks: Sequence[Task], timeline: Iterable[Step] | None = None) -> bool:
    """Advance through a timeline, after every step doing the tasks in order, until it ends or a task says True.

    Without a timeline it is all of the job's, and the tasks are done for the initial state too. Returns whether a task
    has ended the march.
    """
    if timeline is None:
        if run_tasks(march, tasks):
            return True
        timeline = steps_to_make(march, march.timeline())
    for step in timeline:
        march.advance(step)
        if run_tasks(march, tasks):
            return True
    return False


def run_tasks(march: March, tasks: Sequence[Task]) -> bool:
    """Do all tasks; whether one of them ends the march."""
    return any([task(march) for task in tasks])  # noqa: C419  # not one less when one ends it

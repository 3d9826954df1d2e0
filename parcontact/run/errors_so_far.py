"""The error budget of a run from its first step on, also where it goes on from a checkpoint."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from numpy.typing import NDArray

from ..history.timeline import Timeline
from ..job import Job
from ..job.sections.settings import BRANCH_SHARE, TOLERANCE_SHARE
from ..physics.budget import Summary
from ..physics.entries import Entry
from ..storage.row import Row
from .half_mesh import HalfMesh, place_of

NAME = "budget/sums"  # in a checkpoint


class ErrorsSoFar:
    """Means over all steps that were recorded, over the distance slid once something slides.

    `saved` are the numbers of the checkpoint after the step `last`, from which it goes on; `half` is what was measured
    on half the mesh, if it was.
    """

    def __init__(self, last: Row, saved: Mapping[str, NDArray[Any]] | None, half: HalfMesh | None = None) -> None:
        self.summary = Summary(saved[NAME] if saved and NAME in saved else None)
        self._last, self._half = last, half

    def weigh(self, row: Row, timeline: Timeline) -> Row:
        """Add a step; the row with all that is known of its errors."""
        if self._half is not None:
            row = replace(row, errors=self._half.judge(row, place_of(timeline, row.step)))
        if row.errors is not None:
            friction = row.measures.friction if row.distance > 0.0 else 0.0
            seconds, slid = row.time - self._last.time, row.distance - self._last.distance
            self.summary.add(row.errors, friction, seconds, slid)
        self._last = row
        return row

    def entries(self) -> dict[str, Entry]:
        """What a checkpoint has of it."""
        return {NAME: Entry(self.summary.numbers)}


def chosen_by_accuracy(job: Job) -> set[str]:
    """The parts of the budget behind which are settings that `numerics.accuracy` has chosen: a smaller one makes them
    smaller. Of time it is so where all stages of a slide choose their steps; without a slide, all that last."""
    numerics = job.numerics
    lasting = [stage for stage in job.history if stage.seconds > 0.0]
    stages = [stage for stage in lasting if stage.speed > 0.0] or lasting
    chosen = {
        "solver": numerics.tolerance == TOLERANCE_SHARE * numerics.accuracy,
        "time": bool(stages) and all(stage.chooses for stage in stages),
        "folded": numerics.branch_error == BRANCH_SHARE * numerics.accuracy,
    }
    return {name for name, by_accuracy in chosen.items() if by_accuracy}

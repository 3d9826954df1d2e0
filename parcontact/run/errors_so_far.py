"""The error budget of a run from its first step on, also where it goes on from a checkpoint."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from numpy.typing import NDArray

from ..job.timeline import Timeline
from ..physics.budget import Summary
from ..physics.entries import Entry
from ..record.row import Row
from .half_mesh import HalfMesh, place_of

NAME = "budget/sums"  # in a checkpoint


class ErrorsSoFar:
    """Means over all steps that were recorded, of friction from the first slide on.

    `saved` are the numbers of the checkpoint after the step at `time` [s] from which it goes on; `half` is what was
    measured on half the mesh, if it was.
    """

    def __init__(self, time: float, saved: Mapping[str, NDArray[Any]] | None, half: HalfMesh | None = None) -> None:
        self.summary = Summary(saved[NAME] if saved and NAME in saved else None)
        self._time, self._half = time, half

    def weigh(self, row: Row, timeline: Timeline) -> Row:
        """Add a step, for as long as it lasted; the row with all that is known of its errors."""
        if self._half is not None:
            row = replace(row, errors=self._half.judge(row, place_of(timeline, row.step)))
        if row.errors is not None:
            friction = row.measures.friction if row.distance > 0.0 else 0.0
            self.summary.add(row.errors, friction, row.time - self._time)
        self._time = row.time
        return row

    def entries(self) -> dict[str, Entry]:
        """What a checkpoint has of it."""
        return {NAME: Entry(self.summary.numbers)}

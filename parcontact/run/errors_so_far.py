"""The error budget of a run from its first step on, also where it goes on from a checkpoint."""

from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from ..physics.budget import Summary
from ..physics.entries import Entry
from ..record.row import Row

NAME = "budget/sums"  # in a checkpoint


class ErrorsSoFar:
    """Means over all steps that were recorded, of friction from the first slide on.

    `saved` are the numbers of the checkpoint after the step at `time` [s] from which it goes on.
    """

    def __init__(self, time: float, saved: Mapping[str, NDArray[Any]] | None = None) -> None:
        self.summary = Summary(saved[NAME] if saved and NAME in saved else None)
        self._time = time

    def weigh(self, row: Row) -> None:
        """Add a step, for as long as it lasted."""
        if row.errors is not None:
            friction = row.measures.friction if row.distance > 0.0 else 0.0
            self.summary.add(row.errors, friction, row.time - self._time)
        self._time = row.time

    def entries(self) -> dict[str, Entry]:
        """What a checkpoint has of it."""
        return {NAME: Entry(self.summary.numbers)}

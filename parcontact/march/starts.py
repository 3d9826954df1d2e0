"""From which pressure the solve of a step starts.

Pressures change with time t and move with the surface. Where it has moved by whole cells since one of the last steps,
that pressure is moved as well, without rounding: it is the solution itself where nothing else has changed, as in steady
sliding, and a solve needs no iteration. With steps of a whole cell that is the last pressure, extrapolated with the one
before it; with halves the one before it, with thirds and quarters those before that, which are kept in slides that
choose their own steps.

Where the body still changes, as long after a jump of velocity, the last two pressures, extrapolated in the body's
frame, are the better start with parts of a cell: the edges of contact are then off by less than the changes of a whole
cell. Which of the two takes fewer iterations is seen from the last solves with each.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..history.timeline import Step
from ..parallel import rows
from ..parallel.slab import Array
from ..physics import loops
from ..physics.entries import Entry
from ..physics.motion import are_whole, cells_between
from ..scene import Scene
from .state import Past, State

NAME = "contact/iterations of starts"  # in a checkpoint
TRY_AGAIN = 16  # steps after which the kind of start that was worse may have become the better one
FORGET = 128  # steps without a choice after which nothing is known any more
LEAST_MOVED, LEAST_EXTRAPOLATED = 0.0, 1.0  # iterations that a solve takes with each, if nothing is known


class Starts:
    """Makes the starts of one scene, and where more pressures are kept learns of which kind they should be."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._moved, self._extrapolated, self._since = LEAST_MOVED, LEAST_EXTRAPOLATED, 0.0
        self._has_choice = self._is_moved = False

    @property
    def prefers_moved(self) -> bool:
        """Whether a pressure of whole cells ago took fewer iterations than the last two, or next to none."""
        return self._moved <= LEAST_EXTRAPOLATED or self._moved < self._extrapolated

    @property
    def _moves(self) -> bool:
        """Whether the next start is a pressure of whole cells ago: the better kind or now and then the other one."""
        if self._since < TRY_AGAIN or self._moved <= LEAST_EXTRAPOLATED:
            return self.prefers_moved
        return not self.prefers_moved

    def make(self, step: Step, state: State, alpha: float, start: Array) -> Array:
        """Put the start of a step, a map of p for the modulus `alpha`, into a map that may be the oldest one kept."""
        if state.earlier is None:
            start[...] = state.pressure
            return start
        last, earlier = state.pasts[:2]
        now, before, growth = last, earlier, step.growth if earlier.alpha > 0.0 else 0.0
        past = self._whole_cells_ago(step, state) if growth > 0.0 else None
        self._has_choice = past is not None and self._scene.choices.further_starts.on
        self._is_moved = past is not None and self._moves
        if past is not None and self._is_moved:
            now, growth = past, 0.0
        self._travel(step, now, before, growth, alpha, start)
        return start

    def learn(self, iterations: int) -> None:
        """From the iterations of the solve with the last start, if it could have been of the other kind."""
        self._since += 1.0
        if not self._has_choice:
            if self._since >= FORGET:
                self._moved, self._extrapolated = LEAST_MOVED, LEAST_EXTRAPOLATED
            return
        preferred = self.prefers_moved
        if self._is_moved:
            self._moved = 0.5 * (self._moved + iterations)
        else:
            self._extrapolated = max(0.5 * (self._extrapolated + iterations), LEAST_EXTRAPOLATED)
        if self._is_moved != preferred or self.prefers_moved != preferred:
            self._since = 0.0

    def entries(self) -> dict[str, Entry]:
        """What was learnt, for a checkpoint; nothing where there is no choice."""
        if not self._scene.choices.further_starts.on:
            return {}
        return {NAME: Entry(np.array([self._moved, self._extrapolated, self._since]))}

    def restore(self, numbers: Mapping[str, Any]) -> None:
        """Go on from the arrays of a checkpoint; with one that has none all is to be learnt again."""
        if NAME in numbers and self._scene.choices.further_starts.on:
            self._moved, self._extrapolated, self._since = numbers[NAME].tolist()

    def _whole_cells_ago(self, step: Step, state: State) -> Past | None:
        """The newest pressure since which the surface has moved by whole cells, unless it is the last one or none."""
        last, *older = state.pasts
        if are_whole(self.cells(step, last.position)):
            return None
        return next((past for past in older if past.alpha > 0.0 and are_whole(self.cells(step, past.position))), None)

    def _travel(self, step: Step, now: Past, before: Past, growth: float, alpha: float, start: Array) -> None:
        """`start = (1 + growth) now - growth before`, moved with the surface by whole cells."""
        slab, points = self._scene.slab, self._scene.job.grid.points
        along_x, along_y = (
            round(moved) % count  # a step may pass more boxes than a machine's whole numbers reach
            for moved, count in zip(self.cells(step, now.position), points, strict=True)
        )
        older, share = before.pressure, growth * before.alpha / alpha
        if along_y and growth > 0.0:
            older = rows.roll(slab, before.pressure, along_y, start)
        bounds = self._scene.constraint(alpha).bounds
        loops.travel(now.pressure, older, (1.0 + growth) * now.alpha / alpha, share, along_x, *bounds, start)
        if along_y:
            start[...] = rows.roll(slab, start, along_y, self._scene.solver.workspace.pressure)

    def cells(self, step: Step, since: tuple[float, float]) -> tuple[float, float]:
        """By how many cells the surface moves from a position [m] to the end of a step, along x and y."""
        grid = self._scene.job.grid
        return cells_between(since, step.position, (grid.dx, grid.dy))

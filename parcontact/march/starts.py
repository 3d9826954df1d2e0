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

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..history.timeline import Step
from ..parallel import rows
from ..parallel.slab import Array
from ..physics import loops
from ..physics.entries import Entry, Saved
from ..physics.motion import are_whole, cells_between
from ..scene import Scene

NAME = "contact/iterations of starts"  # in a checkpoint
TRY_AGAIN = 16  # tuning: steps after which the kind of start that was worse may have become the better one
FORGET = 128  # tuning: steps without a choice after which nothing is known any more
LEAST_MOVED, LEAST_EXTRAPOLATED = 0.0, 1.0  # tuning: iterations that a solve takes with each, if nothing is known


class Past(NamedTuple):
    """The pressure after a step: a map of p with the pressure `alpha p`, and where the surface was [m]; with an alpha
    of 0 none is known."""

    pressure: Array
    alpha: float = 0.0
    position: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class StartStatistics:
    """Memory of how many iterations solves took with either kind of start, in the mean of the last ones, and of how
    many steps ago the better kind was last in doubt."""

    moved: float = LEAST_MOVED
    extrapolated: float = LEAST_EXTRAPOLATED
    since: float = 0.0

    @property
    def prefers_moved(self) -> bool:
        """Whether a pressure of whole cells ago took fewer iterations than the last two, or next to none."""
        return self.moved <= LEAST_EXTRAPOLATED or self.moved < self.extrapolated

    @property
    def moves(self) -> bool:
        """Whether the next start is a pressure of whole cells ago: the better kind, or now and then the other one."""
        if self.since < TRY_AGAIN or self.moved <= LEAST_EXTRAPOLATED:
            return self.prefers_moved
        return not self.prefers_moved

    def after(self, choice: bool | None, iterations: int) -> "StartStatistics":
        """Return the statistics after a solve. `choice` says whether its start was a moved pressure, None where there
        was no choice."""
        since = self.since + 1.0
        if choice is None:
            return StartStatistics(since=since) if since >= FORGET else replace(self, since=since)
        if choice:
            found = replace(self, moved=0.5 * (self.moved + iterations), since=since)
        else:
            mean = max(0.5 * (self.extrapolated + iterations), LEAST_EXTRAPOLATED)
            found = replace(self, extrapolated=mean, since=since)
        changes = choice != self.prefers_moved or found.prefers_moved != self.prefers_moved
        return replace(found, since=0.0) if changes else found

    def entries(self) -> dict[str, Entry]:
        """Return its entry; a checkpoint may lack it."""
        return {NAME: Entry(np.array([self.moved, self.extrapolated, self.since]), optional=True)}

    @classmethod
    def restored(cls, saved: Saved) -> "StartStatistics":
        """Return the statistics of a checkpoint; with one that has none all is to be learnt again."""
        return cls(*saved[NAME].tolist()) if NAME in saved else cls()


def make_start(
    scene: Scene, pasts: Sequence[Past], statistics: StartStatistics, step: Step, alpha: float, out: Array
) -> bool | None:
    """Put the start of a step, a map of p for the modulus `alpha`, into `out`.

    `pasts` are the last pressures, the newest first. Returns whether it is a moved pressure, None without a choice.
    """
    if len(pasts) == 1:
        out[...] = pasts[0].pressure
        return None
    now, before = pasts[:2]
    growth = step.growth if before.alpha > 0.0 else 0.0
    past = _whole_cells_ago(scene, pasts, step) if growth > 0.0 else None
    moves = past is not None and statistics.moves
    if past is not None and moves:
        now, growth = past, 0.0
    _travel(scene, step, now, before, growth, alpha, out)
    return moves if past is not None and scene.choices.further_starts.on else None


def cells_moved(scene: Scene, step: Step, since: tuple[float, float]) -> tuple[float, float]:
    """Return by how many cells the surface moves from a position [m] to the end of a step, along x and y."""
    grid = scene.choices.grid
    return cells_between(since, step.position, (grid.dx, grid.dy))


def _whole_cells_ago(scene: Scene, pasts: Sequence[Past], step: Step) -> Past | None:
    """Return the newest pressure since which the surface has moved by whole cells; None if it is the last one."""
    last, *older = pasts
    if are_whole(cells_moved(scene, step, last.position)):
        return None
    known = (past for past in older if past.alpha > 0.0)
    return next((past for past in known if are_whole(cells_moved(scene, step, past.position))), None)


def _travel(scene: Scene, step: Step, now: Past, before: Past, growth: float, alpha: float, out: Array) -> None:
    """Form `out = (1 + growth) now - growth before`, moved with the surface by whole cells."""
    slab, points = scene.slab, scene.choices.grid.points
    along_x, along_y = (
        round(moved) % count  # a step may pass more boxes than a machine's whole numbers reach
        for moved, count in zip(cells_moved(scene, step, now.position), points, strict=True)
    )
    older, share = before.pressure, growth * before.alpha / alpha
    if along_y and growth > 0.0:
        older = rows.roll(slab, before.pressure, along_y, out)
    bounds = scene.constraint(alpha).bounds
    loops.travel(now.pressure, older, (1.0 + growth) * now.alpha / alpha, share, along_x, *bounds, out)
    if along_y:
        out[...] = rows.roll(slab, out, along_y, scene.solver.workspace.pressure)

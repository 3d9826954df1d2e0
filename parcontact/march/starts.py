"""Start of the solve of a step.

Pressures change with time and move with the surface. If the surface has moved by whole cells since one of the last
steps, the pressure of that step is moved by as many cells, without rounding: in steady sliding it is already the
solution. With steps of a whole cell it is the last pressure, extrapolated with the one before it; with steps of half a
cell it is the one before; with thirds and quarters it is an earlier one, stored in slides with chosen steps.

Otherwise the last two pressures are extrapolated in the body's frame.
"""

from collections.abc import Sequence

from ..effects.contact_protocol import PreviousPressure
from ..history.timeline import Step
from ..parallel import rows
from ..parallel.slab import Array
from ..physics import loops
from ..physics.motion import are_whole, cells_between
from ..scene import Scene


def make_start(scene: Scene, pasts: Sequence[PreviousPressure], step: Step, alpha: float, out: Array) -> None:
    """Put the start of a step, a map of p for the modulus `alpha`, into `out`. `pasts` are the last pressures, the
    newest first."""
    if len(pasts) == 1:
        out[...] = pasts[0].pressure
        return
    now, before = pasts[:2]
    growth = step.growth if before.alpha > 0.0 else 0.0
    past = _whole_cells_ago(scene, pasts, step) if growth > 0.0 else None
    if past is not None:
        now, growth = past, 0.0
    _travel(scene, step, now, before, growth, alpha, out)


def cells_moved(scene: Scene, step: Step, since: tuple[float, float]) -> tuple[float, float]:
    """Return by how many cells, along x and y, the surface moves from the position `since` [m] to the end of a step."""
    grid = scene.choices.grid
    return cells_between(since, step.position, (grid.dx, grid.dy))


def _whole_cells_ago(scene: Scene, pasts: Sequence[PreviousPressure], step: Step) -> PreviousPressure | None:
    """Return the newest pressure since which the surface has moved by whole cells; None if it is the last one."""
    last, *older = pasts
    if are_whole(cells_moved(scene, step, last.position)):
        return None
    known = (past for past in older if past.alpha > 0.0)
    return next((past for past in known if are_whole(cells_moved(scene, step, past.position))), None)


def _travel(
    scene: Scene, step: Step, now: PreviousPressure, before: PreviousPressure, growth: float, alpha: float, out: Array
) -> None:
    """Put `(1 + growth) now - growth before`, moved with the surface by whole cells, into `out`."""
    slab, points = scene.slab, scene.choices.grid.points
    along_x, along_y = (
        round(moved) % count  # against overflow in long steps
        for moved, count in zip(cells_moved(scene, step, now.position), points, strict=True)
    )
    older, share = before.pressure, growth * before.alpha / alpha
    if along_y and growth > 0.0:
        older = rows.roll_rows(slab, before.pressure, along_y, out)
    bounds = scene.constraint(alpha).bounds
    loops.travel(now.pressure, older, (1.0 + growth) * now.alpha / alpha, share, along_x, *bounds, out)
    if along_y:
        out[...] = rows.roll_rows(slab, out, along_y, scene.solver.workspace.pressure)

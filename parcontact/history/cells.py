"""Which steps leave the surface between cells: by whole cells along x heights are moved without a transform."""

from ..job.sections.settings import Grid
from .chosen import ChosenEnds
from .timeline import Step, Timeline

SAME_PLACE = 1e-6  # of a cell: a displacement this close to whole cells is one of whole cells


def first_between_cells(timeline: Timeline, grid: Grid) -> Step | None:
    """The first step after which the surface is not moved by whole cells along x."""
    for span in filter(lambda span: span.moves, timeline.spans):
        if isinstance(span.ends, ChosenEnds):
            return span.step(span.before + span.jumps + 1)
        (x, _), (slid, _) = span.origin, span.position(span.ends.count)
        start, each = x / grid.dx, (slid - x) / grid.dx / span.ends.count
        worst = abs(start - round(start)) + abs(each - round(each)) * span.count
        if span.ends.growth == 1.0 and not span.stage.velocity[1] and worst < SAME_PLACE / 2:
            continue
        first = span.before + span.jumps + 1
        if span.ends.growth == 1.0 and not span.stage.velocity[1] and (off := abs(each - round(each))):
            first += max(0, int((SAME_PLACE - abs(start - round(start))) / off) - 2)  # none before can be that far off
        for step in (span.step(number) for number in range(first, span.last + 1)):
            cells = step.position[0] / grid.dx
            if step.position[1] != 0.0 or abs(cells - round(cells)) > SAME_PLACE:
                return step
    return None

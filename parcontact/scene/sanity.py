"""Whether a scene means something, seen from its heights before a run and from its contacts during it.

What a job alone tells is in `job/checks/meaning.py`. All is judged from sums over all points: every rank says the same.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ..errors import InputError, RunError
from ..history.timeline import Timeline
from ..job import Job, OnOneMesh
from ..job.checks import advice, meaning, size
from ..job.checks.limits import MOST_STEPS
from ..parallel import rows
from ..parallel.slab import Array, Slab
from ..physics.measures import Measures
from .scene import Setup

SEAM = (
    2.0  # the jump across the edge of the box over the largest increment of neighbours inside: 1 if nothing is special
)
ODD_CONTACTS = ("edge", "cells")  # at the edge of the box; a few cells wide
FEW_CELLS = (
    0.15  # of the area of contact that counting cells takes too large: contacts of three cells, a circle of four
)
FEW_POINTS = 2**22  # that are made in seconds
STRICT = "an error with numerics.strict"


def refuse_impossible(job: Job, timeline: Timeline) -> None:
    """Raise InputError for a run that cannot begin here: too many points for the memory, or too many instants."""
    for text in (size.beyond_memory(job.grid), size.beyond_file(timeline.count, job.output), _endless(timeline)):
        if text:
            raise InputError(text)


def _endless(timeline: Timeline) -> str:
    if timeline.count <= MOST_STEPS:
        return ""
    return f"the history would have {timeline.count:.3g} steps; it has at most {MOST_STEPS:.0e}"


def is_quickly_made(job: Job) -> bool:
    """Whether the heights of a job say more than the job does, and are few enough to be made for a look at them."""
    return not meaning.says_all(job.surface) and job.grid.nx * job.grid.ny <= FEW_POINTS


def of_surface(setup: Setup) -> list[str]:
    """What is wrong with the heights of a scene, collective; raises InputError with `numerics.strict`."""
    found = list(_of_surface(setup))
    if found and setup.job.numerics.strict:
        raise InputError("\n".join(f"{text} ({STRICT})" for text in found))
    return found


def _of_surface(setup: Setup) -> Iterator[str]:
    if setup.roughness and (text := meaning.steep(setup.roughness.rms_slope)) and text not in setup.job.warnings:
        yield text
    seams: list[str] = []
    if any(isinstance(shape, OnOneMesh) for shape in setup.job.surface):
        heights = setup.surface.heights((0.0, 0.0), setup.slab.empty())
        seams = list(_seams(setup, heights)) if setup.job.grid.boundary == "periodic" else []
        yield from seams
    if setup.shortest is not None and not seams:  # a seam has waves of its own
        yield from advice.measured(setup.job.grid, setup.shortest, setup.job.numerics.accuracy)


# -- the edge of a periodic box ---------------------------------------------------------------------------------------


def _seams(setup: Setup, heights: Array) -> Iterator[str]:
    """Where the first and the last points of a periodic box do not fit together."""
    unit, grid = setup.units.height, setup.job.grid
    for name, (jump, inside, rise), length in (
        ("x", _along_x(setup.slab, heights), grid.lx),
        ("y", _along_y(setup.slab, heights), grid.ly),
    ):
        if jump <= SEAM * inside:
            continue
        tilt = rise / length
        remedy = "cut it where it fits, or let it fade to its mean towards the edge"
        if math.sqrt(max(jump**2 - rise**2, 0.0)) <= SEAM * inside:
            remedy = f"it is tilted by {abs(tilt) * unit:.3g}: subtract its mean plane"
        yield (
            f"surface: along {name} the heights jump by {jump * unit:.3g} m (rms) across the edge of the periodic box, "
            f"{_times(jump, inside)} the most between neighbours inside, and such a wall makes friction of its own; "
            f"{remedy}"
        )


def _times(jump: float, inside: float) -> str:
    return f"{jump / inside:.3g} times" if inside else "where there is nothing at"


def _along_x(slab: Slab, heights: Array) -> tuple[float, float, float]:
    """The rms jump across the edge, the largest rms increment inside, the mean rise from one side to the other."""
    if slab.nx < 3:
        return 0.0, 0.0, 0.0
    steps = np.roll(heights, -1, axis=1) - heights
    squares = slab.sum(*(steps**2).sum(axis=0).tolist(), -float(steps[:, -1].sum()))
    *columns, rise = squares
    rms = np.sqrt(np.array(columns) / slab.ny)
    return float(rms[-1]), float(rms[:-1].max()), rise / slab.ny


def _along_y(slab: Slab, heights: Array) -> tuple[float, float, float]:
    """The same from row to row."""
    before = rows.before_first(slab, heights, True)
    if slab.ny < 3:
        return 0.0, 0.0, 0.0
    steps = np.diff(np.concatenate([np.atleast_2d(before), heights]), axis=0) if len(heights) else heights
    rms = np.sqrt((steps**2).mean(axis=1))
    first = slab.rows.start == 0 and len(heights) > 0
    at_edge = float(rms[0]) if first else 0.0
    inside = float(rms[1 if first else 0 :].max(initial=0.0))
    rise, jump, most = slab.reduce([-float(steps[0].mean()) if first else 0.0], [at_edge, inside])
    return jump, most, rise


# -- contacts ---------------------------------------------------------------------------------------------------------


@dataclass
class ContactWatch:
    """Looks at what each step of a run has measured, and tells each kind of nonsense once."""

    job: Job
    timeline: Timeline
    told: set[str] = field(default_factory=set)

    def judge(self, step: int, measures: Measures) -> list[str]:
        """Warnings about a step; raises RunError with `numerics.strict`."""
        return self._new(f"step {step}", measures, step > 0 and self._ends_a_stage(step))

    def judge_point(self, measures: Measures, where: str) -> list[str]:
        """The same about steady sliding."""
        return self._new(where, measures, True)

    def _new(self, where: str, measures: Measures, ends: bool) -> list[str]:
        """What has not been told yet."""
        found = dict(zip(ODD_CONTACTS, (at_edge(measures), few_cells(measures) if ends else ""), strict=True))
        new = {kind: f"{where}: {text}" for kind, text in found.items() if text and kind not in self.told}
        self.told |= new.keys()
        if new and self.job.numerics.strict:
            raise RunError("; ".join(f"{text} ({STRICT})" for text in new.values()))
        return list(new.values())

    def _ends_a_stage(self, step: int) -> bool:
        return step <= self.timeline.count and self.timeline.span(step).last == step


def at_edge(measures: Measures) -> str:
    """What to say of a contact that leaves its box, or ''."""
    if not measures.at_edge:
        return ""
    return (
        "the contact reaches the edge of the box, and a free body goes on beyond it where nothing presses; use a "
        "larger grid.size, less load or a shorter way"
    )


def few_cells(measures: Measures) -> str:
    """What to say of contacts that consist of their own edges, or ''."""
    area = measures.contact_area
    excess = 1.0 - measures.contact_area_corrected / area if area > 0.0 else 0.0
    if excess <= FEW_CELLS:
        return ""
    return (
        f"contacts are a few cells wide: counted in cells their area is {excess:.0%} too large, and {FEW_CELLS:.0%} is "
        "the limit; use more grid.points, a smaller grid.size or a larger load"
    )

"""The instants of a history: every step follows from the job alone, so that a restart needs only a step's number."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from .job import GeometricStep, Grid, Stage

ROUND_OFF = 1e-9  # relative: a duration this close to a whole number of steps is one


@dataclass(frozen=True)
class Step:
    """One solve: it ends at `time` [s], `dt` [s] after the last, with the surface at `position` [m].

    `dt` = 0 is a jump, at an instant, of the load. `control` names what `load` prescribes (Pa, N or m). `growth` is
    dt over the dt of the step before, 0 where that was a jump: how far to extrapolate what changes smoothly.
    """

    number: int
    stage: int
    time: float
    dt: float
    position: tuple[float, float]
    velocity: tuple[float, float]
    control: str
    load: float
    growth: float

    @property
    def jump(self) -> bool:
        return self.dt == 0.0


def time_step(stage: Stage, grid: Grid) -> float:
    """The (first) time step [s] that a stage asks for, before steps are fitted to its end."""
    if stage.cells_per_step is not None:
        cell = math.hypot(stage.velocity[0] / stage.speed * grid.dx, stage.velocity[1] / stage.speed * grid.dy)
        return stage.cells_per_step * cell / stage.speed
    if isinstance(stage.time_step, GeometricStep):
        return stage.time_step.first
    return stage.time_step or 0.0


def fractions(stage: Stage, grid: Grid) -> list[float]:
    """Ends of the steps of a stage as fractions of it: the last is 1, and no step is longer than asked for."""
    if stage.seconds == 0.0:
        return []
    steps = stage.seconds / time_step(stage, grid)
    growth = stage.time_step.growth if isinstance(stage.time_step, GeometricStep) else 1.0
    if growth == 1.0:
        count = max(1, math.ceil(steps * (1.0 - ROUND_OFF)))
        return [index / count for index in range(1, count + 1)]
    count = max(1, math.ceil(math.log1p(steps * (growth - 1.0)) / math.log(growth) * (1.0 - ROUND_OFF)))
    whole = math.expm1(count * math.log(growth))
    return [*(math.expm1(index * math.log(growth)) / whole for index in range(1, count)), 1.0]


def reached(time: float, until: float) -> bool:
    """Whether a time is the one asked for, or later."""
    return time >= until * (1.0 - ROUND_OFF)


def steps(history: tuple[Stage, ...], grid: Grid, until: float = 0.0, pressure: float | None = None) -> Iterator[Step]:
    """All steps of a history, numbered from 1; step 0 is the initial state.

    Where the history ends before `until`, its last stage goes on with its last time step, velocity and load, to the
    first step that reaches it; a last stage that is one solve cannot go on. `pressure` [Pa] is that of the initial
    state, None for a virgin body.
    """
    number, time, position = 0, 0.0, (0.0, 0.0)
    before = None if pressure is None else ("pressure", pressure)
    for index, stage in enumerate(history):
        start, origin, last_dt = time, position, 0.0
        facts = (stage.velocity, stage.control)
        if _jumps(stage, before):
            number += 1
            yield Step(number, index, time, 0.0, position, *facts, stage.load.start, 0.0)
        ends = fractions(stage, grid)
        last = index == len(history) - 1
        for fraction in _beyond(ends, (until - start) / stage.seconds) if last and ends else ends:
            number += 1
            end = start + fraction * stage.seconds
            dt, time = end - time, end
            slid = fraction * stage.seconds
            position = (origin[0] + stage.velocity[0] * slid, origin[1] + stage.velocity[1] * slid)
            growth = dt / last_dt if last_dt else 0.0
            yield Step(number, index, time, dt, position, *facts, stage.load.at(min(fraction, 1.0)), growth)
            last_dt = dt
        before = (stage.control, stage.load.end)


def _beyond(ends: list[float], until: float) -> Iterator[float]:
    """The ends of the steps of a stage, and on with the last step until the fraction `until` is reached."""
    yield from ends
    step = 1.0 - (ends[-2] if len(ends) > 1 else 0.0)
    count = 0
    while not reached(1.0 + count * step, until):
        count += 1
        yield 1.0 + count * step


def _jumps(stage: Stage, before: tuple[str, float] | None) -> bool:
    """Whether the stage begins with a jump: an instantaneous stage, another load than before, or another control."""
    if stage.seconds == 0.0:
        return True
    if before is None:
        return stage.control == "approach" or stage.load.start != 0.0
    return before != (stage.control, stage.load.start)

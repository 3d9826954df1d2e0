"""Cycles of stages that oscillate: loss, amplitudes and phase, from the rows of measures.csv; the table cycles.csv.

If a load or an approach oscillates, the force F is the normal force and s the approach; if a velocity oscillates, F is
the tangential force and s the position of the surface. The loss of a cycle is the area of its loop,

    W = int (F - <F>) ds,

with <F> the mean force over the cycle, as creep under the mean force is no part of the loop. A cycle that repeats the
last one dissipates W. `phase` is the angle [rad] by which the first harmonic of s lags behind that of F: 0 for an
elastic body.

Where nothing moves along the surface, int F ds is the change of `work`, if energies are saved. Otherwise F and s are
Hermite's cubics between two rows, with slopes by differences, at most STEEP times the smaller slope of both steps. The
error of W has up to five parts:

* by this interpolation: the difference to interpolation over pairs of steps, divided by its order of at least three;
* by jumps of F, steps STEEP times as steep as both neighbours: half the product of both changes, as the jump may be
  anywhere in its step; by interpolation the same for two steps on each side, where F turns like a root;
* if something slides, the error of friction, weighted with the force;
* else by the length of steps: the error of a harmonic motion with these steps (`prony.discrete_modulus`), times
  HARMONICS;
* by the solver, as for the area (`march.budget`), divided by the root of the number of steps, and by sin phase, as the
  loop is the small difference of two paths; and by the mesh, MESH of the error of the area.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..columns import CYCLES, names_of, to_csv, values_of
from ..effects.relaxation import relaxation_of
from ..files import files, outputs
from ..job import Job, Stage, Swing
from ..march.constants import SOLVER_AREA
from ..parallel.slab import Array
from ..physics.prony import complex_modulus, discrete_modulus
from ..printed import per_cent, quantity, stated_error
from .slide import SAME_INSTANT

LEAST_ROWS = 5  # rows of a cycle with an estimate of the error
PAIRS = (
    2.0**3 - 1.0
)  # accuracy: difference between the errors of steps twice as long and of steps, over the error of steps
NODES, WEIGHTS = (0.5 * (each + shift) for each, shift in zip(np.polynomial.legendre.leggauss(4), (1, 0), strict=True))
HARMONICS = 2.0  # fitted: errors of steps over those of one harmonic (tests/summary/test_cycles.py)
NOISE = 2.0  # fitted: error of independent solves over that of one (tests/summary/test_cycles.py)
MESH = 0.3  # fitted: error of the loss over that of the area, 0.25 at most (tests/summary/test_cycles.py)
STEEP = 3.0  # accuracy: ratio of slopes up to which a cubic between two rows stays between them
NO_PHASE = 1e-100  # rounding: sine of the phase of a body that loses nothing
Columns = Mapping[str, Sequence[float]]


@dataclass(frozen=True)
class Cycle:
    """A row of cycles.csv, for one whole cycle of a stage.

    `loss` [J] has the relative error `error_loss`. Amplitudes are half the range within the cycle: of friction, NaN
    where nothing slides, and of the approach [m]. `phase` is in rad, NaN if force or displacement is constant.
    """

    stage: int
    cycle: int
    frequency: float
    loss: float
    error_loss: float
    friction_amplitude: float
    approach_amplitude: float
    phase: float


def find_cycles(job: Job, columns: Columns) -> list[Cycle]:
    """Return the rows of all whole cycles in the columns of measures.csv."""
    found, start = list[Cycle](), 0.0
    table = {name: np.asarray(values, float) for name, values in columns.items()}
    for index, stage in enumerate(job.history):
        if stage.frequency:
            last = math.inf if index == len(job.history) - 1 else start + stage.seconds
            found += _cycles_of(index, job, table, start, last)
        start += stage.seconds
    return found


def _cycles_of(index: int, job: Job, table: Mapping[str, Array], start: float, last: float) -> Iterator[Cycle]:
    stage, time, number = job.history[index], table["time"], 1
    period = 1.0 / stage.frequency
    same = SAME_INSTANT * max(period, start)
    kept = np.append(np.diff(time) > 0.0, True)  # the last of the rows of an instant
    while (end := start + number * period) <= min(last, time[-1]) + same:
        rows = np.flatnonzero(kept & (time >= end - period - same) & (time <= end + same))
        if rows.size >= LEAST_ROWS:
            yield _measure(index, number, stage, job, {name: values[rows] for name, values in table.items()}, start)
        number += 1


def _measure(index: int, number: int, stage: Stage, job: Job, cycle: Mapping[str, Array], start: float) -> Cycle:
    time, area = cycle["time"], job.grid.lx * job.grid.ly
    along, way = friction_along(stage, cycle), way_along(stage, cycle, start)
    if way is None:
        force, place = area * cycle["pressure"], cycle["approach"]
    else:
        force, place = along, way
    work = math.nan if stage.speed else _gain(cycle.get("work"))
    loss, between = _by_work(work, time, force, place) if math.isfinite(work) else _by_rows(time, force, place)
    phase = _harmonic_angle(time, force, stage.frequency) - _harmonic_angle(time, place, stage.frequency)
    phase = math.remainder(phase, 2.0 * math.pi) if np.ptp(force) and np.ptp(place) else math.nan
    error = between / abs(loss) if loss else math.nan
    if way is None:
        error += _load_error(job, stage, cycle, phase)
    else:
        error += _mean_error(cycle["error_friction"], np.abs(along))
    with np.errstate(divide="ignore", invalid="ignore"):
        friction = along / (area * cycle["pressure"]) if stage.speed else np.full(1, np.nan)
    return Cycle(
        index,
        number,
        stage.frequency,
        loss,
        error,
        0.5 * float(np.ptp(friction)),
        0.5 * float(np.ptp(cycle["approach"])),
        phase,
    )


def _gain(work: Array | None) -> float:
    """Return the change of work over a cycle [J]; NaN without energies."""
    return math.nan if work is None else float(work[-1] - work[0])


def _by_work(work: float, time: Array, force: Array, place: Array) -> tuple[float, float]:
    """Return the loss of a cycle from the work of its load, and its error by jumps of the force [J]."""
    return work - _mean(time, force) * float(place[-1] - place[0]), _within(force, place, _jumps(time, force))


def _by_rows(time: Array, force: Array, place: Array) -> tuple[float, float]:
    """Return the loss of a cycle from force and displacement, and its error by interpolation and jumps [J]."""
    loss, rough = (_loop(time[rows], force[rows], place[rows]) for rows in (slice(None), _every_second(time.size)))
    near = np.convolve(_jumps(time, force), np.ones(5), "same") > 0.0
    return loss, abs(rough - loss) / PAIRS + _within(force, place, near)


def _jumps(time: Array, force: Array) -> NDArray[np.bool_]:
    """Return a mask of the steps between rows that are STEEP times as steep as both neighbours."""
    slopes = np.abs(np.diff(force) / np.diff(time))
    before, after = np.append(slopes[1], slopes[:-1]), np.append(slopes[1:], slopes[-2])
    return slopes > STEEP * np.maximum(before, after)


def _within(force: Array, place: Array, steps: NDArray[np.bool_]) -> float:
    """Return by how much the trapezoids of some steps differ at most from integrals of a monotonic force [J]."""
    return 0.5 * float(np.sum(np.abs(np.diff(force) * np.diff(place))[steps]))


def _mean_error(errors: Array, weights: Array) -> float:
    """Return the weighted mean of relative errors over the rows of a cycle in which they are known; NaN without any."""
    known = np.isfinite(errors) & (weights > 0.0)
    return float(np.average(errors[known], weights=weights[known])) if known.any() else math.nan


def _load_error(job: Job, stage: Stage, cycle: Mapping[str, Array], phase: float) -> float:
    """Return the relative error of the loss by steps, solver and mesh, where nothing moves along the surface."""
    solver = NOISE * SOLVER_AREA.value * float(np.mean(cycle["residual"])) ** SOLVER_AREA.order
    solver /= math.sqrt(cycle["time"].size) * max(abs(math.sin(phase)), NO_PHASE)
    mesh = MESH * _mean_error(cycle["error_area"], np.abs(cycle["pressure"]))
    return _step_error(job, stage, np.diff(cycle["time"])) + solver + mesh


def _step_error(job: Job, stage: Stage, dt: Array) -> float:
    """Return the relative error of the loss of a harmonic load or approach with steps of these lengths [s]; 1 where
    nothing can be lost."""
    omega, series = 2.0 * math.pi * stage.frequency, relaxation_of(job.material)
    if not job.remembers:
        return 1.0
    if not series.moduli.size:
        return 0.0
    true = complex_modulus(np.array([omega]), *series)
    made = discrete_modulus(omega, dt, *series, integrator=job.numerics.integrator)
    lost, found = ((g if stage.control == "approach" else -1.0 / g).imag for g in (true, made))
    return HARMONICS * float(np.average(np.abs(found / lost - 1.0), weights=dt))


def measure_last(job: Job, columns: Columns) -> dict[str, float]:
    """Return the loss of the last cycle, its error, and the phase, by their names; empty without a whole cycle."""
    found = find_cycles(job, columns)
    return {name: getattr(found[-1], name) for name in ("loss", "error_loss", "phase")} if found else {}


def write_cycles(directory: Path, job: Job, columns: Columns) -> Iterator[str]:
    """Write cycles.csv, and yield a sentence on the last cycles of each stage that oscillates. Raises OSError."""
    found = find_cycles(job, columns)
    files.replace_file(
        directory / outputs.RUN.tables[0], to_csv(names_of(CYCLES), (values_of(CYCLES, cycle) for cycle in found))
    )
    yield from _describe_stages(job, found)


def describe_cycles(job: Job, columns: Columns) -> Iterator[str]:
    """Yield a sentence on the last cycles of each stage that oscillates."""
    yield from _describe_stages(job, find_cycles(job, columns))


def _describe_stages(job: Job, found: Sequence[Cycle]) -> Iterator[str]:
    for index, stage in enumerate(job.history):
        if own := [cycle for cycle in found if cycle.stage == index]:
            yield _describe(job, stage, own)


def loss_with_error(loss: float, error: float) -> str:
    """Return a loss [J] with its relative error; a loss that is smaller than its error is 0 with an error in J."""
    if error > 1.0:
        return f"0 ± {quantity(error * abs(loss), 'J', 2)}"
    return f"{quantity(loss, 'J', 4)} ± {stated_error(error)}"


def _describe(job: Job, stage: Stage, cycles: Sequence[Cycle]) -> str:
    """Return a sentence on the last cycle, and whether its loss agrees with that of the one before."""
    last, accuracy = cycles[-1], job.numerics.asked.of_steps
    if math.isnan(last.phase):
        return f"{stage.name}: loss of cycle {last.cycle} 0 J: force or displacement is constant"
    said = f"{stage.name}: loss of cycle {last.cycle} {loss_with_error(last.loss, last.error_loss)}"
    if last.error_loss > 1.0:
        return f"{said}: {'it is smaller than its error' if job.remembers else 'an elastic body loses nothing'}"
    said += f", phase {math.degrees(last.phase):.3g} degrees"
    if len(cycles) == 1:
        return f"{said}; a second cycle would show whether cycles repeat"
    change = abs(last.loss - cycles[-2].loss) / abs(last.loss) if last.loss else 0.0
    if change <= accuracy:
        return f"{said}; the last two cycles agree: their losses differ by {per_cent(change)}"
    return f"{said}; the last two cycles differ by {per_cent(change)} of the loss: give more cycles"


def friction_along(stage: Stage, columns: Mapping[str, Array]) -> Array:
    """Return the tangential force [N] against the motion, along the velocity of a stage or the velocity's amplitude."""
    (x, y), speed = stage.velocity, stage.speed or 1.0
    return -(columns["force_x"] * x + columns["force_y"] * y) / speed


def way_along(stage: Stage, columns: Mapping[str, Array], start: float) -> Array | None:
    """Return the positions [m] along the velocity of a stage that began at `start` [s]; None at constant velocity."""
    if not isinstance(stage.velocity, Swing):
        return None
    return stage.speed * np.array([stage.moving(time - start) for time in columns["time"].tolist()])


def _every_second(count: int) -> Array:
    """Return the indices of every second row, and of the last one."""
    return np.unique([*range(0, count, 2), count - 1])


def _over_time(time: Array, *values: Array) -> tuple[Array, list[tuple[Array, Array]]]:
    """Return weights [s] of instants, and the values and their rates at the instants."""
    dt, s = np.diff(time)[:, None], NODES[None, :]
    found = list[tuple[Array, Array]]()
    for each in values:
        rate = _rates(time, each)
        old, new = each[:-1, None], each[1:, None]
        left, right, change = dt * rate[:-1, None], dt * rate[1:, None], new - old
        at = old + s * left + s**2 * (3 * change - 2 * left - right) + s**3 * (left + right - 2 * change)
        slope = left + 2 * s * (3 * change - 2 * left - right) + 3 * s**2 * (left + right - 2 * change)
        found.append((at, slope / dt))
    return dt * WEIGHTS[None, :], found


def _rates(time: Array, values: Array) -> Array:
    """Return slopes at the rows by differences, at most STEEP times the smaller slope of both steps."""
    slopes = np.abs(np.diff(values) / np.diff(time))
    most = STEEP * np.minimum(np.append(slopes[0], slopes), np.append(slopes, slopes[-1]))
    return np.clip(np.gradient(values, time, edge_order=2), -most, most)


def _mean(time: Array, force: Array) -> float:
    """Return the mean over a cycle."""
    weights, ((found, _),) = _over_time(time, force)
    return float(np.sum(weights * found)) / float(time[-1] - time[0])


def _loop(time: Array, force: Array, place: Array) -> float:
    """Return the area of a loop."""
    weights, ((f, _), (_, rate)) = _over_time(time, force, place)
    return float(np.sum(weights * (f - _mean(time, force)) * rate))


def _harmonic_angle(time: Array, values: Array, frequency: float) -> float:
    """Return the phase of the first harmonic over a cycle [rad]."""
    weights, ((found, _),) = _over_time(time, values)
    (instants, _) = _over_time(time, time)[1][0]
    return float(np.angle(np.sum(weights * found * np.exp(-2j * math.pi * frequency * instants))))

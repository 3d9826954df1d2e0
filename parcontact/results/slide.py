"""Results of the slide and of the oscillation cycles of a run, from the rows of measures.csv.

The slide of a history is its last part at one non-zero velocity under one load. It consists of the last stage that
slides, and of the stages just before it with the same velocity and the same constant load. As in the paper (Sec. 3.1),
mu_max is the highest friction of the slide, and mu_dyn the mean over the last three quarters of its distance. Friction
may need a longer slide to become steady (`parcontact steady` solves steady sliding directly). Rows in which the contact
reaches the edge of the box do not count. A slide with such rows is incomplete, so that its errors are not known.

Cycles have a loss, amplitudes and a phase, in the table cycles.csv. If a load or an approach oscillates, the force F is
the normal force and s the approach. If a velocity oscillates, F is the tangential force and s the position of the
surface. The loss of a cycle is the area of its loop,

    W = int (F - <F>) ds,

where <F> is the mean force over the cycle: without it, creep under the mean force would count as a loss. A cycle that
repeats the cycle before dissipates the energy W. `phase` is the angle [rad] by which the first harmonic of s lags
behind the first harmonic of F. The phase is 0 for an elastic body.

Where nothing moves along the surface, int F ds is the change of the column `work`, if the run saves energies
(`output.energy`). Otherwise F and s are interpolated by Hermite's cubics between two rows. The slopes of the cubics are
differences, limited to STEEP times the smaller slope of both steps, so that a cubic stays between its ends. The error
of W is a sum of up to five parts:

* Interpolation: the loss from every second row minus the loss from all rows, divided by PAIRS. This assumes that
  the error falls with the third power of the step.
* Jumps of F, which are steps STEEP times as steep as both neighbours: half the product of the changes of F and s, as
  the jump may be anywhere in its step. With interpolation, the two steps on each side of a jump count in the same way.
* If something slides: the error of friction, weighted with the force.
* If nothing slides, the length of steps: the error of a harmonic motion with these steps (`prony.discrete_modulus`),
  times HARMONICS for motions of several harmonics.
* If nothing slides, the solver and the mesh. The part of the solver is its error of the area (`march.budget`) times
  NOISE, divided by the root of the number of steps and by the sine of the phase, as the loop is the small difference
  of two paths. The part of the mesh is MESH times the error of the area.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..columns import CYCLES, names_of, to_csv, values_of
from ..effects.branches import relaxation_of
from ..files import files, outputs
from ..job import Initial, Job, Ramp, Stage, Swing
from ..job.listing import answers
from ..march.budget import SOLVER_AREA
from ..parallel.slab import Array
from ..physics.prony import complex_modulus, discrete_modulus
from ..printed import per_cent, quantity, stated_error, with_error

LATE = 0.9  # accuracy: share of the distance beyond which a maximum may still rise
DYNAMIC = 0.75  # physics: share of the distance, counted from its end, over which friction is averaged
SAME_INSTANT = 1e-9  # rounding: relative difference below which instants are the same
BALANCED = 1e-12  # rounding: mean pressure over the highest pressure that may be the error of a sum over the box
CORRECTED = "contact_area_corrected"
ERRORS = ("error_friction", "error_area")  # columns of the error budget of each row
RELATIVE = {"friction": ERRORS[:1], CORRECTED: ERRORS[1:]}  # column of the relative error of a column
NOT_IN_ALL = (CORRECTED, *ERRORS, "force_x", "force_y")  # columns that some tables lack
CUT_OFF = "cut_off"


class Slide(NamedTuple):
    """Results of a slide. `mu_max` is at the distance `mu_max_distance` [m] from the start of the slide. `mu_dyn` and
    both areas are means over the last three quarters of the distance slid.

    Friction is NaN if a step has no load, the corrected area is NaN if it is unknown, and all numbers are NaN if the
    contact reaches the edge of the box from the start.
    """

    mu_max: float
    mu_max_distance: float
    mu_dyn: float
    contact_area: float
    contact_area_corrected: float


def mean_over_end(distance: ArrayLike, values: ArrayLike, share: float = DYNAMIC) -> float:
    """Return the mean of `values` over the last `share` of a `distance`, by trapezoids; both arrays have shape (n,)."""
    x, y = np.asarray(distance, float), np.asarray(values, float)
    start = x[-1] - share * (x[-1] - x[0])
    inside = x > start
    x, y = np.append(start, x[inside]), np.append(np.interp(start, x, y), y[inside])
    return float(np.trapezoid(y, x) / (x[-1] - x[0]))


def measure_slide(history: Sequence[Stage], columns: Mapping[str, Sequence[float]]) -> Slide | None:
    """Return results of the slide of a history, from the columns `time`, `distance`, `friction`, `contact_area` of its
    rows, and `contact_area_corrected` if present.

    Returns None if no stage slides, or the slide has not begun.
    """
    every = _during(history, columns)
    rows = _inside(columns, every)
    if rows.size < min(every.size, 2):
        return Slide(*[math.nan] * len(Slide._fields))
    distance, friction, *areas = _at(columns, rows, "distance", "friction", "contact_area", CORRECTED)
    if distance.size < 2 or distance[-1] == distance[0]:
        return None
    touching = [mean_over_end(distance, area) for area in areas]
    if _without_load(columns, rows).size:
        return Slide(math.nan, math.nan, math.nan, *touching)
    start = distance[0]
    highest = int(np.argmax(friction[1:])) + 1
    mean = mean_over_end(distance, friction)
    return Slide(float(friction[highest]), float(distance[highest] - start), mean, *touching)


def _at(columns: Mapping[str, Sequence[float]], rows: NDArray[np.intp], *names: str) -> list[Array]:
    """Return columns in some rows; NaN for a missing column that not all tables have."""
    unknown = {name: [math.nan] * len(columns["time"]) for name in NOT_IN_ALL if name not in columns}
    return [np.asarray(unknown.get(name) or columns[name], float)[rows] for name in names]


def _without_load(columns: Mapping[str, Sequence[float]], rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the rows, except the first, that have a tangential force and no load, or a tensile one."""
    (friction,) = _at(columns, rows, "friction")
    return rows[1:][((friction == 0.0) & (_tangential(columns, rows) > 0.0))[1:]]


def lacks_load(columns: Mapping[str, Array]) -> bool:
    """Return True if friction is not defined in a row of a slide, because no load presses the surfaces together."""
    slid = np.flatnonzero(np.diff(columns["distance"], prepend=0.0) > 0.0)
    listed = {name: values.tolist() for name, values in columns.items()}
    return _without_load(listed, np.array([0, *slid])).size > 0


def balanced(pressure: ArrayLike, highest: ArrayLike) -> Array:
    """Return mean pressures, set to 0 where they are the rounding error of pressure and tension in balance, in units of
    the `highest` pressures."""
    return np.where(np.abs(pressure) > BALANCED * np.asarray(highest), pressure, 0.0)


def _tangential(columns: Mapping[str, Sequence[float]], rows: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return the tangential force of some rows [N]; 0 in tables without one."""
    return np.hypot(*np.nan_to_num(_at(columns, rows, "force_x", "force_y")))


def absolute_errors(history: Sequence[Stage], columns: Mapping[str, Sequence[float]], cell: float) -> dict[str, float]:
    """Return the known absolute errors of mu_max, mu_dyn and the corrected contact area of a slide; `cell` is the
    spacing of the grid along x [m]."""
    known, found = slide_errors(history, columns), dict[str, float]()
    if (slid := measure_slide(history, columns)) is None:
        return found
    rows = _during(history, columns)
    if not math.isnan(known.get(ERRORS[0], math.nan) + slid.mu_dyn):
        found["mu_max"] = _highest(columns, rows, cell)[1]
        found["mu_dyn"] = mean_of_slide(columns, rows, "friction")[1]
    if CORRECTED in columns and not math.isnan(known.get(ERRORS[1], math.nan)):
        found["contact_area"] = mean_of_slide(columns, rows, CORRECTED)[1]
    return found


def slide_errors(history: Sequence[Stage], columns: Mapping[str, Sequence[float]]) -> dict[str, float]:
    """Return the largest relative errors of friction and contact area in the rows of the slide, by the names of
    existing columns; without a slide, the errors in the last row; NaN if unknown."""
    rows = _during(history, columns)[1:].tolist() if measure_slide(history, columns) else [-1]
    if _cuts(columns, rows):
        return {name: math.nan for name in ERRORS if name in columns}
    return {name: largest(columns[name][row] for row in rows) for name in ERRORS if name in columns}


def mean_errors(history: Sequence[Stage], columns: Mapping[str, Sequence[float]]) -> dict[str, float]:
    """Return the relative errors of friction and contact area as means over the distance slid, by the names of their
    columns. They are printed at the end of a run. Errors of friction are weighted by friction. Without a slide, only
    the error of the area in the last row is returned. Errors that are not known are NaN."""
    if measure_slide(history, columns) is None:
        return {ERRORS[1]: columns[ERRORS[1]][-1]} if ERRORS[1] in columns else {}
    rows, found = _during(history, columns), dict[str, float]()
    if _cuts(columns, rows):
        return dict.fromkeys(ERRORS, math.nan)
    distance, friction, *errors = _at(columns, rows, "distance", "friction", *ERRORS)
    weights = np.diff(distance) * friction[1:], np.diff(distance)
    for name, error, weight in zip(ERRORS, (each[1:] for each in errors), weights, strict=True):
        counted = np.where(np.isnan(error), 0.0, weight)
        found[name] = float(np.nansum(counted * error) / counted.sum()) if counted.any() else math.nan
    return found


def largest(values: Iterable[float]) -> float:
    """Return the largest value that is not NaN; NaN if there is none."""
    return max((value for value in values if value == value), default=math.nan)


def ripple(distance: ArrayLike, friction: ArrayLike, at: int, cell: float) -> float:
    """Return by how much the friction in the row with index `at` exceeds its mean over one cell [m] around this row.

    Steps shorter than a cell meet the points of the grid in turn, which makes friction oscillate. The result is 0 if
    steps are a cell or longer, and in the first cell of the slide, where friction rises.
    """
    x, y = np.asarray(distance, float), np.asarray(friction, float)
    near = np.abs(x - x[at]) <= cell / 2 * (1 + SAME_INSTANT)
    if x[at] - x[0] < cell or np.count_nonzero(near) < 3 or not x[near][0] < x[at] < x[near][-1]:
        return 0.0
    return max(float(y[at] - mean_over_end(x[near], y[near], 1.0)), 0.0)


def _highest(columns: Mapping[str, Sequence[float]], rows: NDArray[np.intp], cell: float) -> tuple[float, float, float]:
    """Return the highest friction of some rows, its error, and the part of the error that is the ripple."""
    distance, friction, error = _at(columns, rows, "distance", "friction", ERRORS[0])
    at = int(np.argmax(friction[1:])) + 1
    wave = ripple(distance, friction, at, cell)
    return float(friction[at]), wave + float(error[at] * friction[at]), wave


def mean_of_slide(columns: Mapping[str, Sequence[float]], rows: NDArray[np.intp], name: str) -> tuple[float, float]:
    """Return the mean of a column over the last three quarters of a slide, and the mean of its absolute errors, in
    which unknown errors count as 0."""
    distance, values, *errors = _at(columns, rows, "distance", name, *RELATIVE.get(name, ()))
    within = np.abs(values) * np.nan_to_num(errors[0] if errors else np.zeros(values.size))
    return mean_over_end(distance, values), mean_over_end(distance, within)


def describe_slide(
    history: Sequence[Stage],
    initial: Initial,
    cell: float,
    columns: Mapping[str, Sequence[float]],
    free_area: float = 0.0,
) -> Iterator[str]:
    """Yield sentences on the slide so far, from columns of the run; no sentence before something slides.

    `cell` is the spacing of the grid along x [m]. Contact areas are in m² in a free box of `free_area` [m²], otherwise
    shares of the nominal area. If a history has several slides and the last one has not begun, the sentences describe
    the slide before it.
    """
    last, starts = _slide(history), np.cumsum([0.0, *(stage.seconds for stage in history[:-1])])
    begun = int(np.count_nonzero(starts < columns["time"][-1] * (1.0 - SAME_INSTANT))) if columns["time"] else 0
    not_begun = begun <= last.start
    so_far = history[:begun] if not_begun else history
    found = measure_slide(so_far, columns)
    if found is None:
        return
    if not_begun:
        ends_with = _slide(so_far).stop - 1
        yield f"the last slide has not begun; these numbers are of the previous one, ending with history.{ends_with}"
    every = _during(so_far, columns)
    rows = _inside(columns, every)
    if cut := every.size - rows.size:
        yield (
            f"in {cut} of {every.size} rows of the slide the contact is cut off by the edge of the box: they do not "
            "count below, and no error is known"
        )
        columns = {name: column for name, column in columns.items() if name not in ERRORS}
    if math.isnan(found.contact_area):
        return
    defined = found.mu_dyn == found.mu_dyn
    yield from _describe_friction(found, cell, columns, rows) if defined else _describe_force(columns, rows)
    size, unit = (free_area, "m²") if free_area else (1.0, "")
    area = f"{quantity(found.contact_area * size, unit, 4)} by counting points"
    if CORRECTED in columns:
        mean, error = mean_of_slide(columns, rows, CORRECTED)
        area = f"{with_error(mean * size, error * size, unit)} corrected for its edges, and {area}"
    yield f"the mean contact area over the same distance is {area}"
    for said_of in answers("results", "said_of_slide"):
        yield from said_of(columns, rows)
    known = {name: value for name, value in slide_errors(so_far, columns).items() if value == value}
    if known:
        what = dict(zip(ERRORS, ("friction", "contact area"), strict=True))
        parts = ", ".join(f"{what[name]} {stated_error(value)}" for name, value in known.items())
        yield f"largest estimated errors of single steps of the slide: {parts}"
    if known.get(ERRORS[0], 0.0) >= 1.0:
        yield "in some steps of the slide friction is smaller than its estimated error"
    if _continues_steady_start(initial, [history[index] for index in _slide(so_far)], rows):
        yield from _against_start(columns, found.mu_dyn, known.get(ERRORS[0], math.nan))


def _describe_friction(
    found: Slide, cell: float, columns: Mapping[str, Sequence[float]], rows: NDArray[np.intp]
) -> Iterator[str]:
    """Yield sentences on the highest and the mean friction of a slide, and on whether it is steady."""
    way = columns["distance"][rows[-1]] - columns["distance"][rows[0]]
    late = ", in its last tenth: friction may still rise" if found.mu_max_distance > LATE * way else ""
    after = f"{quantity(found.mu_max_distance, 'm')} after its start{late}"
    mu_max, error, wave = _highest(columns, rows, cell)
    error = wave if math.isnan(error) else error
    rippled = f" ({wave:.2g} of it a ripple with the period of a cell)" if wave > 0.1 * error else ""
    yield f"mu_max, the highest friction of the slide, is {with_error(mu_max, error)}{rippled}, {after}"
    length, dynamic = quantity(way, "m"), with_error(*mean_of_slide(columns, rows, "friction"))
    yield f"mu_dyn, the mean friction over the last three quarters of this slide of {length}, is {dynamic}"
    yield from _unsettled(columns, rows)


def _describe_force(columns: Mapping[str, Sequence[float]], rows: NDArray[np.intp]) -> Iterator[str]:
    """Yield a sentence on the tangential force of a slide without defined friction."""
    force, steps = _tangential(columns, rows), _without_load(columns, rows).size
    mean = mean_over_end(_at(columns, rows, "distance")[0], force)
    where = f"in {steps} of {len(rows) - 1} steps of the slide, which have no load, and is 0 in the table"
    size = f"{quantity(force[1:].max(), 'N')} at most, and {quantity(mean, 'N')} on average over the last"
    yield f"friction is not defined {where}: the tangential force is {size} three quarters of the slide"


def _unsettled(columns: Mapping[str, Sequence[float]], rows: NDArray[np.intp]) -> Iterator[str]:
    """Yield a sentence if friction of the two halves of the last three quarters differs by more than its known errors;
    steady sliding has one friction."""
    distance, friction, errors = _at(columns, rows, "distance", "friction", ERRORS[0])
    second = mean_over_end(distance, friction, DYNAMIC / 2)
    first = 2.0 * mean_over_end(distance, friction) - second
    if abs(second - first) > mean_over_end(distance, np.abs(friction) * errors):
        yield (
            f"friction has not settled: its means over the two halves of these three quarters, {first:.4g} and "
            f"{second:.4g}, differ by more than the estimated error"
        )


def _continues_steady_start(initial: Initial, stages: Sequence[Stage], rows: NDArray[np.intp]) -> bool:
    """Return True if a slide continues the steady sliding with which its run began, under the same load."""
    if initial.state != "steady" or initial.pressure is None or rows[0] != 0:
        return False
    same = initial.velocity, Ramp(initial.pressure, initial.pressure)
    return all((stage.velocity, stage.pressure) == same for stage in stages)


def _against_start(columns: Mapping[str, Sequence[float]], mu_dyn: float, error: float) -> Iterator[str]:
    """Yield a sentence if the steady start and the slide that continues it differ by more than their errors."""
    start, known = columns["friction"][0], columns.get(ERRORS[0], [math.nan])[0]
    allowed = known * abs(start) + error * abs(mu_dyn)
    if abs(mu_dyn - start) > allowed:
        yield (
            f"mu_dyn differs from friction of the steady start, {start:.4g}, by {abs(mu_dyn - start):.2g}, more than "
            f"their estimated errors together, {allowed:.2g}. As velocity and load are the same, they should agree: "
            "try shorter time steps and a smaller numerics.tolerance"
        )


def _slide(history: Sequence[Stage]) -> range:
    """Return the indices of the stages of the slide; none where nothing slides."""
    last = max((index for index, stage in enumerate(history) if stage.slides and stage.seconds), default=-1)
    same = takewhile(lambda index: _goes_on(history[index], history[last]), range(last, -1, -1))
    return range(min(same, default=max(last, 0)), last + 1)


def _goes_on(stage: Stage, last: Stage) -> bool:
    """Return True if the last stage of a slide has the motion and the constant load of an earlier stage."""
    earlier, later = ((one.velocity, one.control, one.load) for one in (stage, last))
    return earlier == later and last.load.constant


def _inside(columns: Mapping[str, Sequence[float]], rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the rows in which the box does not cut the contact off."""
    return rows[np.asarray(columns[CUT_OFF], float)[rows] != 1.0] if CUT_OFF in columns else rows


def _cuts(columns: Mapping[str, Sequence[float]], rows: Sequence[int] | NDArray[np.intp]) -> bool:
    """Return True if the box cuts the contact off in one of the rows."""
    return CUT_OFF in columns and any(columns[CUT_OFF][row] == 1.0 for row in rows)


def _during(history: Sequence[Stage], columns: Mapping[str, Sequence[float]]) -> NDArray[np.intp]:
    """Return the rows of the slide, from the last row before it to its end."""
    time = np.asarray(columns["time"], float)
    ends = np.cumsum([0.0, *(stage.seconds for stage in history)])
    slide = _slide(history)
    if not slide:
        return np.zeros(0, np.intp)
    start, end = ends[slide.start], ends[slide.stop]
    round_off = SAME_INSTANT * (end - start)
    before = np.flatnonzero(time <= start + round_off)[-1:]
    return np.append(before, np.flatnonzero((time > start + round_off) & (time <= end + round_off)))


LEAST_ROWS = 5  # rows of a cycle with an estimate of the error
PAIRS = 2.0**3 - 1.0  # accuracy: error of steps twice as long over the error of steps, minus 1
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

    `loss` [J] has the relative error `error_loss`. An amplitude is half the range of a quantity within the cycle: of
    friction [-], which is NaN where nothing slides, and of the approach [m]. `phase` is in rad, and NaN if force or
    displacement is constant.
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
    loss, between = _by_rows(time, force, place)
    work = float(np.diff(cycle["work"][[0, -1]])[0]) if "work" in cycle and not stage.speed else math.nan
    if math.isfinite(work):
        loss = work - _mean(time, force) * float(place[-1] - place[0])
        between = _within(force, place, _jumps(time, force))
    phase = _harmonic_angle(time, force, stage.frequency) - _harmonic_angle(time, place, stage.frequency)
    phase = math.remainder(phase, 2.0 * math.pi) if np.ptp(force) and np.ptp(place) else math.nan
    error = between / abs(loss) if loss else math.nan
    if way is None:
        error += _load_error(job, stage, cycle, phase)
    else:
        error += _mean_error(cycle["error_friction"], np.abs(along))
    with np.errstate(divide="ignore", invalid="ignore"):
        friction = along / (area * cycle["pressure"]) if stage.speed else np.full(1, np.nan)
    mu, depth = (0.5 * float(np.ptp(values)) for values in (friction, cycle["approach"]))
    return Cycle(index, number, stage.frequency, loss, error, mu, depth, phase)


def _by_rows(time: Array, force: Array, place: Array) -> tuple[float, float]:
    """Return the loss of a cycle from force and displacement, and its error by interpolation and jumps [J]."""
    every_second = np.unique([*range(0, time.size, 2), time.size - 1])
    loss, rough = (_loop(time[rows], force[rows], place[rows]) for rows in (slice(None), every_second))
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
    """Return `loss`, `error_loss` and `phase` of the last cycle by these names; empty without a whole cycle."""
    found = find_cycles(job, columns)
    return {name: getattr(found[-1], name) for name in ("loss", "error_loss", "phase")} if found else {}


def write_cycles(directory: Path, job: Job, columns: Columns) -> Iterator[str]:
    """Write cycles.csv, and yield a sentence on the last cycles of each stage that oscillates. Raises OSError."""
    found = find_cycles(job, columns)
    rows = (values_of(CYCLES, cycle) for cycle in found)
    files.replace_file(directory / outputs.CYCLES, to_csv(names_of(CYCLES), rows))
    yield from describe_cycles(job, found)


def describe_cycles(job: Job, found: Sequence[Cycle]) -> Iterator[str]:
    """Yield a sentence on the last of the cycles of each stage that oscillates."""
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
    """Return the distance [m] that the surface has moved along the velocity in each row of a stage. The stage starts at
    the time `start` [s]. Return None for a constant velocity, whose stage has no cycles."""
    if not isinstance(stage.velocity, Swing):
        return None
    return stage.speed * np.array([stage.moving(time - start) for time in columns["time"].tolist()])


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

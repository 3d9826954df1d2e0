"""Steady sliding from Python: friction curves."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..bands.road_sliding import make_states
from ..columns import STEADY
from ..doubts import Doubt
from ..errors import JobError, RunError
from ..job import log_range
from ..job.added_sections import answers
from ..job.checks.cells import more_points
from ..parallel.mpi import MPI
from ..parallel.slab import Slab
from ..scene.sanity import ContactWatch
from ..steady_sliding import curve
from ..steady_sliding.point import Point
from ..steady_sliding.table import describe_missed
from ..storage import wisdom
from ..storage.curve_points import Wanted
from .given_jobs import Given, all_ranks, read_job_here, warn
from .wording import python_words

Array = NDArray[np.float64]
Values = str | float | Sequence[float] | Array | None


@dataclass(frozen=True)
class Curve:
    """Steady states: arrays of shape (points,), for each temperature all velocities under each pressure.

    `velocity` [m/s], `pressure` [Pa, mean], `friction` [-, dissipated power over load and velocity, plus interface
    friction], `friction_slopes` [-, by the slopes of the rigid surface], `error_friction`, `error_area` [-, relative
    errors of friction and of the corrected area], `contact_area`, `contact_area_corrected` [share of the nominal area,
    counted and corrected at edges], `force_x`, `force_y` [N, on the rigid surface], `approach`, `mean_gap` [m],
    `max_pressure` [Pa], `residual` [-, of the solve]; `power` [W, shape (points, branches), dissipated by each branch;
    none for a free scene]; `temperature` [deg C, NaN if not requested], `shift_factor` [-, relaxation times over those
    at the reference]; `flash_temperature`, `max_temperature` [K, mean rise in the contact and highest rise; NaN without
    `thermal`], `error_flash` [-, relative error of the mean rise].

    Points that could not be solved are NaN, with the reason in `failures`.
    """

    velocity: Array
    pressure: Array
    friction: Array
    friction_slopes: Array
    error_friction: Array
    error_area: Array
    contact_area: Array
    contact_area_corrected: Array
    force_x: Array
    force_y: Array
    approach: Array
    mean_gap: Array
    max_pressure: Array
    residual: Array
    power: Array
    temperature: Array
    shift_factor: Array
    flash_temperature: Array
    max_temperature: Array
    error_flash: Array
    failures: tuple[str, ...] = ()


def steady(
    job: Given,
    velocities: Values = None,
    pressures: Values = None,
    temperatures: Values = None,
    set: Mapping[str, Any] | None = None,
    comm: MPI.Intracomm | None = None,
) -> Curve:
    """Solve steady sliding at velocities [m/s] under mean pressures [Pa], and return the curve on every rank;
    collective.

    `job` and `set` as for `Simulation`; velocities and pressures as lists or as texts `first:last:count`, equally
    spaced in the logarithm (default: the job's `steady` section, and the pressure of its first loaded stage);
    `temperatures` [deg C] as a list, for a material with a shift (default: that section). Raises JobError, and
    InputError for missing velocities or pressures; warns (ParcontactWarning, on root) about failed points and
    implausible values. Nothing is written.
    """
    asked = {
        "velocities": _numbers("velocities", velocities),
        "pressures": _numbers("pressures", pressures),
        "temperatures": _numbers("temperatures", temperatures, ranges=False),
    }
    keys = {f"steady.{name}": list(values) for name, values in asked.items() if values}  # the job needs no history
    found = read_job_here(job, {**set, **keys} if isinstance(set, Mapping) else set or keys, comm)
    slab = Slab(all_ranks(comm), *found.grid.points)
    with python_words():
        wanted = curve.request(found, *asked.values())
    wisdom.recall(curve.transforms_of(found), slab, None)
    sliding = make_states(found, slab)
    for doubt in sliding.doubts(wanted.temperatures):
        if slab.root:
            warn(doubt)
    contacts = ContactWatch(found.numerics.strict, sliding.setup.choices.timeline, more=more_points(found.grid))
    points: list[Point | None] = []
    failures: list[str] = []
    doubts: list[Doubt] = []
    for at in wanted.points:
        point = None
        try:
            if wanted.temperatures:
                sliding.set_temperature(at.temperature)
            point = sliding.solve(wanted.velocity(at.speed), at.pressure)
        except RunError as error:
            failures.append(str(error))
            doubts.append(Doubt("unsolved point", "", {"where": str(error)}))
        sliding.forget()
        points.append(point)
        doubts += contacts.check_point(point.measures, str(at)) if point else []
    solved = [point for point in points if point]
    of_points = [doubt for doubts_of in answers("steady", "doubts_of_points") for doubt in doubts_of(solved, found)]
    of_points += describe_missed(solved, found)
    for doubt in (*doubts, *of_points) if slab.root else ():
        warn(doubt)
    return _curve(wanted.points, points, tuple(failures))


def _curve(wanted: Sequence[Wanted], points: Sequence[Point | None], failures: tuple[str, ...]) -> Curve:
    """Return the columns of steady.csv as arrays; failed points have their requested coordinates."""
    places = {"velocity": "speed", "pressure": "pressure", "temperature": "temperature"}
    found = {name: np.array([getattr(at, place) for at in wanted]) for name, place in places.items()}
    wanted_names = {each.name for each in fields(Curve)} - {*places, "power", "failures"}
    for column in (column for column in STEADY if column.name in wanted_names):
        values = [math.nan if point is None else float(column.value(point)) for point in points]
        found[column.name] = np.array(values)
    branches = max((len(point.dissipated) for point in points if point), default=0)
    power = np.array([(math.nan,) * branches if point is None else point.dissipated for point in points])
    return Curve(**found, power=power, failures=failures)


def _numbers(name: str, values: Values, ranges: bool = True) -> tuple[float, ...]:
    if values is None:
        return ()
    try:
        if isinstance(values, str) and ranges:
            return log_range(values)
        if not isinstance(values, str) and not np.iscomplexobj(values):
            return tuple(float(value) for value in np.ravel(values))
    except (TypeError, ValueError):
        pass
    also = " or a range first:last:count" if ranges else ""
    raise JobError([f"{name} must be a number, a list of numbers{also}, got {values!r:.60}"])

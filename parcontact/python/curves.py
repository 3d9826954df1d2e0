"""Steady sliding from Python: friction curves."""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RunError
from ..job import log_range
from ..parallel.mpi import MPI
from ..parallel.slab import Slab
from ..scene import frame
from ..steady_sliding import curve
from ..steady_sliding.sliding import Point, SteadySliding
from .jobs import Given, read

Array = NDArray[np.float64]
Values = str | float | Sequence[float] | Array | None


@dataclass(frozen=True)
class Curve:
    """Steady states, point by point: arrays of shape (points,), all velocities under the first pressure first.

    `velocity` [m/s], `pressure` [Pa, mean], `friction` [-], `contact_area` [share of the nominal], `force_x`, `force_y`
    [N, on the rigid surface], `approach`, `mean_gap` [m], `max_pressure` [Pa], `residual` [-, the certificate];
    `power` [W] of shape (points, branches): what each branch of the material dissipates, none for a free scene.

    A point that could not be solved is NaN, and `failures` says why.
    """

    velocity: Array
    pressure: Array
    friction: Array
    contact_area: Array
    force_x: Array
    force_y: Array
    approach: Array
    mean_gap: Array
    max_pressure: Array
    residual: Array
    power: Array
    failures: tuple[str, ...] = ()


MEASURED = ("friction", "contact_area", "force_x", "force_y", "approach", "mean_gap", "max_pressure")


def steady(
    job: Given,
    velocities: Values = None,
    pressures: Values = None,
    set: Mapping[str, Any] | None = None,
    comm: MPI.Intracomm | None = None,
) -> Curve:
    """Steady sliding of a job's surface at velocities [m/s] under mean pressures [Pa], on every rank; collective.

    `job` and `set` as for `Simulation`; velocities and pressures as lists or as texts `first:last:count`, equally
    spaced in the logarithm (default: those of the job's `steady` section, and the pressure of its first loaded stage).
    Raises JobError, and InputError where velocities or pressures lack. Nothing is written.
    """
    asked = {"velocities": _numbers(velocities), "pressures": _numbers(pressures)}
    keys = {f"steady.{name}": list(values) for name, values in asked.items() if values}  # a job needs no history then
    found = read(job, {**(set or {}), **keys}, comm)
    slab = Slab(comm or MPI.COMM_WORLD, *found.grid.points)
    wanted = curve.request(found, *asked.values())
    sliding = SteadySliding(frame(found, slab))
    points: list[tuple[float, float, Point | None]] = []
    failures: list[str] = []
    for pressure, speed in itertools.product(wanted.pressures, wanted.velocities):
        try:
            velocity = (speed * wanted.direction[0], speed * wanted.direction[1])
            points.append((speed, pressure, sliding.solve(velocity, pressure)))
        except RunError as error:
            points.append((speed, pressure, None))
            failures.append(str(error))
            warnings.warn(str(error), RuntimeWarning, stacklevel=2)
    return _curve(points, tuple(failures))


def _curve(points: list[tuple[float, float, Point | None]], failures: tuple[str, ...]) -> Curve:
    def all_of(name: str) -> Array:
        return np.array([math.nan if point is None else getattr(point.measures, name) for _, _, point in points])

    branches = max((len(point.dissipated) for _, _, point in points if point), default=0)
    return Curve(
        np.array([speed for speed, _, _ in points]),
        np.array([pressure for _, pressure, _ in points]),
        **{name: all_of(name) for name in MEASURED},
        residual=np.array([math.nan if point is None else point.certificate.worst for _, _, point in points]),
        power=np.array([(math.nan,) * branches if point is None else point.dissipated for _, _, point in points]),
        failures=failures,
    )


def _numbers(values: Values) -> tuple[float, ...]:
    if values is None:
        return ()
    if isinstance(values, str):
        return log_range(values)
    return tuple(float(value) for value in np.ravel(values))

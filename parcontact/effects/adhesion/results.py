"""Results of adhesion in texts and tables: the pull-offs of a run, from its rows. A pull-off is the largest tension
before a contact detaches.

The largest tension lies between steps. The row before the row of the lowest load is earlier by the time s, and its load
is higher by a. The row after the row of the lowest load is later by the time t, and its load is higher by b. Then the
vertex of the parabola through these three points is below the lowest load by

    e = (b s/t - a t/s)^2/(4 (s + t) (a/s + b/t)).

The vertex is the load of the pull-off. The error of this load is the sum of four parts: e; SOLVER times the tolerance
of the solves; PULL_OFF times the median relative mesh error of the contact area up to this row; and ZONE times the
fourth power of the ratio of a cell's side to the length of the process zone. The last part is due to coarse cells,
which hold the edge of contact in its place. The last two parts are multiplied by SYMMETRIC if the only shape has the
symmetry of the grid, which then holds the edge on all sides at once. In tests, spheres were pulled off at seven rates
with chosen steps, at accuracies from 0.1 to 0.005: all pull-offs differed from runs with 1500 equal steps by less than
this error, even without its parts by the mesh.

If the pull has no later row, if the contact snaps, or if it still exists at the end, the pull-off is the lowest load
itself. Then the first part of the error is not e, but the difference between the lowest load and the load of the row
before.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...march.budget import PULL_OFF, SYMMETRIC
from ...march.time_error import Fit, centre_of, is_symmetric
from ...printed import quantity, with_error
from ...results.results import Results

ZONE = Fit(
    "pull-off: times a power of the cell over the process zone",
    0.03,
    4.0,
    "tests/scenarios/test_adhesion.py",
    "1.1 to 5 for spheres with cells of 0.7 to 2.4 zones",
)
SOLVER = 0.25  # accuracy: relative error of the load over the tolerance of the solves
SNAP = 0.5  # accuracy: change of load in a step, over the largest tension, above which no parabola is used
LEAST_PULL = 1e-9  # rounding: least mean tension over the highest pressure

Columns = Mapping[str, Sequence[float]]
Values = NDArray[np.float64]


class PullOff(NamedTuple):
    """A pull-off. `row` is the row of the lowest load. `pressure` is the load of the pull-off, and `between` is the
    error of this load by the steps; both are mean pressures [Pa]. `lost` is the first row without contact. It is the
    number of rows if the run ended with the detachment, and None if the contact still exists. `mesh` is the relative
    error of the load by the mesh, NaN if unknown."""

    row: int
    pressure: float
    between: float
    lost: int | None
    mesh: float = math.nan

    def error(self, tolerance: float) -> float:
        """Return the error of the load [Pa] by steps and mesh, and by the `tolerance` of the solves."""
        return self.between - (SOLVER * tolerance + self.mesh) * self.pressure


def find(columns: Columns, detached: bool = False, coarseness: float = 0.0, symmetric: bool = False) -> list[PullOff]:
    """Return the pull-offs of a run in order, from its columns `time`, `pressure`, `max_pressure`, `approach`,
    `contact_area` and `error_area`.

    `detached` is True if the run ended because its surfaces detached. `coarseness` is the side of a cell divided by the
    length of the process zone. `symmetric` is True if the only shape has the symmetry of the grid.

    A pull is a range of rows in which the surfaces move apart. If contact is lost, the pull is the last such range
    before the loss. Otherwise the pull begins where the surfaces are closest. Rows after the loss of contact belong to
    the pull as long as the surfaces move apart, since a lower load may follow there.
    """
    names = "time", "pressure", "approach", "contact_area"
    time, pressure, approach, area = (np.asarray(columns[name], float) for name in names)
    touching = np.concatenate([[False], area > 0.0, [False]])
    changes = np.flatnonzero(touching[1:] != touching[:-1]).tolist()
    last = len(area) if detached else len(area) - 1  # last row at which a contact may be lost
    pulls = [_find(time, pressure, approach, last, *ends) for ends in zip(changes[::2], changes[1::2], strict=True)]
    least = -LEAST_PULL * np.asarray(columns["max_pressure"], float)
    zone, coherent, found = ZONE.value * coarseness**ZONE.order, SYMMETRIC.value if symmetric else 1.0, []
    for pull in (pull for pull in pulls if pull.pressure < least[pull.row]):
        known = [error for error in columns["error_area"][: pull.row + 1] if error == error]
        mesh = coherent * (PULL_OFF.value * float(np.median(known)) + zone) if known else math.nan
        found.append(pull._replace(mesh=mesh))
    return found


def _find(time: Values, pressure: Values, approach: Values, last: int, start: int, end: int) -> PullOff:
    """Return the pull-off of a contact in rows `start` to `end` (excluded), which is lost if `end` is not after
    `last`."""
    begin, stop, lost = start + int(np.argmax(approach[start:end])), end, end <= last
    if lost and (nearer := np.flatnonzero(np.diff(approach[begin:end]) > 0.0)).size:
        begin += int(nearer[-1]) + 1
    while stop < len(approach) and approach[stop] < approach[stop - 1] and pressure[stop]:  # 0 after detachment
        stop += 1
    row = begin + int(np.argmin(pressure[begin:stop]))
    held = end if lost else None
    if lost and start < row < stop - 1 and pressure[row + 1] < (1.0 - SNAP) * pressure[row]:
        below = _below(np.diff(time[row - 1 : row + 2]), pressure[row - 1 : row + 2])
        return PullOff(row, float(pressure[row]) - below, below, held)
    near = pressure[row - 1] if row > start else pressure[row + 1] if row + 1 < stop else pressure[row]
    return PullOff(row, float(pressure[row]), float(near - pressure[row]), held)


def _below(steps: Values, loads: Values) -> float:
    """Return the depth of the vertex of the parabola through three loads below the second, the lowest one."""
    (before, after), (left, right) = steps, (loads[0] - loads[1], loads[2] - loads[1])
    if min(before, after) <= 0.0 or left + right == 0.0:
        return 0.0
    falls, rises = left / before, right / after
    slope = (rises * before - falls * after) / (before + after)
    return slope**2 * (before + after) / (4.0 * (falls + rises))


def describe_pull_off(pulls: Sequence[PullOff], columns: Columns, area: float, tolerance: float) -> Iterator[str]:
    """Yield a sentence for each of the `pulls` of a run with these columns. For a contact that still exists the
    sentence states the largest pull so far. `area` is the area of the box [m^2], `tolerance` the tolerance of the
    solves."""
    many = sum(pull.lost is not None for pull in pulls) > 1
    for number, pull in enumerate(pulls, 1):
        time, approach = (columns[name][pull.row] for name in ("time", "approach"))
        load = f"{quantity(-pull.pressure * area, 'N', 4)} ({quantity(-pull.pressure, 'Pa', 4)})"
        where = f"at t = {quantity(time, 's', 4)}, approach {quantity(approach, 'm', 4)}"
        if pull.lost is None:
            yield f"largest pull so far: {load}, {where}; contact holds"
            continue
        error = pull.error(tolerance) * area
        within = "its error is not known" if math.isnan(error) else f"its error is {quantity(error, 'N', 2)}"
        after = "the next load had no equilibrium"
        if pull.lost < len(columns["time"]):
            after = f"contact was lost by t = {quantity(columns['time'][pull.lost], 's', 4)}"
        yield f"{f'pull-off {number}' if many else 'pull-off'}: {load}, {where}; {within}, and {after}"


SWEPT = (("pull_off", "the pull-off force", "N", "pull_off_error"),)  # results of a sweep for its headline


def _pulls(run: Results) -> list[PullOff]:
    """Return the pull-offs of a run; none if its job has no adhesion."""
    if run.job is None or run.job.section("adhesion") is None:
        return []
    from .effect import law_of  # slow to import, and for jobs with adhesion only

    law = law_of(run.job)
    symmetric = is_symmetric(centre_of(run.job)) and not any(stage.speed for stage in run.job.history)
    return find(run.table, bool(run.detached), law.cell / law.zone if law.zone else math.nan, symmetric)


def sentences(run: Results) -> Iterator[str]:
    """Yield a sentence for each pull-off, and for the largest pull of a contact that still exists."""
    if run.job is not None and (pulls := _pulls(run)):
        yield from describe_pull_off(pulls, run.table, run.job.grid.lx * run.job.grid.ly, run.job.numerics.tolerance)


said_at_end = sentences  # also at the end of a run


def headline(run: Results) -> Iterator[str]:
    """Yield a line with the force of the last pull-off and its error, if a pull-off was found."""
    if found := dict(swept(run)):
        yield f"the pull-off force is {with_error(found['pull_off'], found['pull_off_error'], 'N')}"


def swept(run: Results) -> Iterator[tuple[str, float]]:
    """Yield names and values of a case's last pull-off: the force and its error [N], and the approach [m]. Yield
    nothing if the contact still exists."""
    lost = [each for each in _pulls(run) if each.lost is not None]
    if run.job is not None and lost:
        area, pull = run.job.grid.lx * run.job.grid.ly, lost[-1]
        yield "pull_off", -pull.pressure * area
        yield "pull_off_error", pull.error(run.job.numerics.tolerance) * area
        yield "pull_off_approach", run.table["approach"][pull.row]


def telling_row(run: Results) -> Iterator[int]:
    """Yield the number of the row of the last pull-off, which shows the contact of the run best
    (`results.Results.telling_row`)."""
    yield from (pull.row for pull in _pulls(run)[-1:])

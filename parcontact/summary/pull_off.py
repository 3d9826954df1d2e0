"""Pull-offs: the loads at which surfaces that stick came off, from the rows of a run."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..printed import quantity

SAME_LOAD = 1e-9  # rounding: relative: loads this close are the same
LEAST_PULL = 1e-9  # accuracy: of the highest pressure, below which a mean pressure is what rounding leaves of 0

Columns = Mapping[str, Sequence[float]]


class PullOff(NamedTuple):
    """The row of the lowest load of a pull, by how much the loads of the rows beside it differ from that [Pa], and the
    first row without contact: the one after the last where the run ended with it, None where contact holds."""

    row: int
    beside: float
    lost: int | None


def find(columns: Columns, detached: bool = False) -> list[PullOff]:
    """Return the pull-offs of a run in their order, from its columns `pressure`, `max_pressure`, `approach` and
    `contact_area`; it may have ended as its surfaces `detached`.

    A pull begins where the surfaces of a contact are nearest, or when they last came nearer before it was lost: an
    earlier pull that it has held is no pull-off. It ends where the surfaces part no more: those that have come off may
    pull each other harder than before, and what they do when they come near again is not of the pull.
    """
    pressure, approach, area = (np.asarray(columns[name], float) for name in ("pressure", "approach", "contact_area"))
    touching = np.concatenate([[False], area > 0.0, [False]])
    changes = np.flatnonzero(touching[1:] != touching[:-1]).tolist()
    last = len(area) if detached else len(area) - 1  # row at which a contact was lost at the latest
    pulls = [_find(pressure, approach, last, *ends) for ends in zip(changes[::2], changes[1::2], strict=True)]
    least = -LEAST_PULL * np.asarray(columns["max_pressure"], float)
    return [pull for pull in pulls if pressure[pull.row] < least[pull.row]]


def _find(pressure: NDArray[np.float64], approach: NDArray[np.float64], last: int, start: int, end: int) -> PullOff:
    """Return the lowest load of a contact from the row `start` to before the row `end`, lost if that is not after the
    `last` one."""
    begin, stop, lost = start + int(np.argmax(approach[start:end])), end, end <= last
    if lost and (nearer := np.flatnonzero(np.diff(approach[begin:end]) > 0.0)).size:
        begin += int(nearer[-1]) + 1
    while stop < len(approach) and approach[stop] < approach[stop - 1] and pressure[stop]:  # 0 where nothing held
        stop += 1
    row = begin + int(np.argmin(pressure[begin:stop]))
    near = pressure[max(row - 1, start) : min(row + 2, stop)]
    return PullOff(row, float(np.abs(near - pressure[row]).max()), end if lost else None)


def choose_row(columns: Columns, detached: bool = False) -> int:
    """Return the row that shows the contact of a run: the last one, unless the surfaces came off by then. In that case
    it is the row of the last pull-off, or without one the last row of the largest load. Arguments as for `find`."""
    pressure, area = (np.asarray(columns[name], float) for name in ("pressure", "contact_area"))
    if area[-1] > 0.0 and not detached:
        return len(area) - 1
    pulls = find(columns, detached)
    return pulls[-1].row if pulls else int(np.flatnonzero(pressure >= (1.0 - SAME_LOAD) * pressure.max())[-1])


def describe(columns: Columns, area: float, detached: bool = False) -> Iterator[str]:
    """Yield a sentence for each pull-off, and for the largest pull of a contact that holds; `area` is the box [m^2]."""
    pulls = find(columns, detached)
    many = sum(pull.lost is not None for pull in pulls) > 1
    for number, (row, beside, lost) in enumerate(pulls, 1):
        pressure, time, approach = (columns[name][row] for name in ("pressure", "time", "approach"))
        load = f"{quantity(-pressure * area, 'N', 4)} ({quantity(-pressure, 'Pa', 4)})"
        where = f"at t = {quantity(time, 's', 4)}, approach {quantity(approach, 'm', 4)}"
        within = f"the steps beside it differ by {quantity(beside * area, 'N', 2)}"
        if lost is None:
            yield f"largest pull so far: {load}, {where}; contact holds"
            continue
        after = "nothing held the next load"
        if lost < len(columns["time"]):
            after = f"contact was lost by t = {quantity(columns['time'][lost], 's', 4)}"
        yield f"{f'pull-off {number}' if many else 'pull-off'}: {load}, {where}; {within}, and {after}"

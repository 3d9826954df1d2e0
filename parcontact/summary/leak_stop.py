"""Where leakage stops: between which pressures, or instants, contact closes the gap along x and along y.

The conductivities K are those of `leak.csv`, of the gaps that a run has saved, else those of the run's own table.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..printed import quantity, span
from ..storage import read_back

Columns = Mapping[str, Sequence[float]]


def describe_leak_stop(directory: Path) -> list[str]:
    """Return a sentence for each direction in which the leakage of an output directory is known; one where both agree.

    A sentence names the pressures of the last instant with a flow and of the first one without, or their times where
    the pressure stays. Raises InputError for a table that cannot be read.
    """
    table = next((path for name in ("leak.csv", "measures.csv") if (path := directory / name).is_file()), None)
    columns = read_back.read_results(table) if table else {}
    found = [(axis, said) for axis in "xy" if (said := describe_axis(columns, axis))]
    if len({said for _, said in found}) == 1:
        found = [(" and ".join(axis for axis, _ in found), found[0][1])]
    return [f"leakage along {axis} {said}" for axis, said in found]


def describe_axis(columns: Columns, axis: str) -> str:
    """Return how leakage along an axis goes over the rows of a table: `stops between 1.05 and 1.10 MPa`; '' where no
    row has it."""
    flows, pressures = (columns.get(name, ()) for name in (f"flow_{axis}", "pressure"))
    pairs = enumerate(zip(flows, pressures, strict=False))
    known = [row for row, pair in pairs if not any(map(math.isnan, pair))]
    stopped = next((place for place, row in enumerate(known) if flows[row] == 0.0), None)
    if not known:
        return ""
    if stopped is None:
        return f"does not stop, up to {quantity(max(pressures[row] for row in known), 'Pa')}"
    closed = max(place for place, row in enumerate(known) if flows[row] == 0.0)
    opens = f", and begins again {_between(columns, *known[closed : closed + 2])}" if known[closed + 1 :] else ""
    if stopped == 0:
        return f"has stopped at the first instant, under {quantity(pressures[known[0]], 'Pa')}{opens}"
    return f"stops {_between(columns, *known[stopped - 1 : stopped + 1])}{opens}"


def _between(columns: Columns, before: int, after: int) -> str:
    """Return between which pressures two rows are; between which times, where the pressure stays."""
    ends = columns["pressure"][before], columns["pressure"][after]
    if ends[0] != ends[1]:
        return f"between {span(min(ends), max(ends), 'Pa')}"
    return f"between {span(columns['time'][before], columns['time'][after], 's')}, under {quantity(ends[1], 'Pa')}"

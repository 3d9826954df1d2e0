"""Pressures, or instants, between which contact closes the gap along x and along y.

Conductivities K are read from `leak.csv`, which is made from saved gaps, else from measures.csv.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from ...printed import quantity, span
from ...storage import read_back

Columns = Mapping[str, Sequence[float]]


def describe_leak_stop(directory: Path) -> list[str]:
    """Return a sentence on leakage for each direction with known conductivity; one sentence if both agree.

    A sentence has the pressures of the last instant with a flow and of the first one without, or their times if the
    pressure is constant. Raises InputError for an unreadable table.
    """
    table = next((path for name in ("leak.csv", "measures.csv") if (path := directory / name).is_file()), None)
    columns = read_back.read_results(table) if table else {}
    found = [(axis, said) for axis in "xy" if (said := describe_axis(columns, axis))]
    if len({said for _, said in found}) == 1:
        found = [(" and ".join(axis for axis, _ in found), found[0][1])]
    return [f"leakage along {axis} {said}" for axis, said in found]


def describe_axis(columns: Columns, axis: str) -> str:
    """Return how leakage along an axis changes over the rows of a table: `stops between 1.05 and 1.10 MPa`; '' if
    unknown."""
    flows, pressures = (columns.get(name, ()) for name in (f"flow_{axis}", "pressure"))
    pairs = enumerate(zip(flows, pressures, strict=False))
    known = [row for row, pair in pairs if not any(map(math.isnan, pair))]
    stopped = next((place for place, row in enumerate(known) if flows[row] == 0.0), None)
    if not known:
        return ""
    if stopped is None:
        return f"does not stop up to {quantity(max(pressures[row] for row in known), 'Pa')}"
    closed = max(place for place, row in enumerate(known) if flows[row] == 0.0)
    opens = f", and begins again {_between(columns, *known[closed : closed + 2])}" if known[closed + 1 :] else ""
    if stopped == 0:
        return f"has already stopped at the first instant, under {quantity(pressures[known[0]], 'Pa')}{opens}"
    return f"stops {_between(columns, *known[stopped - 1 : stopped + 1])}{opens}"


def _between(columns: Columns, before: int, after: int) -> str:
    """Return the pressures of two rows as text; their times if the pressure is constant."""
    ends = columns["pressure"][before], columns["pressure"][after]
    if ends[0] != ends[1]:
        return f"between {span(min(ends), max(ends), 'Pa')}"
    return f"between {span(columns['time'][before], columns['time'][after], 's')}, under {quantity(ends[1], 'Pa')}"

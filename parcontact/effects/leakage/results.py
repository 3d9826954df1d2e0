"""Results of leakage in texts: conductivities, and the two loads between which the gap closes, along x and along y.

Conductivities K are read from `leak.csv`, which `parcontact leak` makes from saved gaps, else from measures.csv.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

from ...printed import quantity, span, stated_error, with_error
from ...results.results import ExportedTable, Results

TABLE = "leak.csv"
EXPORTED = {  # columns for other programs
    "pressure": "pressure [Pa]",
    **{f"flow_{axis}": f"conductivity K along {axis} [m^3]" for axis in "xy"},
    **{f"error_{axis}": f"relative error of K along {axis} [-]" for axis in "xy"},
}
PICTURES = {"leak.png": "flow through the gap, and conductivity"}  # pictures of a run that a report shows
Columns = Mapping[str, Sequence[float]]


def headline(run: Results) -> Iterator[str]:
    """Yield a line with the last conductivities, from `leak.csv` with their errors, else from measures.csv."""
    columns = run.read(TABLE) or run.table
    stops = [text for text in describe_leak_stop(run) if " between " in text]
    known = [row for row, flow in enumerate(columns.get("flow_x", ())) if flow == flow]
    if known:
        row = known[-1]
        axes = [axis for axis in "xy" if f"flow_{axis}" in columns]
        closed = [axis for axis in axes if not columns[f"flow_{axis}"][row]]
        flows = [_flow(columns, row, axis) for axis in axes if axis not in closed]
        yield from [f"the conductivity of the gap is {' and '.join(flows)}"] * bool(flows)
        yield from [f"contact closes the gap along {' and '.join(closed)}"] * bool(closed)
        yield from stops
    yield from _with_part(columns)


def _with_part(columns: Columns) -> Iterator[str]:
    """Yield the last known flow of a fluid that carries a part of the load."""
    pairs = zip(columns.get("flow_rate_total", ()), columns.get("flow_rate", ()), strict=False)
    known = [(total, net) for total, net in pairs if total == total]
    if known:
        total, net = known[-1]
        more = f", {total / net:.3g} times the flow under a net load" if net else ""
        yield f"{total:.3g} m³/s leak if the fluid carries its part of the load{more}"


def _flow(columns: Columns, row: int, axis: str) -> str:
    flow, error = columns[f"flow_{axis}"][row], _error(columns, axis, row)
    return f"{with_error(flow, flow * error)} m³ along {axis}"


def _error(columns: Columns, axis: str, row: int) -> float:
    """Return the relative error of K, NaN if the table has none."""
    errors = columns.get(f"error_{axis}")
    return math.nan if errors is None else errors[row]


def sentences(run: Results) -> list[str]:
    """Return sentences on the loads at which leakage stops, or on the seal if the fluid carries a part of the load."""
    return list(said_at_end(run)) or describe_leak_stop(run)


def said_at_end(run: Results) -> Iterator[str]:
    """Yield sentences for a fluid that carries a part of the load. They state the pressures at which the seal opens,
    closes and lifts off, and the last leak with its errors."""
    columns = run.table
    if "high_pressure" not in columns:
        return
    known = [row for row, flow in enumerate(columns["flow_x"]) if flow == flow]
    for before, now in pairwise(known):
        opened = [columns["flow_x"][row] > 0.0 for row in (before, now)]
        if opened[0] != opened[1] and columns["high_pressure"][before] != columns["high_pressure"][now]:
            first, second = sorted(columns["high_pressure"][row] for row in (before, now))
            ends = span(first, second, "Pa")
            load = quantity(columns["pressure"][now], "Pa")
            yield f"the seal {'opens' if opened[1] else 'closes'} between {ends} of the fluid, under {load}"
    if run.detached and known:
        high, load = (quantity(columns[name][known[-1]], "Pa") for name in ("high_pressure", "pressure"))
        yield f"the fluid lifts the seal off: up to {high} it has an equilibrium under {load}, in the next step none"
    drop = [high - low for high, low in zip(columns["high_pressure"], columns["low_pressure"], strict=True)]
    leaking = [row for row in known if columns["flow_x"][row] > 0.0 and drop[row] > 0.0]
    if leaking:
        yield _describe_leak(columns, leaking[-1])
    elif known and not any(columns["flow_x"][row] for row in known):
        yield "contact closes the seal in all steps"


def _describe_leak(columns: Columns, row: int) -> str:
    """Return a sentence on the leak in a row, and on its errors."""
    errors = {"mesh": "error_x", "rounds": "error_rounds", "small leak": "error_leak"}
    said = ", ".join(f"{name} {stated_error(columns[key][row])}" for name, key in errors.items())
    pressures = span(columns["low_pressure"][row], columns["high_pressure"][row], "Pa")
    name, unit = ("flow_rate", "m³/s") if columns["flow_rate"][row] > 0.0 else ("mass_flow", "kg/s")  # into a vacuum
    leak = f"{columns[name][row]:.3g} {unit} leak through the box between {pressures}"
    return f"{leak}, at t = {quantity(columns['time'][row], 's')} (errors: {said})"


def exported(run: Results) -> list[ExportedTable]:
    """Return tables for other programs: the known conductivities by load. If a load occurs in several rows, the last
    row counts. The list is empty if the fluid carries a part of the load."""
    columns = run.read(TABLE) or run.table
    names = [name for name in EXPORTED if name in columns]
    flows = () if "high_pressure" in columns else columns.get("flow_x", ())
    known = [row for row, flow in enumerate(flows) if flow == flow]
    loads = {float(f"{columns['pressure'][row]:.9g}"): row for row in known}  # without rounding errors
    rows = {load: [load, *(columns[name][row] for name in names[1:])] for load, row in loads.items()}
    head = [EXPORTED[name] for name in names]
    return [ExportedTable("conductivity", head, [rows[load] for load in sorted(rows)])] if rows else []


def _describe_table(run: Results) -> Iterator[str]:
    yield f"  leakage: {len(run.read(TABLE)['time'])} instants in {TABLE}"


PARTS = {TABLE: _describe_table}  # descriptions of files of a run, by their names


def describe_leak_stop(run: Results) -> list[str]:
    """Return a sentence on leakage for each direction with known conductivity; one sentence if both directions agree.

    A sentence states the pressures at the last instant with a flow and at the first instant without one, or their times
    if the pressure is constant. Raises InputError for an unreadable table.
    """
    columns = run.read(TABLE) or run.table
    found = [(axis, said) for axis in "xy" if (said := describe_axis(columns, axis))]
    if len({said for _, said in found}) == 1:
        found = [(" and ".join(axis for axis, _ in found), found[0][1])]
    return [f"leakage along {axis} {said}" for axis, said in found]


def describe_axis(columns: Columns, axis: str) -> str:
    """Return how leakage along an axis changes, such as `stops between 1.05 and 1.10 MPa`; '' if unknown."""
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
    """Return a text with the pressures of two rows, or with their times if the pressure is constant."""
    ends = columns["pressure"][before], columns["pressure"][after]
    if ends[0] != ends[1]:
        return f"between {span(min(ends), max(ends), 'Pa')}"
    return f"between {span(columns['time'][before], columns['time'][after], 's')}, under {quantity(ends[1], 'Pa')}"

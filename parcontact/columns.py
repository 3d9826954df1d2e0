"""Columns of all tables that are written (name, SI unit, meaning, value in a row), and their files.

The spellings of columns in users' tables of moduli, shift factors, spectra and heights are also here.

Tables are the csv files, the rows of a run in Python, and the maps in `fields.h5`. The lists of columns on the manual's
page `outputs` are generated from here. A column with `when` exists only if the job has that section or option.
Capabilities add columns of their own (`capabilities`).
"""

import csv
import io
import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from operator import attrgetter, methodcaller
from typing import Any, NamedTuple

from .capabilities import COUNTED, Column, Table, stated

WITH_UNIT = re.compile(r"(.+?)[\s/]*(?:\[([^\]]*)\]|\(([^()]*(?:\([^()]*\)[^()]*)*)\))")  # E'[MPa], q (1/(m))
PRIMES = {"'": "stor", "''": "loss", '"': "loss"}  # E', E'', E"
WORDS = {  # lower case; * is an unknown letter
    **dict.fromkeys(("frequency", "f_set", "freq", "freq."), "f"),
    **dict.fromkeys(("angular frequency", "ang. frequency", "w", "ω"), "omega"),
    **{"time": "t", "step time": "t", "temperature": "T", "temp": "T", "temp.": "T"},
    **{"storage modulus": "*_stor", "loss modulus": "*_loss", "relaxation modulus": "*_relax"},
    **{"complex modulus": "*_abs", "creep compliance": "*_creep", "compliance": "*_creep"},
    **{f"shear {word} modulus": f"G_{short}" for word, short in (("storage", "stor"), ("loss", "loss"))},
    **{f"shear {word} modulus": f"G_{short}" for word, short in (("relaxation", "relax"), ("complex", "abs"))},
    **{"complex shear modulus": "G_abs", "shear creep compliance": "G_creep", "tensile creep compliance": "E_creep"},
    **{"e(t)": "E_relax", "g(t)": "G_relax", "d(t)": "E_creep", "j(t)": "G_creep"},
    **dict.fromkeys(("tan delta", "tan(delta)", "tan_delta", "tan d", "tan δ", "tanδ", "loss factor"), "tan_del"),
    **dict.fromkeys(("tan(δ)", "damping factor"), "tan_del"),
    **dict.fromkeys(("delta", "δ", "phase angle", "phase", "loss angle", "phase shift angle"), "delta"),
    **dict.fromkeys(("q", "wavenumber", "wave number", "wavevector", "wave vector"), "q"),
    **dict.fromkeys(("strain", "strain amplitude", "shear strain", "dynamic strain", "gamma", "γ"), "strain"),
    **{"g": "g", "c1d": "C1D", "c2d": "C2D", "x": "x", "y": "y", "z": "z", "height": "z", "heights": "z"},
}
MODULI = {f"{letter}_{part}" for letter in "EG*" for part in ("stor", "loss", "relax", "abs", "creep")}
TEMPERATURES = {"C": 0.0, "°C": 0.0, "degC": 0.0, "deg C": 0.0, "K": -273.15}  # added to them for deg C
NUMBERS = {"tan_del", "log_aT", "log_bT"}  # columns without a unit
NAMES = MODULI | NUMBERS | {"T", "t"} | set(WORDS.values())
SHIFT = re.compile(r"(?:log(?:_?10)?|lg)[\s_(]*([ab])_?t\)?")  # log_aT, log10(a_T)


class MeasuredColumn(NamedTuple):
    """The name of a column in the table of a user, one of NAMES or another text, and its `unit`, None if the header has
    none."""

    name: str
    unit: str | None


def read_cell(cell: str) -> MeasuredColumn:
    """Return the name and the unit in a cell of a table's header."""
    text = re.sub(r'^"(.*)"$', r"\1", cell.strip())
    if name := find_name(text):  # E(t), tan(delta)
        return MeasuredColumn(name, None)
    if match := WITH_UNIT.fullmatch(text):
        return _of_temperature(find_name(match[1]) or match[1], plain_unit(match[2] or match[3] or ""))
    for at in (at for at, letter in enumerate(text) if letter == "/"):
        name, unit = find_name(text[:at]), text[at + 1 :].strip()
        if name and not find_name(unit):
            return _of_temperature(name, plain_unit(unit))
    return MeasuredColumn(text, None)


def _of_temperature(name: str, unit: str) -> MeasuredColumn:
    """Return a column; t in deg C is a temperature."""
    return MeasuredColumn("T" if name == "t" and unit.endswith(("C", "K")) else name, unit)


def plain_unit(unit: str) -> str:
    """Return a unit without brackets, with powers as ^n; a dash is no unit."""
    unit = re.sub(r"^[\[(](.*)[\])]$", r"\1", unit.strip()).strip().replace("⁻¹", "^-1").replace("℃", "°C")
    unit = unit.replace("³", "^3").replace("⁴", "^4").replace("**", "^").replace("²", "^2")
    return "" if unit in ("-", "1", "[-]") else unit


def find_name(text: str) -> str:
    """Return the name, one of NAMES, that a text of a header stands for, such as E_stor for `E'`, `Storage modulus`, or
    both; '' if there is none."""
    text = re.sub(r"\s+", " ", text.strip(" ,:")).replace("″", "''").replace("′", "'").replace("’", "'")
    if text in NAMES or (name := _symbol(text)):
        return text if text in NAMES else name
    if name := WORDS.get(text.lower(), ""):
        return name
    words = re.sub(r"[(\[]([^()\[\]]*)[)\]]$", r" \1", text).split()
    for at in range(1, len(words)):
        pair = {find_name(" ".join(words[:at])), find_name(" ".join(words[at:]))}
        exact = {name for name in pair if not name.startswith("*")}
        if "" not in pair and len(exact) < 2 and len({name[1:] for name in pair}) == 1:
            return (exact or pair).pop()
    return ""


def _symbol(text: str) -> str:
    if match := re.fullmatch(r"([EG])('{1,2}|\")", text):
        return f"{match[1]}_{PRIMES[match[2]]}"
    if match := re.fullmatch(r"\|?([EG])\*\|?", text):
        return f"{match[1]}_abs"
    match = SHIFT.fullmatch(text.lower())
    return f"log_{match[1]}T" if match else ""


PER_BRANCH = "dissipated_K"  # replaced by a column for each branch K = 0, 1, ...


def choose_columns(table: Table, branches: int = 0, when: Collection[str] = ()) -> list[Column]:
    """Return the columns of a table for a job with the sections and options `when`; `branches` is the number of
    branches of its material."""
    chosen = list[Column]()
    for column in table:
        if column.name == PER_BRANCH:
            chosen += [_of_branch(column, k) for k in range(branches)]
        elif not column.when or column.when in when:
            chosen.append(column)
    return chosen


def _of_branch(column: Column, k: int) -> Column:
    return replace(column, name=column.name.replace("K", str(k)), of=lambda row: column.value(row)[k])


def names_of(table: Table) -> tuple[str, ...]:
    """Return the names of the columns of a table."""
    return tuple(column.name for column in table)


def added_names(table: Table, section: str) -> tuple[str, ...]:
    """Return the names of the columns that a table has only for jobs with the given section."""
    return tuple(column.name for column in table if column.when == section)


def added_by(section: str) -> tuple[str, ...]:
    """Return the names of the columns that the effect of a section adds to measures.csv."""
    return added_names(MEASURES, section)


def _offered(name: str) -> list[Column]:
    """Return the columns that capabilities offer under a name."""
    return [column for table in stated(name) for column in table]


def cells(values: Iterable[Any]) -> list[str]:
    """Return the cells of a line: floats with all digits, `""` for NaN and None, other values as text."""
    return [_cell(value) for value in values]


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "" if math.isnan(value) else repr(float(value))
    return "" if value is None else str(value)


def values_of(table: Table, row: Any) -> list[Any]:
    """Return the values of a row in the columns of a table."""
    return [column.value(row) for column in table]


def to_csv(names: Sequence[str], rows: Iterable[Iterable[Any]]) -> str:
    """Return the text of a csv file: a line with the names of the columns, and a line per row."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows((names, *map(cells, rows)))
    return text.getvalue()


def describe_columns(table: Table) -> str:
    """Return a table of the columns for the manual, in Markdown."""
    rows = (f"| `{column.name}` | {column.unit or '-'} | {column.meaning} |" for column in table)
    return "\n".join(["| column | unit | is |", "|---|---|---|", *rows])


def _measured(name: str, unit: str, meaning: str) -> Column:
    return Column(name, unit, meaning, attrgetter(f"measures.{name}"))


PRESSURE, AREA = "mean over the box", COUNTED
FORCES = (
    _measured("force_x", "N", "on the rigid surface along x; negative for sliding along +x over a lossy body"),
    _measured("force_y", "N", "on the rigid surface along y"),
)
GAPS = (
    _measured(
        *("approach", "m"),
        "rigid displacement d in u = h + d in contact, measured from the undeformed surface (free) or from the mean "
        "surface of the body (periodic)",
    ),
    _measured(
        *("mean_gap", "m"),
        "mean of the gap u - h - d, which is 0 at points where a counterbody yields; without load, and before the "
        "first step, the surface just touches the body",
    ),
    _measured(
        *("max_pressure", "Pa"),
        "highest pressure; with `bands` that of the highest rung of the finest band that carries load ({doc}`bands`): "
        "it jumps where another rung does",
    ),
)
CERTIFIED = (
    Column(
        *("residual", ""),
        "largest relative error of the contact conditions: load, gap where pressure acts, penetration "
        "({doc}`method`); at most `numerics.tolerance` if that is given",
        attrgetter("certificate.worst"),
    ),
    Column(
        *("penetration", ""),
        "deepest penetration, relative to the same length as `residual`",
        attrgetter("certificate.penetration"),
    ),
)
CORRECTED = _measured(
    *("contact_area_corrected", ""),
    "`contact_area` without the excess of cells at the edges of contact; at least pressure over hardness if a "
    "hardness is given",
)
ERROR_FRICTION = Column(
    *("error_friction", ""),
    "estimated relative error of friction ({doc}`accuracy`); 1 or more where friction cannot be distinguished from 0, "
    "empty where it is 0, and where spots of contact may be smaller than a cell",
)
ERROR_AREA = Column(
    *("error_area", ""),
    "estimated relative error of the corrected contact area; empty where spots of contact may be smaller than a cell",
)

MEASURES: Table = (
    Column("step", "", "number of the step, 0 for the initial state"),
    Column("time", "s", "since the start of the history"),
    Column("distance", "m", "slid since the start, along the path"),
    _measured("pressure", "Pa", PRESSURE),
    *FORCES,
    _measured(
        *("friction", ""), "tangential force over normal force; 0 if the load is zero or tensile (see `force_x`)"
    ),
    _measured("contact_area", "", AREA),
    *GAPS,
    Column("iterations", "", "of the contact solver"),
    *CERTIFIED,
    Column("operator_calls", "", "applications of the half-space operator or its inverse in the step"),
    Column(
        *("work", "J"),
        "done on the body since the start (`output.energy`); without friction of an `interface` that does not stick",
    ),
    Column("stored", "J", "elastic energy in the body"),
    Column("dissipated", "J", "turned to heat since the start"),
    Column("seconds", "s", "wall time of the step", lambda row: round(row.seconds, 6)),
    Column(
        PER_BRANCH,
        "J",
        "by branch K of the material (`output.branch_dissipation`), or of both bodies as one (`counterbody`)",
        attrgetter("branch_dissipation"),
    ),
    _measured("friction_x", "", "tangential over normal force along x; positive where it opposes motion along +x"),
    CORRECTED,
    ERROR_FRICTION,
    ERROR_AREA,
    Column(
        *("error_gap", ""),
        "estimated relative error of `mean_gap`: the error of the area, relative to the open share, and in a free box "
        "the rise of the gap over half a cell; empty in full contact, and where `error_area` is",
    ),
    Column(
        *("error_energy", "J"),
        "estimated error of `work`, `dissipated` and `slip_loss` (`output.energy`): of what each step dissipates, "
        "summed, and of what is stored; with `adhesion` also by how much the work of the load along its path "
        "and the energies differ. Empty from the first step on whose error is not known",
    ),
    Column(
        *("cut_off", ""),
        "1 where the contact reaches the edge of a free box and is cut off there, so that the row is wrong, else 0",
        lambda row: int(row.measures.at_edge),
    ),
    *_offered("MEASURES"),
)
UNITS = {column.name: column.unit for column in MEASURES if column.unit}

FIELDS: Table = (
    Column("pressure", "Pa", "contact pressure"),
    Column("displacement", "m", "of the surface of the body, along z"),
    Column("gap", "m", "between body and rigid surface, 0 in contact"),
    Column("height", "m", "of the rigid surface in its position at that instant"),
    *_offered("FIELDS"),
    Column("t", "s", "times of the maps"),
    Column("y", "m", "positions of the points along y"),
    Column("x", "m", "positions of the points along x"),
    Column("step", "", "steps of the maps"),
)

STEADY: Table = (  # rows are `march.steady.Point`
    Column("velocity", "m/s", "speed", attrgetter("speed")),
    _measured("pressure", "Pa", PRESSURE),
    *FORCES,
    Column("friction", "", "dissipated power over velocity and load ({doc}`accuracy`), plus `friction_interface`"),
    _measured("contact_area", "", AREA),
    *GAPS,
    *CERTIFIED,
    Column(
        *("operator_calls", ""),
        "applications of the operator; on coarser grids they count by their share of points",
        lambda point: round(float(point.operator_calls), 2),
    ),
    Column("seconds", "s", "wall time", lambda point: round(point.seconds, 3)),
    Column(
        PER_BRANCH,
        "W",
        "power that branch K dissipates, of both bodies as one with `counterbody`",
        attrgetter("dissipated"),
    ),
    Column(
        *("friction_x", ""), "signed friction along x", lambda point: point.friction * (point.velocity[0] / point.speed)
    ),
    CORRECTED,
    Column("temperature", "°C", "of the point (with `temperatures`)", when="temperatures"),
    Column(
        *("shift_factor", ""), "relaxation times over those at the reference (with `temperatures`)", when="temperatures"
    ),
    *_offered("STEADY"),
    ERROR_FRICTION,
    ERROR_AREA,
    Column(
        *("friction_slopes", ""),
        "tangential force over normal force, from the slopes of the rigid surface. As in `measures.csv` it includes "
        "the force across the sliding direction, which does no work and is not in `friction`. For sliding along x, "
        "`friction_slopes` times `abs(force_x)/hypot(force_x, force_y)` differs from `friction` by errors of the mesh "
        "only. This factor was 0.97 to 1 for five rough surfaces (`tests/scenarios/test_two_views.py`); for a wave in "
        "full contact it is the cosine of the angle between wave vector and sliding direction",
        attrgetter("measures.friction"),
    ),
)
STEADY_WAVES: Table = (
    Column("velocity", "m/s", "speed"),
    Column("pressure", "Pa", PRESSURE),
    Column("wavelength", "m", "of a band of waves"),
    Column("share", "", "of friction that comes from the band"),
)
_OF_BANDS: Table = (
    Column("velocity", "m/s", "speed"),
    Column("pressure", "Pa", "nominal mean pressure"),
    Column("temperature", "°C", "of the rubber; empty if the curve has no temperatures"),
    Column("band", "", "number of the band, 0 for the coarsest"),
    Column("long_wavelength", "m", "longest wave of the band"),
    Column("short_wavelength", "m", "shortest wave of the band"),
    Column("friction", "", "of the waves of the band; the finest band includes the friction of an `interface`"),
    Column(
        *("contact_area", ""),
        "share in which this and all coarser bands touch the finer waves, which act as a soft layer; larger than "
        "the contact area of a surface without the finer waves",
    ),
    Column("rms_slope", "", "of the waves of the band"),
    Column("load_lost", "", "share of the load at pressures above the highest one solved for the band"),
    Column("rms_slope_to", "", "of this and all coarser bands"),
    Column("strain_to", "", "rms strain of these waves in full contact, at the depth where it is largest"),
)
BANDS: Table = (*_OF_BANDS, *_offered("BANDS"))

CYCLES: Table = (
    Column("stage", "", "number of the stage, from 0"),
    Column("cycle", "", "number of the cycle in its stage, from 1"),
    Column("frequency", "Hz", "of the load or of the velocity"),
    Column(
        "loss",
        "J",
        "area of the loop of force over displacement without the mean force; in a cycle that repeats "
        "the last one, the energy dissipated. From `work` if nothing moves along the surface (`output.energy`)",
    ),
    Column("error_loss", "", "estimated relative error of the loss"),
    Column("friction_amplitude", "", "half the range of friction along the velocity; empty if nothing slides"),
    Column("approach_amplitude", "m", "half the range of the approach"),
    Column(
        "phase",
        "rad",
        "by which the displacement lags behind the force, of their first harmonics; empty if one is constant",
    ),
)

BANDS_OVER_TIME: Table = (
    Column("time", "s", "since the start of the history"),
    Column("distance", "m", "slid since the start"),
    *_OF_BANDS[1:],
)

THEORY: Table = (
    Column("time", "s", "instant of the job"),
    Column("distance", "m", "slid"),
    Column("pressure", "Pa", PRESSURE),
    Column("friction", "", "by Persson's theory"),
    Column("contact_area", "", "by Persson's theory"),
)
STEADY_THEORY: Table = (
    Column("velocity", "m/s", "speed"),
    Column("pressure", "Pa", PRESSURE),
    Column("temperature", "°C", "of the point; empty: the temperature of the job"),
    Column("shift_factor", "", "relaxation times over those at the reference"),
    Column("friction", "", "by Persson's theory"),
    Column("contact_area", "", "by Persson's theory"),
)


SWEEP_RESULTS: Table = (
    Column("mu_max", "", "highest friction of the slide (the last part of the history at one velocity and load)"),
    Column("mu_max_distance", "m", "distance from the start of the slide to `mu_max`"),
    Column("mu_dyn", "", "mean friction over the last three quarters of the slide"),
    Column("contact_area", "", "mean over the same part; without a slide, its last value"),
    Column("contact_area_corrected", "", "the same for the column `contact_area_corrected`"),
)
SWEEP: Table = tuple(
    replace(column, of=methodcaller("get", column.name))  # rows are mappings; missing values are empty
    for column in (
        Column("case", "", "its number, from 0"),
        Column("state", "", "done, begun, failed, damaged (its table lacks rows), or -"),
        *SWEEP_RESULTS,
        Column("mu_max_error", "", "estimated error of `mu_max`, in the same unit"),
        Column("mu_dyn_error", "", "estimated error of `mu_dyn`, in the same unit"),
        Column("residual", "", "largest `residual` of the case"),
        Column(
            *("error_friction", ""),
            "relative error, mean over the distance slid, as printed at the end of the run; empty without a slide",
        ),
        Column("error_area", "", "the same for the corrected contact area; without a slide, its last value"),
        Column("seconds", "s", "wall time of all steps"),
        *(
            Column(f"theory_{one.name}", one.unit, "the same from theory.csv")
            for one in SWEEP_RESULTS
            if one.name != "contact_area_corrected"
        ),
        Column("loss", "J", "with `cycles`: loss of the last cycle", when="cycles"),
        Column("error_loss", "", "its estimated relative error", when="cycles"),
        Column("phase", "rad", "with `cycles`: phase of the last cycle", when="cycles"),
        *_offered("RESULTS"),
        Column("dissipated", "J", "with `output.energy`: dissipated energy in the end", when="output.energy"),
        *_offered("LAST"),
    )
)

STUDY: Table = (
    Column("case", "", "its number, from 0"),
    Column("mesh", "", "points along x"),
    Column(
        *("cells_per_step", ""),
        "cells slid in a step; `auto` if the stages choose their steps and the study varies none",
    ),
    Column("integrator", "", "integrator"),
    *(one for one in SWEEP_RESULTS if one.name in ("mu_max", "mu_dyn")),
    Column(
        *("contact_area", ""),
        "mean over the same part; without a slide, mean over time, or over loads if they take no time",
    ),
    SWEEP_RESULTS[-1],
    Column("seconds", "s", "wall time of all steps"),
    Column(*("error_mu_max", ""), "relative to the extrapolated limit; empty where nothing slides, as `error_mu_dyn`"),
    Column("error_mu_dyn", "", "relative to the extrapolated limit"),
    Column("error_contact_area", "", "relative to the extrapolated limit"),
    Column("error_contact_area_corrected", "", "relative to the extrapolated limit"),
)

BANDS_THEORY: Table = (*BANDS[:6], *THEORY[-2:])

TABLES: Mapping[str, Table] = {
    "measures.csv": MEASURES,
    "fields.h5": FIELDS,
    "steady.csv": STEADY,
    "steady_waves.csv": STEADY_WAVES,
    "bands.csv": BANDS,
    "cycles.csv": CYCLES,
    "theory.csv": THEORY,
    "steady_theory.csv": STEADY_THEORY,
    "bands_theory.csv": BANDS_THEORY,
    "sweep.csv": SWEEP,
    "study.csv": STUDY,
    **{name: table for tables in stated("TABLES") for name, table in tables.items()},
}

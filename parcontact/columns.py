"""The columns of all tables: their names, SI units, meanings, and numbers in a row; and how tables are written.

The tables are the csv files of the page `outputs`, whose lists of columns are written from here, the rows of a run in
Python, and the maps in `fields.h5`. A column with `when` is there only where a job has that section or asks for it.
"""

import csv
import io
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

PER_BRANCH = "dissipated_K"  # stands for a column of each branch


@dataclass(frozen=True)
class Column:
    """A column of a table: its name, SI unit (`""` of a ratio or a number), and meaning in the words of the manual.

    `of` reads its number from a row, by default from the attribute of its name; `when` names what a job needs for it.
    """

    name: str
    unit: str
    meaning: str
    of: Callable[[Any], Any] | None = None
    when: str = ""

    def value(self, row: Any) -> Any:
        """Return the number that a row has in this column."""
        return (self.of or attrgetter(self.name))(row)


Table = Sequence[Column]


def choose_columns(table: Table, branches: int = 0, when: Collection[str] = ()) -> list[Column]:
    """Return the columns of a table for a body of so many branches and a job that has what `when` names."""
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
    """Return the names of the columns that a table has only in jobs with this section."""
    return tuple(column.name for column in table if column.when == section)


def added_by(section: str) -> tuple[str, ...]:
    """Return the names of the columns that an effect of this section adds to measures.csv."""
    return added_names(MEASURES, section)


def cells(values: Iterable[Any]) -> list[str]:
    """Return the cells of a line: numbers with all their digits, `""` for NaN and None, words as they are."""
    return [_cell(value) for value in values]


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "" if math.isnan(value) else repr(float(value))
    return "" if value is None else str(value)


def values_of(table: Table, row: Any) -> list[Any]:
    """Return the numbers that a row has in the columns of a table."""
    return [column.value(row) for column in table]


def to_csv(names: Sequence[str], rows: Iterable[Iterable[Any]]) -> str:
    """Return the text of a csv file: the names of its columns, and a line for each row."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows((names, *map(cells, rows)))
    return text.getvalue()


def describe_columns(table: Table) -> str:
    """Return a table of the columns for the manual, in Markdown."""
    rows = (f"| `{column.name}` | {column.unit or '-'} | {column.meaning} |" for column in table)
    return "\n".join(["| column | unit | is |", "|---|---|---|", *rows])


def _worst(point: Any, name: str) -> float:
    return getattr(point.flash, name) if point.flash else math.nan


def _measured(name: str, unit: str, meaning: str) -> Column:
    return Column(name, unit, meaning, attrgetter(f"measures.{name}"))


PRESSURE, AREA = "mean over the box", "points in contact as a share of all"
FORCES = (
    _measured("force_x", "N", "on the rigid surface along x; negative for sliding along +x over a lossy body"),
    _measured("force_y", "N", "on the rigid surface along y"),
)
GAPS = (
    _measured(
        *("approach", "m"),
        "rigid displacement d in u = h + d at contact: below the undeformed surface (free), or over the mean surface "
        "of the body (periodic)",
    ),
    _measured(
        *("mean_gap", "m"),
        "mean of the gap u - h - d, 0 where a counterbody yields; at no load the surface just touches the body, also "
        "before the first step",
    ),
    _measured("max_pressure", "Pa", "highest pressure"),
)
CERTIFIED = (
    Column(
        *("residual", ""),
        "how well the solve meets the contact conditions: the largest of the errors of load, gap under pressure and "
        "penetration ({doc}`method`); at most `numerics.tolerance` if that is given",
        attrgetter("certificate.worst"),
    ),
    Column(
        *("penetration", ""),
        "deepest penetration over the length of the contact that `residual` is relative to",
        attrgetter("certificate.penetration"),
    ),
)
CORRECTED = _measured(
    *("contact_area_corrected", ""),
    "`contact_area` without the excess by cells on the edge of contact; at least the pressure over a hardness",
)
FLASH = (
    Column(
        *("flash_temperature", "K"),
        "mean rise of the temperature of the contact, weighted by heat, at rest by pressure (with `thermal`, "
        "{doc}`heat`)",
        lambda point: _worst(point, "mean"),
        "thermal",
    ),
    Column(
        *("max_temperature", "K"),
        "highest rise on the surface of the body (with `thermal`)",
        lambda point: _worst(point, "highest"),
        "thermal",
    ),
    Column(
        *("error_flash", ""),
        "estimated relative error of `flash_temperature`: three times that of friction, which makes the heat (with "
        "`thermal`); empty where it is 0",
        lambda point: point.error_flash,
        "thermal",
    ),
)
ERROR_FRICTION = Column(
    *("error_friction", ""),
    "estimated relative error of friction ({doc}`accuracy`); 1 or more where friction cannot be told from 0, empty "
    "where it is 0",
)
ERROR_AREA = Column("error_area", "", "estimated relative error of the corrected contact area")

MEASURES: Table = (
    Column("step", "", "number of the step, 0 for the initial state"),
    Column("time", "s", "since the start of the history"),
    Column("distance", "m", "slid since the start, along the path"),
    _measured("pressure", "Pa", PRESSURE),
    *FORCES,
    _measured(
        *("friction", ""),
        "tangential force over normal force; 0 where no load presses (none, or tension): see `force_x` then",
    ),
    _measured("contact_area", "", AREA),
    *GAPS,
    Column("iterations", "", "of the contact solver"),
    *CERTIFIED,
    Column("operator_calls", "", "applications of the half-space operator or its inverse in the step"),
    Column("work", "J", "done on the body since the start (`output.energy`)"),
    Column("stored", "J", "elastic energy in the body"),
    Column("dissipated", "J", "turned to heat since the start"),
    Column("seconds", "s", "wall time of the step", lambda row: round(row.seconds, 6)),
    Column(
        PER_BRANCH, "J", "by branch K of the material (`output.branch_dissipation`)", attrgetter("branch_dissipation")
    ),
    _measured("friction_x", "", "tangential over normal force along x; positive where it opposes motion along +x"),
    CORRECTED,
    ERROR_FRICTION,
    ERROR_AREA,
    Column(
        *("friction_viscous", ""),
        "`friction` less `friction_interface` (with `interface`): the force of the body in the direction of the whole "
        "force, over the load",
        when="interface",
    ),
    Column(
        *("friction_interface", ""),
        "the same of the shear of the corrected contact area; negative where that is against the whole force, as a "
        "weak one may be after a reversal",
        when="interface",
    ),
    Column(
        *("stick_area", ""),
        "share of the box that touches and does not slip (with `interface.stick`)",
        when="interface.stick",
    ),
    Column(
        *("slip_loss", "J"),
        "energy lost in slip since the start (with `interface.stick` and `output.energy`); "
        "`work` is `stored`, `dissipated` and this",
        when="interface.stick",
    ),
    Column(
        *("tensile_area", ""),
        "share of all points that are pulled by more than 1 % of the largest attraction (with `adhesion`)",
        when="adhesion",
    ),
    Column("adhesive_force", "N", "sum of all tension (with `adhesion`)", when="adhesion"),
    Column(
        *("surface_energy", "J"),
        "energy of the surfaces, 0 far apart and negative where they stick (with `adhesion` and `output.energy`)",
        when="adhesion",
    ),
    Column(
        *("snap_loss", "J"),
        "energy lost in snaps since the start (with `adhesion` and `output.energy`)",
        when="adhesion",
    ),
    Column(
        *("error_energy", "J"),
        "estimated error of `work` and `dissipated`: by how much the work of the load along its path and the energies "
        "differ, summed over steps without snaps, and 0.4 of the error of the area in what each step dissipates (with "
        "`adhesion` and `output.energy`)",
        when="adhesion",
    ),
    Column("flow_x", "m³", "conductivity of the gap along x (with `leakage`, {doc}`seals`)", when="leakage"),
    Column("flow_y", "m³", "conductivity of the gap along y (with `leakage`)", when="leakage"),
    Column(
        *("constriction", "m"),
        "smallest gap on the widest path, of the direction that leaks more (with `leakage`)",
        when="leakage",
    ),
    *FLASH,
)
UNITS = {column.name: column.unit for column in MEASURES if column.unit}

FIELDS: Table = (
    Column("pressure", "Pa", "contact pressure"),
    Column("displacement", "m", "of the surface of the body, along z"),
    Column("gap", "m", "between body and rigid surface, 0 in contact"),
    Column("height", "m", "the rigid surface where it is at that instant"),
    Column("temperature", "K", "rise of the temperature of the body's surface (with `thermal`, {doc}`heat`)"),
    Column("traction_x", "Pa", "traction on the body along x (with `interface.stick`)"),
    Column("traction_y", "Pa", "traction on the body along y"),
    Column("t", "s", "times of the maps"),
    Column("y", "m", "positions of the points along y"),
    Column("x", "m", "positions of the points along x"),
    Column("step", "", "steps of the maps"),
)

STEADY: Table = (  # of `steady_sliding.point.Point`
    Column("velocity", "m/s", "speed", attrgetter("speed")),
    _measured("pressure", "Pa", PRESSURE),
    *FORCES,
    Column("friction", "", "dissipated power over velocity and load ({doc}`accuracy`), and what an interface adds"),
    _measured("contact_area", "", AREA),
    *GAPS,
    *CERTIFIED,
    Column(
        *("operator_calls", ""),
        "applications of the operator, those on coarser grids by their share",
        lambda point: round(float(point.operator_calls), 2),
    ),
    Column("seconds", "s", "wall time", lambda point: round(point.seconds, 3)),
    Column(PER_BRANCH, "W", "power that branch K dissipates", attrgetter("dissipated")),
    Column(
        *("friction_x", ""), "signed friction along x", lambda point: point.friction * (point.velocity[0] / point.speed)
    ),
    CORRECTED,
    Column("temperature", "°C", "of the point (with `temperatures`)", when="temperatures"),
    Column(
        *("shift_factor", ""), "relaxation times over those at the reference (with `temperatures`)", when="temperatures"
    ),
    Column(
        *("friction_viscous", ""),
        "part of friction from the body (with `interface`)",
        lambda point: point.friction - point.measures.friction_interface,
        "interface",
    ),
    Column(
        *("friction_interface", ""),
        "part of friction from the corrected contact area itself (with `interface`)",
        attrgetter("measures.friction_interface"),
        "interface",
    ),
    *FLASH,
    Column(
        *("lower_temperature", "K"),
        "a quarter of the heat goes where the rise is smaller (with `thermal`)",
        lambda point: _worst(point, "lower"),
        "thermal",
    ),
    Column(
        *("upper_temperature", "K"),
        "a quarter of the heat goes where the rise is larger (with `thermal`)",
        lambda point: _worst(point, "upper"),
        "thermal",
    ),
    Column("friction_cold", "", "friction without feedback (with `feedback` of `thermal`)", when="feedback"),
    Column(
        *("flash_shift", ""),
        "relaxation times at the flash temperature over those at the reference (with `feedback`)",
        attrgetter("shift_factor"),
        "feedback",
    ),
    Column("rounds", "", "steady states solved until the temperature settled (with `feedback`)", when="feedback"),
    ERROR_FRICTION,
    replace(ERROR_AREA, of=attrgetter("errors.area.total")),
    Column(
        *("friction_slopes", ""),
        "tangential force over normal force, from the slopes of the rigid surface. The force across the sliding counts "
        "here, as in `friction` of `measures.csv`; it does no work, so `friction` has none of it. Times "
        "`abs(force_x)/hypot(force_x, force_y)` (of a slide along x) it differs from `friction` by errors of the mesh. "
        "The factor was 0.97 to 1 with five rough surfaces (`tests/scenarios/test_two_views.py`). For waves in full "
        "contact it is the cosine of their angle with the sliding",
        attrgetter("measures.friction"),
    ),
)
STEADY_WAVES: Table = (
    Column("velocity", "m/s", "speed"),
    Column("pressure", "Pa", PRESSURE),
    Column("wavelength", "m", "of a band of waves"),
    Column("share", "", "of friction that comes from it"),
)
BANDS: Table = (
    Column("velocity", "m/s", "speed"),
    Column("pressure", "Pa", "mean of the whole"),
    Column("temperature", "°C", "of the rubber; empty where the curve asks for none"),
    Column("band", "", "number of the band, 0 for the coarsest"),
    Column("long_wavelength", "m", "longest wave of the band"),
    Column("short_wavelength", "m", "shortest wave of the band"),
    Column("friction", "", "of the waves of the band; that of an `interface` is in the finest"),
    Column("contact_area", "", "share in contact as this band and all coarser ones show it"),
    Column("rms_slope", "", "of the waves of the band"),
    Column("flash_temperature", "K", "rise that the band feels; empty without `thermal`"),
    Column("load_lost", "", "share of the load that is above the ladder of the band"),
    Column("rms_slope_to", "", "of this band and all coarser ones"),
    Column("strain_to", "", "rms strain of these waves in full contact, at the depth where it is largest"),
)

THEORY: Table = (
    Column("time", "s", "instant of the job"),
    Column("distance", "m", "slid"),
    Column("pressure", "Pa", PRESSURE),
    Column("friction", "", "after Persson's theory"),
    Column("contact_area", "", "after Persson's theory"),
)
STEADY_THEORY: Table = (
    Column("velocity", "m/s", "speed"),
    Column("pressure", "Pa", PRESSURE),
    Column("temperature", "°C", "of the point, empty for that of the job"),
    Column("shift_factor", "", "relaxation times over those at the reference"),
    Column("friction", "", "after Persson's theory"),
    Column("contact_area", "", "after Persson's theory"),
)

LEAK: Table = (
    Column("time", "s", "of the instant"),
    Column("pressure", "Pa", "mean pressure"),
    Column("contact_area", "", AREA),
    Column("flow_x", "m³", "conductivity K of the gap along x ({doc}`seals`)"),
    Column("flow_y", "m³", "conductivity K of the gap along y"),
    Column("percolates_x", "", "1 where a path leads from end to end along x, else 0"),
    Column("percolates_y", "", "the same along y"),
    Column("constriction", "m", "smallest gap on the widest path, of the direction that leaks more"),
    Column(
        *("share_x", ""),
        "K along x over that of the undeformed surface that just touches; empty where its file of heights is gone",
    ),
    Column("share_y", "", "the same along y"),
    Column("constriction_x", "m", "smallest gap on the widest path along x, 0 where contact closes"),
    Column("constriction_y", "m", "the same along y"),
    Column(
        *("error_x", ""),
        "by what share K along x differs if only every second point of the gap counts; empty where contact closes",
    ),
    Column("error_y", "", "the same along y"),
    Column(
        *("flow_rate", "m³/s", "flow of the fluid of `--fluid` at the low side, in the direction that leaks more"),
        when="--fluid",
    ),
    Column(*("mass_flow", "kg/s", "the same flow as a mass, empty where no density is known"), when="--fluid"),
)


def _from_theory(name: str, unit: str) -> Column:
    return Column(f"theory_{name}", unit, "the same from theory.csv")


def _in_row(column: Column) -> Column:
    """Return the column as rows that are mappings have it; what they do not have is empty."""
    return replace(column, of=lambda row: row.get(column.name))


SWEEP_RESULTS: Table = (
    Column("mu_max", "", "highest friction of the slide, the last stretch at one velocity"),
    Column("mu_max_distance", "m", "from the start of the slide to it"),
    Column("mu_dyn", "", "mean friction over the last three quarters of the slide"),
    Column("contact_area", "", "mean over the same; without a slide that of the last row"),
    Column("contact_area_corrected", "", "the same of that column"),
)
SWEEP: Table = tuple(
    _in_row(column)
    for column in (
        Column("case", "", "its number, from 0"),
        Column("state", "", "done, begun, failed, damaged (its table lacks rows), or -"),
        *SWEEP_RESULTS,
        Column("mu_max_error", "", "estimated error of `mu_max`, in the same unit"),
        Column("mu_dyn_error", "", "estimated error of `mu_dyn`, in the same unit"),
        Column("residual", "", "the worst of the case"),
        Column(
            *("error_friction", ""),
            "relative, the mean over the distance slid as the end of the run tells it; empty without a slide",
        ),
        Column("error_area", "", "the same of the corrected contact area; without a slide that of the last row"),
        Column("seconds", "s", "wall time of all steps"),
        *(_from_theory(one.name, one.unit) for one in SWEEP_RESULTS if one.name != "contact_area_corrected"),
        Column(
            *("pull_off", "N"),
            "with adhesion: force of the last pull-off, empty where contact holds ({doc}`adhesion`)",
            when="adhesion",
        ),
        Column(*("pull_off_error", "N"), "error of it by steps, solves and mesh", when="adhesion"),
        Column("pull_off_approach", "m", "approach at it", when="adhesion"),
        Column("dissipated", "J", "with `output.energy`: dissipated energy in the end", when="output.energy"),
        Column("flow_x", "m³", "with `leakage`: K along x, the last one that was calculated", when="leakage"),
        Column("flow_y", "m³", "the same along y", when="leakage"),
        Column("constriction", "m", "the critical constriction at the same step", when="leakage"),
    )
)

STUDY: Table = (
    Column("fingerprint", "", "of the job of the case"),
    Column("mesh", "", "points along x"),
    Column(
        *("cells_per_step", ""),
        "cells slid in a step; `auto` where the stages of the slide choose their steps and there is no ladder",
    ),
    Column("integrator", "", "integrator"),
    Column("mu_max", "", "highest friction"),
    Column(
        *("mu_end", ""),
        "friction in the end: the mean over the last quarter of the last stage that slides. (`mu_dyn` of runs is the "
        "mean over three quarters of the slide.)",
    ),
    Column("area", "", "mean contact area over the same"),
    Column("area_corrected", "", "mean corrected area over the same"),
    Column("steps", "", "steps made"),
    Column("operator_calls", "", "applications of the operator"),
    Column("transform_work", "", "transforms times N log2 N of their N points"),
    Column("cpu_seconds", "s", "of all ranks"),
    Column(
        *("error_mu_max", ""), "relative, over the extrapolated limit; empty where nothing slides, as `error_mu_end`"
    ),
    Column("error_mu_end", "", "relative, over the extrapolated limit"),
    Column("error_area", "", "relative, over the extrapolated limit"),
    Column("error_area_corrected", "", "relative, over the extrapolated limit"),
)

BANDS_THEORY: Table = (*BANDS[:6], *THEORY[-2:])

TABLES: Mapping[str, Table] = {
    "measures.csv": MEASURES,
    "fields.h5": FIELDS,
    "steady.csv": STEADY,
    "steady_waves.csv": STEADY_WAVES,
    "bands.csv": BANDS,
    "leak.csv": LEAK,
    "theory.csv": THEORY,
    "steady_theory.csv": STEADY_THEORY,
    "bands_theory.csv": BANDS_THEORY,
    "sweep.csv": SWEEP,
    "study.csv": STUDY,
}

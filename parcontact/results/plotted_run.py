"""The results of a run for pictures and reports: its rows, stages, saved maps and panels.

Panels show measures of the run against time, distance, velocity, load or approach.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from .. import printed
from ..columns import UNITS
from ..errors import InputError
from ..files import outputs
from ..files.fields import SavedMaps
from ..files.hdf5 import MEND
from ..job import Job
from ..job.history import Timeline
from ..job.listing import answers
from ..job.reading import shown_job
from ..parallel.slab import Array
from . import style
from .panels import Axis, ColumnPanel, Line, Panel, Shade, offered
from .results import Results
from .slide import balanced, friction_along, lacks_load, way_along

FRACTION = "contact area /\nnominal area"
MEASURED = (
    *("step", "time", "distance", "pressure", "friction", "friction_x", "contact_area", "contact_area_corrected"),
    *("approach", "mean_gap", "max_pressure", "work", "stored", "dissipated"),
)
DIGITS = 6  # significant digits of values that count as equal
NEAREST = 3  # number of nearest steps with maps in a message


class PlottedRun(Results):
    """The job and the rows of a run for pictures, without the unloaded rows at the beginning."""

    def __init__(self, directory: Path) -> None:
        super().__init__(directory, "run")
        self.area = self.job.grid.lx * self.job.grid.ly  # of the box [m^2]
        self.free = self.job.grid.boundary == "free"
        self._all = self.table.arrays(MEASURED)
        if not self._all["step"].size:
            raise InputError(f"{directory} has no step yet")
        first = int(self._all["pressure"][0] == 0.0 and self._all["step"].size > 1)
        self._all["pressure"] = balanced(self._all["pressure"], self._all["max_pressure"])
        self.columns = {name: values[first:] for name, values in self._all.items()}
        self.lasts, self.slides = self._all["time"][-1] > 0.0, self._all["distance"][-1] > 0.0

    @cached_property
    def job(self) -> Job:
        """Job of the run."""
        return shown_job(self.path / outputs.RUN.resolved)

    @property
    def load(self) -> tuple[Axis, Array]:
        return to_load(self.columns["pressure"], self.area * self.free)

    @property
    def backwards(self) -> bool:
        """Return True if the surface moves along x only and reverses; the magnitude of friction would then have a
        cusp."""
        velocities = [stage.velocity for stage in self.job.history]
        turns = any(stage.speed and not stage.slides for stage in self.job.history)
        return (turns or any(x < 0.0 for x, _ in velocities)) and not any(y for _, y in velocities)

    @property
    def curves(self) -> bool:
        """Return True if time passes or the load changes, so that curves can be drawn."""
        return bool(self.lasts) or len(set(self.columns["pressure"])) > 1

    @cached_property
    def timeline(self) -> Timeline:
        """Return the timeline of the run, which states the stage of each step."""
        steps, times = self._all["step"].astype(int).tolist(), self._all["time"].tolist()
        return Timeline.from_job(self.job, times[-1]).follow(dict(zip(steps, times, strict=True)))

    @property
    def telling_step(self) -> int:
        """Return the step of the row that shows the contact best (`Results.telling_row`)."""
        return int(self._all["step"][self.telling_row])

    @property
    def rows_of_stages(self) -> dict[int, list[int]]:
        """Return the row numbers of each stage, by its index; the initial state belongs to the first stage."""
        found: dict[int, list[int]] = {}
        for row, step in enumerate(self.columns["step"].astype(int).tolist()):
            if (stage := self._stage(step)) >= 0:
                found.setdefault(stage, []).append(row)
        return found

    def _stage(self, step: int) -> int:
        """Return the stage of a step, -1 if the job does not have this step."""
        step = max(step, 1)
        return self.timeline.span(step).index if step <= len(self.timeline) else -1

    def instant(self, step: int, time: float) -> str:
        """Return time and load of a saved map as text: `2.1 ms, 100 kPa`, `150 mN`, `2.1 ms, approach 20 µm`."""
        when = printed.quantity(time, "s", 4) if self.lasts else ""
        return ", ".join(filter(None, (when, self.pressed(step))))

    def pressed(self, step: int) -> str:
        """Return the load after a step as text, in the quantity that its stage prescribes; '' without a row."""
        rows, stage = np.flatnonzero(self._all["step"] == step), self._stage(step)
        if not rows.size:
            return ""
        if stage >= 0 and self.job.history[stage].control == "approach":
            return f"approach {printed.quantity(self._all['approach'][rows[-1]], 'm')}"
        axis, loads = to_load(self._all["pressure"], self.area * self.free)
        return printed.quantity(loads[rows[-1]], axis.unit)

    def name_stage(self, step: int) -> str:
        """Return the name of the stage of a step; '' if it has none."""
        stage = self._stage(step)
        name = self.job.history[stage].name if stage >= 0 else ""
        return "" if name == f"stage {stage + 1}" else name

    def moved(self, step: int) -> tuple[float, float]:
        """Return the position of the surface after a step [m]. It is (0, 0) for step 0, and for a map of a step that is
        no longer in the stored job."""
        return self.timeline[step].position if 1 <= step <= len(self.timeline) else (0.0, 0.0)


class Fields(SavedMaps):
    """The saved maps of a run. `shown` are the indices of the instants that pictures over several instants may show.
    `chosen` is the index of the one instant whose maps are drawn, by default the last.

    The text `at` restricts both to one instant. It is a step (a whole number), whose maps must be saved, or a time [s],
    for which the nearest maps are taken. With `until`, `chosen` is the last instant up to this step.
    """

    def __init__(self, file: h5py.File, at: str = "", until: int | None = None) -> None:
        try:
            super().__init__(file)
        except ValueError as error:
            raise InputError(f"{file.filename} is damaged: {error}; {MEND}") from error
        self.file, self.x, self.y = file, file["x"][...], file["y"][...]
        self.shown = [self._index(at)] if at else self.saved
        before = [k for k in self.shown if until is None or self.steps[k] <= until]
        self.chosen = (before or self.shown or [-1])[-1]

    def when(self, index: int) -> tuple[int, float]:
        """Return step and time [s] of a saved instant."""
        return self.steps[index], float(self.times[index])

    def read(self, name: str) -> Array | None:
        """Return the named map at the chosen instant, or None."""
        field = self.file[name][self.chosen] if name in self.file and self.shown else None
        return field if field is not None and np.isfinite(field).all() else None

    def _index(self, at: str) -> int:
        """Return the index of the instant `at`; raises InputError if no map is saved then."""
        if not self.saved:
            raise InputError(f"--at {at}: no map is saved yet")
        steps, times = np.array(self.steps)[self.saved], self.times[self.saved]
        if not at.isdecimal() and not times[0] <= float(at) <= times[-1]:
            raise InputError(f"--at {at}: maps are saved from {times[0]:g} to {times[-1]:g} s")
        order = np.argsort(np.abs(steps - int(at) if at.isdecimal() else times - float(at)), kind="stable")
        if at.isdecimal() and int(at) not in steps:
            near = ", ".join(map(str, sorted(steps[order[:NEAREST]])))
            raise InputError(f"--at {at}: no map is saved after step {at}; the nearest steps with maps are {near}")
        return int(self.saved[order[0]])


def choose_evenly(labels: dict[int, str], most: int) -> dict[int, str]:
    """Return at most `most` of the labelled instants, evenly spaced, including the first and the last."""
    indices = list(labels)
    kept = np.linspace(0, len(indices) - 1, min(len(indices), most)).astype(int)
    return {indices[k]: labels[indices[k]] for k in kept}


def label_frames(run: PlottedRun, file: h5py.File) -> dict[int, str]:
    """Return time and load of each map of a run as text, by its index."""
    fields = Fields(file)
    return {k: f"{run.instant(*fields.when(k))} (step {fields.steps[k]})".lstrip() for k in fields.saved}


def round_digits(values: Array) -> Array:
    """Return values rounded to DIGITS digits, so that values that differ only by rounding become equal."""
    return np.array([float(f"{value:.{DIGITS}g}") for value in values])


def count_different(values: Array) -> int:
    """Return the number of values that differ by more than rounding."""
    return np.unique(round_digits(values)).size


def to_load(pressure: Array, area: float) -> tuple[Axis, Array]:
    """Return axis and values of the load: the force on a free box of this `area` [m^2], else the mean pressure."""
    return (Axis("force", "N"), pressure * area) if area else (Axis("pressure", "Pa"), pressure)


def to_contact_area(fraction: Array, area: float) -> tuple[Axis, Array]:
    """Return axis and values of the contact area: in m^2 for a free box of this `area` [m^2], else over the nominal
    area."""
    return (Axis("contact area", "m²"), fraction * area) if area else (Axis(FRACTION), fraction)


EARLY = 0.05  # half of the rows within this share of the time make a linear axis useless: it becomes logarithmic
FEW_ROWS = 8
STAGE_WHITE = 0.87  # share of white in the shade of a stage
LENGTHS = (
    ColumnPanel("approach", Axis("approach", UNITS["approach"]), {"": "approach"}),
    ColumnPanel("gap", Axis("mean gap", UNITS["mean_gap"]), {"": "mean_gap"}),
    ColumnPanel("pressure", Axis("highest pressure", UNITS["max_pressure"]), {"": "max_pressure"}),
)
ENERGIES = {
    "work done": "work",
    "dissipated": "dissipated",
    "stored": "stored",
    "surfaces": "surface_energy",
    "snaps": "snap_loss",
    "slip": "slip_loss",
}
ENERGY = ColumnPanel("energy", Axis("energy", UNITS["work"]), ENERGIES)
VISCOUS = "friction_viscous"  # friction of the body; in tables of runs with an interface


@dataclass(frozen=True)
class Abscissa:
    """The horizontal axis of a run's panels, with SI `values` in some `rows` of the run (None: all rows). `shades` are
    the ranges of its stages. Points are drawn as dots if `marked` is True. `loop` is True for loads and approaches,
    which may return to earlier values."""

    axis: Axis
    values: Array
    rows: NDArray[np.intp] | None = None
    shades: Sequence[Shade] = ()
    marked: bool = False
    loop: bool = False

    def series(self, lines: dict[str, Array]) -> list[Line]:
        """Return one curve for each column of the run in `lines`, whose keys are the names for the legend. A curve
        named '' has no entry there."""
        mark = {"marker": "o"} if self.marked else {}
        looks = [style.line(number) | mark for number in range(len(lines))]
        rows = slice(None) if self.rows is None else self.rows
        drawn = zip(lines.items(), looks, strict=True)
        return [Line(name, self.values, values[rows], look) for (name, values), look in drawn]


def panels_of_run(run: PlottedRun, over: str = "") -> list[Panel]:
    """Return panels of the measures of a run; none for a single solve. Raises InputError if nothing can be drawn."""
    if not run.curves:
        return []
    along = _choose_abscissa(run, over)
    later = along.values[along.values > 0.0] if along.axis.unit == "s" else np.zeros(0)
    log = later.size > FEW_ROWS and bool(max(np.median(later), later[0]) < EARLY * later[-1])
    found = [replace(panel, shades=along.shades, log_x=log) for panel in _find_panels(run, along)]
    if along.marked or along.loop:
        return found
    first, *others = (_add_theory(panel, run) for panel in found)
    return [first, *_panels_of_cycles(run), *others]


def _panels_of_cycles(run: PlottedRun) -> list[Panel]:
    """Return the loops of oscillations, or friction over displacement of a surface that sticks and is moved to and fro
    along x."""
    if any(stage.frequency for stage in run.job.history):
        return list(_panels_of_loops(run))
    if not (run.backwards and "stick_area" in run.columns):
        return []
    ways = np.diff(run.columns["distance"], prepend=0.0)
    for number, rows in run.rows_of_stages.items():
        ways[rows] *= np.sign(run.job.history[number].velocity[0])
    line = Line("", np.cumsum(ways), run.columns["friction_x"], style.line(0))
    return [Panel("friction", Axis("displacement along x", "m"), Axis("friction coefficient\nalong x"), [line])]


def _panels_of_loops(run: PlottedRun) -> Iterator[Panel]:
    """Yield panels of load over approach, and of friction over displacement, with a line for each stage that
    oscillates."""
    loads, frictions = list[Line](), list[Line]()
    load_axis, load = run.load
    starts = np.cumsum([0.0, *(stage.seconds for stage in run.job.history)]).tolist()
    for number, rows in run.rows_of_stages.items():
        stage = run.job.history[number]
        rows = [*range(max(rows[0] - 1, 0), rows[0]), *rows]
        columns = {name: values[rows] for name, values in run.columns.items()}
        lines = frictions if stage.speed and not stage.slides else loads
        look, name = style.line(len(lines)), stage.name
        if stage.frequency and lines is loads:
            loads.append(Line(name, columns["approach"], load[rows], look))
        elif stage.frequency and (way := way_along(stage, columns, starts[number])) is not None:
            friction = friction_along(stage, columns) / (run.area * columns["pressure"])
            frictions.append(Line(name, way, friction, look))
    for lines in (loads, frictions):
        if len(lines) == 1:
            lines[0] = replace(lines[0], name="")
    if loads:
        yield Panel("loop", Axis("approach", "m"), load_axis, loads, bottom=False)
    if frictions:
        axes = Axis("displacement along the velocity", "m"), Axis("friction coefficient\nalong the velocity")
        yield Panel("loop", *axes, frictions)


def _add_theory(panel: Panel, run: PlottedRun) -> Panel:
    """Add the lines of theory.csv to friction and contact area, if it is in the directory of the run."""
    column = {"friction": "friction", "area": "contact_area"}.get(panel.key)
    if column is None or run.backwards or not run.has(outputs.THEORY.table):
        return panel
    theory = run.read(outputs.THEORY.table).arrays()
    over = "distance" if panel.x.unit == "m" else "time"
    (own,) = panel.series
    lines = [replace(own, name="simulation"), Line("theory", theory[over], theory[column], style.line(1))]
    if panel.key == "friction" and VISCOUS in run.columns:  # the theory excludes interface friction
        lines.append(Line("without interface", own.x, run.columns[VISCOUS], style.line(2)))
    return replace(panel, series=lines)


def _find_panels(run: PlottedRun, along: Abscissa) -> Iterator[Panel]:
    """Yield the panels of a run that show anything, those of columns first."""
    signed = run.backwards and not along.marked  # the axis of speed has no direction
    columns = dict(run.columns)
    load_axis, columns["load"] = run.load
    area_axis, columns["area"] = to_contact_area(columns["contact_area_corrected"], run.area * run.free)
    columns["approach"] = np.where((columns["load"] != 0.0) | (columns["area"] > 0.0), columns["approach"], np.nan)
    friction = Axis("friction coefficient" + "\nalong x" * signed), {"": "friction_x" if signed else "friction"}
    if run.slides and lacks_load(columns):
        columns["force"] = -columns["force_x"] if signed else np.hypot(columns["force_x"], columns["force_y"])
        friction = Axis("tangential force" + "\nagainst x" * signed, "N"), {"": "force"}
    first = ColumnPanel("friction", *friction), ColumnPanel("area", area_axis, {"": "area"})
    load = ColumnPanel("load", load_axis, {"": "load"})
    shown = _shown(run, along, load_axis, columns)
    for one in (*first, *LENGTHS, load, ENERGY, *offered("RUN_PANELS")):
        lines = {name: columns[column] for name, column in one.columns.items() if column in columns}
        if lines and shown.get(one.key, True):
            found = Panel(one.key, along.axis, one.y, along.series(lines), bottom=one.key != "approach")
            peak = one.key == "friction" and not one.y.unit
            yield found if along.marked or along.loop else replace(found, peak=peak, spikes=not peak)
    for panels_of in answers("pictures", "panels"):
        yield from panels_of(run, along)


def _shown(run: PlottedRun, along: Abscissa, load_axis: Axis, columns: Mapping[str, Array]) -> dict[str, bool]:
    """Return whether the panels that not all runs have show anything."""
    load = columns["load"]
    return {
        "friction": run.slides and bool(columns["friction"].any() or "force" in columns),  # 0 of a flat surface
        "approach": run.free and along.axis.name != "approach",
        "gap": not run.free and columns["area"].min() < 1.0,
        "load": run.lasts and along.axis != load_axis and bool(np.ptp(load) > 1e-9 * np.abs(load).max()),
        "energy": run.lasts and bool(np.isfinite(columns["work"]).all()),
    }


def describe_solve(run: PlottedRun) -> str:
    """Return the results of the last row of a run as text."""
    axis, load = run.load
    fraction = run.columns["contact_area_corrected"][-1]
    area = printed.quantity(fraction * run.area, "m²", 4) if run.free else f"{fraction:.4g} of the nominal"
    name, column = ("approach", "approach") if run.free else ("mean gap", "mean_gap")
    length = printed.quantity(run.columns[column][-1], "m", 4)
    highest = printed.quantity(run.columns["max_pressure"][-1], "Pa", 4)
    pressed = f"{axis.name} {printed.quantity(load[-1], axis.unit, 4)}"
    return f"{pressed},  contact area {area},\n{name} {length},  highest pressure {highest}"


def _choose_abscissa(run: PlottedRun, over: str) -> Abscissa:
    """Return the given axis, else distance if the surface slides whenever time passes, else time, else load."""
    if not over:
        slides = run.slides and all(stage.slides for stage in run.job.history if stage.seconds)
        over = ("distance" if slides else "time") if run.lasts else "load"
    if over == "load":
        return Abscissa(*run.load, marked=True)
    if over == "velocity":
        return _choose_velocity(run)
    axis, values = Axis("distance slid" if over == "distance" else over, UNITS[over]), run.columns[over]
    if not np.ptp(values):
        constant = f"{over}, which is constant at {values[-1]:g} {axis.unit}"
        raise InputError(f"{run.path}: nothing can be drawn over {constant}")
    if over == "approach":
        return Abscissa(axis, values, loop=True)
    stages = [
        (run.job.history[number].name, float(values[max(rows[0] - 1, 0)]), float(values[rows[-1]]))
        for number, rows in run.rows_of_stages.items()
    ]
    stages = [stage for stage in stages if stage[1] < stage[2]]
    names = list(dict.fromkeys(name for name, _, _ in stages))
    colors = dict(zip(names, style.sequence(len(names)), strict=True))
    shades = [Shade(*stage, color=style.mix(colors[stage[0]], STAGE_WHITE)) for stage in stages]
    return Abscissa(axis, values, shades=shades if len(stages) > 1 else [])


def _choose_velocity(run: PlottedRun) -> Abscissa:
    """Return the axis of speed, with the last row of each sliding stage."""
    ends = [(run.job.history[number].speed, rows[-1]) for number, rows in run.rows_of_stages.items()]
    sliding = sorted((speed, row) for speed, row in ends if speed > 0.0)
    if not sliding:
        raise InputError(f"{run.path}: nothing can be drawn over velocity, no stage slides")
    speeds, rows = zip(*sliding, strict=True)
    return Abscissa(Axis("sliding velocity", "m/s"), np.array(speeds), np.array(rows), marked=True)

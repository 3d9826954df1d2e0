"""A picture of a run, finished or not: what was measured over time, distance or load, and the last saved maps.

Which panels there are follows from the job: friction if the surface slides, energies if they were asked for, curves
over the load if all stages are single solves, pressures along a line through a sphere beside Hertz's.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import yaml
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray
from pydantic import ValidationError

from ..clock import Step, steps
from ..errors import InputError
from ..job import Cylinder, Elastic, Job, Sphere
from ..parallel.slab import Array
from ..theory import hertz
from . import hdf5, measures, steady_plot

PICTURE = "picture.png"
PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
STYLE: dict[Any, Any] = {
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 10,
    "font.size": 9,
    "grid.alpha": 0.25,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
}
BLUE, RED, GREEN, GREY = "#1f4e79", "#b03a2e", "#3a7d44", "0.55"
INSTANTS = 5  # at most so many lines of pressure in one panel
STRIP = 8  # points across: a map as narrow as this is drawn as a line
Panel = Callable[[Axes], None]


def plot(directory: Path) -> Path:
    """Draw the run in a directory; returns the picture's path. Raises InputError where there is no run."""
    if not (directory / "measures.csv").is_file():
        steady = directory / "steady.csv"
        if steady.is_file():
            return steady_plot.plot(steady)
        raise InputError(f"{directory} holds no run: it has no measures.csv")
    run = Run(directory)
    with rc_context(STYLE):
        figure = _figure(run.job.title or directory.name, [list(_histories(run)), _maps(run)])
        figure.savefig(directory / PICTURE, dpi=150)
    return directory / PICTURE


def _figure(title: str, groups: Sequence[Sequence[Panel]]) -> Figure:
    """Groups of panels below each other, each in even rows of at most three."""
    rows = [
        list(row) for group in groups if group for row in np.array_split(np.array(group, object), -(-len(group) // 3))
    ]
    figure = Figure(figsize=(11.5, 0.4 + 3.0 * len(rows)), layout="constrained")
    figure.suptitle(title, fontsize=11)
    for part, panels in zip(figure.subfigures(len(rows), 1, squeeze=False)[:, 0], rows, strict=True):
        for panel, axes in zip(panels, part.subplots(1, len(panels), squeeze=False)[0], strict=True):
            panel(axes)
    return figure


class Run:
    """A run's job and rows. The rows before the first load of a body at rest are left out: nothing has happened yet."""

    def __init__(self, directory: Path) -> None:
        self.directory, self.job = directory, _job(directory / "job.resolved.yaml")
        self._columns = {name: np.array(values) for name, values in measures.read(directory / "measures.csv").items()}
        if not self._columns["step"].size:
            raise InputError(f"{directory} holds no step yet")
        self._first = 1 if self._columns["pressure"][0] == 0.0 and self._columns["step"].size > 1 else 0

    def column(self, name: str) -> Array:
        return self._columns[name][self._first :]

    @property
    def area(self) -> float:
        """Of the box [m^2]."""
        return self.job.grid.lx * self.job.grid.ly

    @property
    def free(self) -> bool:
        return self.job.grid.boundary == "free"

    @property
    def load(self) -> tuple[str, str, Array]:
        """What presses: its name, unit and values."""
        pressure = self.column("pressure")
        return ("force", "N", pressure * self.area) if self.free else ("pressure", "Pa", pressure)

    @cached_property
    def timeline(self) -> dict[int, Step]:
        """What the job says about each step."""
        last = float(self._columns["time"][-1])
        return {step.number: step for step in steps(self.job.history, self.job.grid, last, self.job.initial.pressure)}

    @property
    def stages(self) -> NDArray[np.int64]:
        """The stage of every row; the initial state belongs to the first."""
        return np.array([self.timeline[int(n)].stage if n else 0 for n in self.column("step")])

    @property
    def lasts(self) -> bool:
        return self._columns["time"][-1] > 0.0

    @property
    def slides(self) -> bool:
        return self._columns["distance"][-1] > 0.0


def _job(path: Path) -> Job:
    """The resolved job; its files of heights need not be there any more."""
    try:
        data = yaml.safe_load(path.read_text())
        data["surface"] = [{"shape": "flat"} if shape["shape"] == "file" else shape for shape in data["surface"]]
        return Job.model_validate(data)
    except (OSError, yaml.YAMLError, KeyError, TypeError, ValidationError) as error:
        raise InputError(f"{path} cannot be read: {hdf5.reason(error)}") from error


def _scaled(unit: str, *series: Array) -> tuple[str, list[Array]]:
    """The unit with the prefix that suits the largest value, and the series in it."""
    largest = max((float(np.abs(values[np.isfinite(values)]).max(initial=0.0)) for values in series), default=0.0)
    power = 3 * int(np.floor((np.log10(largest) + 1e-9) / 3)) if largest > 0.0 else 0
    power = min(max(power, min(PREFIXES)), max(PREFIXES))
    return PREFIXES[power] + unit, [values / 10.0**power for values in series]


# -- histories --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Abscissa:
    """What histories are drawn over, and where the stages are."""

    label: str
    values: Array
    stages: Sequence[tuple[str, float, float]] = ()
    marker: str = ""

    def mark(self, axes: Axes, named: bool) -> None:
        """Show where stages begin, and the names of those that are wide enough."""
        span = float(np.ptp(self.values)) or 1.0
        for number, (name, start, end) in enumerate(self.stages):
            if number:
                axes.axvline(start, color=GREY, lw=0.7, ls=":", zorder=0)
            if named and len(self.stages) > 1 and end - start > 0.02 * len(name) * span:
                middle = ((start + end) / 2, 1.02)
                axes.text(*middle, name, color=GREY, ha="center", fontsize=8, transform=axes.get_xaxis_transform())


def _histories(run: Run) -> Iterator[Panel]:
    """Panels of what was measured."""
    if not run.lasts and len(set(run.column("pressure"))) < 2:
        return
    over = _over_time(run) if run.lasts else _over_load(run)
    if run.slides:
        yield _friction(over, run.column("friction"))
    contact = run.column("contact_area")
    if run.free:
        small = contact.max() * run.area < 1e-9
        area, name = contact * run.area * (1e12 if small else 1e6), f"contact area [{'µm' if small else 'mm'}²]"
        where = np.where(run.column("pressure") > 0.0, run.column("approach"), np.nan)
        yield _lines(over, name, "", [("", area, BLUE)], bottom=0.0, named=not run.slides)
        yield _lines(over, "approach", "m", [("", where, BLUE)])
    else:
        yield _lines(over, "contact area / nominal area", "", [("", contact, BLUE)], bottom=0.0)
        if contact.min() < 1.0:
            yield _lines(over, "mean gap", "m", [("", run.column("mean_gap"), BLUE)], bottom=0.0)
    yield _lines(over, "highest pressure", "Pa", [("", run.column("max_pressure"), RED)], bottom=0.0)
    name, unit, load = run.load
    if run.lasts and np.ptp(load) > 1e-9 * load.max():
        yield _lines(over, name, unit, [("", load, BLUE)], bottom=0.0)
    if run.lasts and np.isfinite(run.column("work")).all():
        parts = (("work done on the body", "work", "k"), ("dissipated", "dissipated", RED), ("stored", "stored", GREEN))
        yield _lines(over, "energy", "J", [(label, run.column(column), color) for label, column, color in parts])


def _over_time(run: Run) -> Abscissa:
    """Distance if the surface slides in all stages that last, else time."""
    slides = all(stage.speed > 0.0 for stage in run.job.history if stage.seconds)
    name, unit = ("distance", "m") if slides else ("time", "s")
    label, (values,) = _scaled(unit, run.column(name))
    found = run.stages
    stages = []
    for number in sorted(set(found.tolist())):
        rows = np.flatnonzero(found == number)
        start = values[max(rows[0] - 1, 0)]
        stages.append((run.job.history[number].name, float(start), float(values[rows[-1]])))
    return Abscissa(f"{'distance slid' if slides else 'time'} [{label}]", values, stages)


def _over_load(run: Run) -> Abscissa:
    name, unit, load = run.load
    label, (values,) = _scaled(unit, load)
    return Abscissa(f"{name} [{label}]", values, marker="o")


def _lines(
    over: Abscissa,
    name: str,
    unit: str,
    series: Sequence[tuple[str, Array, str]],
    bottom: float | None = None,
    named: bool = False,
) -> Panel:
    def draw(axes: Axes) -> None:
        label, scaled = _scaled(unit, *(values for _, values, _ in series)) if unit else ("", [s[1] for s in series])
        for (text, _, color), values in zip(series, scaled, strict=True):
            axes.plot(over.values, values, over.marker + "-", ms=4, color=color, label=text or None)
        axes.set(xlabel=over.label, ylabel=f"{name} [{label}]" if label else name)
        axes.set_ylim(bottom=bottom)
        over.mark(axes, named)
        if series[0][0]:
            axes.legend()

    return draw


def _friction(over: Abscissa, friction: Array) -> Panel:
    plain = _lines(over, "friction coefficient", "", [("", friction, BLUE)], bottom=0.0, named=True)

    def draw(axes: Axes) -> None:
        plain(axes)
        peak = int(np.argmax(friction))
        if 0 < peak < friction.size - 1 and friction[peak] > 1.02 * friction[-1]:
            x, unit = over.values[peak], over.label.rsplit("[", 1)[-1].rstrip("]")
            axes.plot(x, friction[peak], "o", ms=4, color=RED)
            text = f"{friction[peak]:.3g} at {x:.3g} {unit}"
            axes.annotate(text, (x, friction[peak]), (8, -3), textcoords="offset points", color=RED, fontsize=8)

    return draw


# -- maps -------------------------------------------------------------------------------------------------------------


class Fields:
    """The saved maps of a run."""

    def __init__(self, file: h5py.File) -> None:
        self.file = file
        self.steps: NDArray[np.int64] = file["step"][...]
        self.x, self.y = file["x"][...], file["y"][...]
        self.saved = [k for k, t in enumerate(file["t"][...]) if not np.isnan(t)]

    def last(self, name: str) -> Array | None:
        """The newest map of a name, if it was saved."""
        field = self.file[name][self.saved[-1]] if name in self.file and self.saved else None
        return field if field is not None and np.isfinite(field).all() else None


def _maps(run: Run) -> list[Panel]:
    """Panels of the last saved instant; none if nothing was saved."""
    try:
        with h5py.File(run.directory / "fields.h5", "r", locking=False) as file:
            return list(_panels(run, Fields(file)))
    except (OSError, KeyError):
        return []


def _panels(run: Run, fields: Fields) -> Iterator[Panel]:
    pressure, gap, displacement = (fields.last(name) for name in ("pressure", "gap", "displacement"))
    if not fields.saved:
        return
    if min(fields.x.size, fields.y.size) <= STRIP:
        if pressure is not None:
            yield _strips(run, fields)
        return
    rounds = [shape for shape in run.job.surface if isinstance(shape, Sphere | Cylinder)]
    if pressure is not None and len(run.job.surface) == 1 and rounds:
        yield _profiles(run, fields, rounds[0])
    time = float(fields.file["t"][fields.saved[-1]])
    unit, (shown,) = _scaled("s", np.array([time]))
    when = f" at {shown[0]:.4g} {unit}" if run.lasts else ""
    window = _window(pressure)
    if pressure is not None:
        yield _map(fields, np.where(pressure > 0.0, pressure, np.nan), "pressure", "Pa", when, window)
    if gap is not None:
        open_ = gap if pressure is None else np.where(pressure > 0.0, np.nan, gap)
        yield _map(fields, open_, "gap", "m", f"{when}; contact black", window, "Blues_r", "k")
    elif displacement is not None:
        yield _map(fields, displacement, "displacement", "m", when, window, "viridis")


def _window(pressure: Array | None) -> tuple[slice, slice]:
    """The rows and columns around a contact that fills only a part of the box; else all of them."""
    window = (slice(None), slice(None))
    if pressure is None or not (pressure > 0.0).any():
        return window
    cut = []
    for axis in (1, 0):
        touched = np.flatnonzero((pressure > 0.0).any(axis=axis))
        margin = (touched[-1] - touched[0]) // 2 + 3
        cut.append(slice(max(touched[0] - margin, 0), touched[-1] + margin + 1))
    whole = pressure[cut[0], cut[1]].size > 0.5 * pressure.size
    return window if whole else (cut[0], cut[1])


def _map(
    fields: Fields,
    values: Array,
    name: str,
    unit: str,
    when: str,
    window: tuple[slice, slice],
    colors: str = "inferno",
    blank: str = "0.92",
) -> Panel:
    x, y = fields.x, fields.y
    label, (shown,) = _scaled(unit, values)
    length, (right, top) = _scaled("m", np.append(x, 2 * x[-1] - x[-2]), np.append(y, 2 * y[-1] - y[-2]))

    def draw(axes: Axes) -> None:
        axes.set_facecolor(blank)
        axes.grid(False)
        part = shown[window]
        columns, lines = slice(window[1].start, _edge(window[1])), slice(window[0].start, _edge(window[0]))
        lowest, highest = _range(part)
        colored = Normalize(lowest, highest)
        mesh = axes.pcolormesh(right[columns], top[lines], part, cmap=colors, norm=colored, rasterized=True)
        axes.set(xlabel=f"x [{length}]", ylabel=f"y [{length}]", title=name + when, aspect="equal")
        beyond = "max" if np.nanmax(part, initial=-np.inf) > highest else "neither"
        axes.figure.colorbar(mesh, ax=axes, label=f"{name} [{label}]", extend=beyond)

    return draw


def _edge(part: slice) -> int | None:
    return None if part.stop is None else part.stop + 1


def _range(values: Array) -> tuple[float, float]:
    """Of the colours: from 0 if nothing is negative; a few very high points do not darken all others."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return 0.0, 1.0
    most, highest = float(np.percentile(finite, 99.5)), float(finite.max())
    return min(float(finite.min()), 0.0), (highest if highest < 1.4 * most else most) or 1.0


# -- pressures on a line ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Curve:
    """Pressures [Pa] on a line [m] at an instant."""

    name: str
    along: Array
    pressure: Array


def _chosen(run: Run, fields: Fields) -> list[tuple[int, str]]:
    """Some of the saved instants, evenly, and what tells them apart."""
    found = []
    for index in sorted({fields.saved[int(k)] for k in np.linspace(0, len(fields.saved) - 1, INSTANTS)}):
        name, unit, load = run.load
        time = fields.file["t"][index]
        at = np.flatnonzero(run.column("step") == fields.steps[index])
        value, unit = (time, "s") if run.lasts else (float(load[at[0]]) if at.size else np.nan, unit)
        label, (scaled,) = _scaled(unit, np.array([value]))
        found.append((index, f"{scaled[0]:.3g} {label}"))
    return found


def _draw_curves(axes: Axes, curves: Sequence[Curve]) -> tuple[float, float]:
    """Draw pressures on lines; returns the units of length [m] and pressure [Pa]."""
    length, distances = _scaled("m", *(curve.along for curve in curves))
    unit, pressures = _scaled("Pa", *(curve.pressure for curve in curves))
    for number, (curve, x, p) in enumerate(zip(curves, distances, pressures, strict=True)):
        shade = 0.85 * number / max(len(curves) - 1, 1)
        axes.plot(x, p, color=colormaps["plasma"](shade), label=curve.name)
    axes.set(xlabel=f"[{length}]", ylabel=f"pressure [{unit}]")
    return _size(length, "m"), _size(unit, "Pa")


def _size(label: str, unit: str) -> float:
    """What a unit with its prefix stands for."""
    return 10.0 ** next(power for power, prefix in PREFIXES.items() if prefix + unit == label)


def _strips(run: Run, fields: Fields) -> Panel:
    """Pressures along the long side of a narrow map."""
    lies = fields.x.size > fields.y.size
    curves = []
    for index, name in _chosen(run, fields):
        field = fields.file["pressure"][index]
        curves.append(Curve(name, fields.x if lies else fields.y, field[0] if lies else field[:, 0]))

    def draw(axes: Axes) -> None:
        _draw_curves(axes, curves)
        axes.set_xlabel(("x " if lies else "y ") + axes.get_xlabel())
        axes.set_title("pressure at some of the saved instants")
        _legend_beside(axes)

    return draw


def _profiles(run: Run, fields: Fields, shape: Sphere | Cylinder) -> Panel:
    """Pressures along a line through the axis, seen from the axis, beside Hertz's under the last load."""
    across = isinstance(shape, Cylinder) and shape.axis == "x"
    centre = shape.center or (run.job.grid.lx / 2, run.job.grid.ly / 2)
    curves = []
    for index, name in _chosen(run, fields):
        moved = run.timeline[int(fields.steps[index])].position
        x, y, field = fields.x - centre[0] - moved[0], fields.y - centre[1] - moved[1], fields.file["pressure"][index]
        line = field[:, np.argmin(np.abs(x))] if across else field[np.argmin(np.abs(y))]
        curves.append(Curve(name, y if across else x, line))
    force = float(field.mean() * run.area)
    reach = 1.3 * max(float(np.abs(curve.along[curve.pressure > 0.0]).max(initial=0.0)) for curve in curves)

    def draw(axes: Axes) -> None:
        length, unit = _draw_curves(axes, curves)
        if isinstance(shape, Sphere) and force > 0.0:
            r = np.linspace(-reach, reach, 401)
            for name, modulus, style in _moduli(run.job):
                pressure = hertz.pressure(np.abs(r), force, shape.radius, modulus, run.job.material.poisson)
                axes.plot(r / length, pressure / unit, "k" + style, lw=1.0, label=name)
        axes.set_xlabel(f"{'y' if across else 'x'} from the axis {axes.get_xlabel()}")
        axes.set_title("pressure on a line through the axis")
        if reach > 0.0:
            axes.set_xlim(-reach / length, reach / length)
        axes.set_ylim(bottom=0.0)
        _legend_beside(axes)

    return draw


def _moduli(job: Job) -> list[tuple[str, float, str]]:
    """Of the elastic bodies to compare with, and how they are drawn."""
    material = job.material
    if isinstance(material, Elastic):
        return [("Hertz", material.shear_modulus, "--")]
    ends = [("Hertz, G(0)", material.instant_modulus, "--"), ("Hertz, G(∞)", material.long_modulus, ":")]
    return [end for end in ends if end[1] > 0.0]


def _legend_beside(axes: Axes) -> None:
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0, handlelength=1.2)

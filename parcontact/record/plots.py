"""A picture of a run, finished or not: what was measured over time, distance or load, and the last saved maps.

Which panels there are follows from the job: friction if the surface slides, energies if they were asked for, curves over
the load if all stages are single solves, pressures along a line through a sphere beside Hertz's.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import h5py
import numpy as np
import yaml
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
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
STYLE = {
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
    panels = [*_histories(run), *_maps(run)]
    columns = min(len(panels), 2)
    lines = -(-len(panels) // max(columns, 1))
    with rc_context(STYLE):
        figure = Figure(figsize=(5.2 * columns, 0.4 + 3.1 * lines), layout="constrained")
        figure.suptitle(run.job.title or run.job.path.stem, fontsize=11)
        for panel, axes in zip(panels, np.ravel(figure.subplots(lines, columns, squeeze=False)), strict=False):
            panel(axes)
        for axes in figure.axes[len(panels) : lines * columns]:
            axes.set_axis_off()
        figure.savefig(directory / PICTURE, dpi=150)
    return directory / PICTURE


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
            yield _strips(fields, pressure)
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
        mesh = axes.pcolormesh(right[columns], top[lines], part, cmap=colors, norm=_norm(part), rasterized=True)
        axes.set(xlabel=f"x [{length}]", ylabel=f"y [{length}]", title=name + when, aspect="equal")
        axes.figure.colorbar(mesh, ax=axes, label=f"{name} [{label}]")

    return draw


def _edge(part: slice) -> int | None:
    return None if part.stop is None else part.stop + 1


def _norm(values: Array) -> Normalize:
    """Colours by value; a few very high points do not darken all others."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return Normalize(0.0, 1.0)
    low = min(float(finite.min()), 0.0) if finite.min() >= 0.0 else float(finite.min())
    return Normalize(low, float(np.percentile(finite, 99.8)) or None)


def _strips(fields: Fields, pressure: Array) -> Panel:
    """Pressure along the long side of a narrow map."""
    along, line = (fields.x, pressure[0]) if fields.x.size > fields.y.size else (fields.y, pressure[:, 0])
    length, (position,) = _scaled("m", along)
    unit, (shown,) = _scaled("Pa", line)

    def draw(axes: Axes) -> None:
        axes.plot(position, shown, color=RED)
        axes.set(xlabel=f"{'x' if along is fields.x else 'y'} [{length}]", ylabel=f"pressure [{unit}]")
        axes.set_title("pressure at the last saved instant")
        axes.set_ylim(bottom=0.0)

    return draw


# -- pressures under a sphere -----------------------------------------------------------------------------------------


def _profiles(run: Run, fields: Fields, shape: Sphere | Cylinder) -> Panel:
    """Pressures along a line through the axis, seen from the axis, at some of the saved instants."""
    job = run.job
    across = isinstance(shape, Cylinder) and shape.axis == "x"
    centre = shape.center or (job.grid.lx / 2, job.grid.ly / 2)
    chosen = sorted({fields.saved[int(k)] for k in np.linspace(0, len(fields.saved) - 1, INSTANTS)})
    curves = []
    for index in chosen:
        step = run.timeline[int(fields.steps[index])]
        x, y = (fields.x - centre[0] - step.position[0], fields.y - centre[1] - step.position[1])
        field = fields.file["pressure"][index]
        distance, line = (y, field[:, np.argmin(np.abs(x))]) if across else (x, field[np.argmin(np.abs(y))])
        load = float(field.mean() * run.area)
        curves.append((step, distance, line, load))
    label, distances = _scaled("m", *(curve[1] for curve in curves))
    unit, lines = _scaled("Pa", *(curve[2] for curve in curves))
    reach = 1.3 * max((float(np.abs(d[p > 0.0]).max(initial=0.0)) for d, p in zip(distances, lines, strict=True)))

    def draw(axes: Axes) -> None:
        for number, ((step, _, _, load), distance, line) in enumerate(zip(curves, distances, lines, strict=True)):
            seconds, (when,) = _scaled("s", np.array([step.time]))
            text = f"{when[0]:.3g} {seconds}" if run.lasts else f"{load:.3g} N"
            shade = 0.9 * number / max(len(curves) - 1, 1)
            axes.plot(distance, line, color=(0.12 + 0.75 * shade, 0.3, 0.55 - 0.4 * shade), label=text)
        if isinstance(shape, Sphere):
            _beside_hertz(axes, run, shape, curves[-1][3], unit, label, reach)
        axes.set(xlabel=f"{'y' if across else 'x'} from the axis [{label}]", ylabel=f"pressure [{unit}]")
        axes.set(title="pressure along a line through the axis", xlim=(-reach, reach) if reach else None)
        axes.set_ylim(bottom=0.0)
        axes.legend()

    return draw


def _beside_hertz(axes: Axes, run: Run, shape: Sphere, force: float, unit: str, label: str, reach: float) -> None:
    """Hertz's pressures under the last load: of the body itself, or of its first and last moduli."""
    material, size = run.job.material, 10.0 ** next(p for p, name in PREFIXES.items() if label == name + "m")
    scale = 10.0 ** next(p for p, name in PREFIXES.items() if unit == name + "Pa")
    r = np.linspace(-reach, reach, 401) * size
    kinds = [("Hertz", material.instant_modulus, "--")]
    if not isinstance(material, Elastic):
        kinds = [("Hertz, instantaneous modulus", material.instant_modulus, "--")]
        kinds += [("Hertz, long-term modulus", material.long_modulus, ":")] if material.long_modulus else []
    for name, modulus, style in kinds if force > 0.0 else []:
        pressure = hertz.pressure(np.abs(r), force, shape.radius, modulus, material.poisson)
        axes.plot(r / size, pressure / scale, "k" + style, lw=1.0, label=name)

"""Pictures of maps: panels, movies and lines.

* Maps of saved instants: panels of one instant, and frames of all instants for movies and reports.
* Movies of a map over its saved instants: a GIF, and an MP4 if `ffmpeg` is on the path.
* Charts of pressure, and of traction, along a line. The line is the long side of a map that is few points wide, or goes
  through the axis of a sphere or cylinder.
"""

import io
import shutil
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from .. import printed
from ..effects.effect import touching_of
from ..errors import InputError
from ..files import files, hdf5, outputs
from ..job import Cylinder, Elastic, Job, Sphere
from ..parallel.slab import Array
from ..theory import hertz
from . import style
from .panels import Axis, Colors, Line, Panel, draw, drawn_points
from .plotted_run import Fields, PlottedRun, choose_evenly, label_frames

INSTANTS = 5  # most lines in a panel
MOST_LETTERS = 30  # most letters of the name of a stage in a legend
BLACK: dict[str, Any] = {"color": "k", "linewidth": 1.0}
RANGE = 1.3  # shown range over the radius of contact

Curve = tuple[str, Array, Array]  # name, positions [m] and pressures [Pa]
PRESSURE, TRACTION = Axis("pressure", "Pa"), Axis("traction", "Pa")


def line_panels(run: PlottedRun, fields: Fields, narrow: bool) -> Iterator[Panel]:
    """Yield the panel of pressure along a line. There is one if the map is `narrow` (few points wide), or if the
    surface is a single sphere or cylinder; else nothing is yielded."""
    shape = run.job.surface[0]
    if narrow:
        yield _make_strip(run, fields)
    elif len(run.job.surface) == 1 and isinstance(shape, Sphere | Cylinder):
        yield _make_profile(run, fields, shape)


def _choose_instants(run: PlottedRun, fields: Fields) -> tuple[list[tuple[int, str]], str]:
    """Return some evenly spaced saved instants with their labels, and the load for the title if it is the same at
    all."""
    indices = sorted({fields.shown[int(k)] for k in np.linspace(0, len(fields.shown) - 1, INSTANTS)})
    instants = [(index, *fields.when(index)) for index in indices]
    loads = {run.pressed(step) for _, step, _ in instants}
    same_load = run.lasts and len(loads) == 1
    names = []
    for index, step, time in instants:
        stage = style.plain(run.name_stage(step), MOST_LETTERS)
        when = printed.quantity(time, "s") if same_load else run.instant(step, time)
        names.append((index, "\n".join(filter(None, (stage, when)))))
    return names, f", {loads.pop()}" if same_load else ""


def _pressures(
    curves: Sequence[Curve], along: str, title: str, theory: Sequence[Curve] = (), reach: float = 0.0
) -> Panel:
    """Return the panel of pressures on lines up to `reach` on both sides, if given, with the theory."""
    colors = style.sequence(len(curves)) if len(curves) > 1 else [style.BLUE]
    lines = [Line(*curve, {"color": color}) for curve, color in zip(curves, colors, strict=True)]
    lines += [Line(*curve, BLACK | {"linestyle": dashes}) for curve, dashes in zip(theory, ("--", ":"), strict=False)]
    return Panel("maps", Axis(along, "m"), PRESSURE, lines, title, x_range=(-reach, reach) if reach else None)


def _make_strip(run: PlottedRun, fields: Fields) -> Panel:
    """Return a panel of pressures along the long side of a narrow map."""
    along, place = _long_side(fields.x, fields.y)
    chosen, load = _choose_instants(run, fields)
    curves = [(name, place, _along(fields.file["pressure"][index])) for index, name in chosen]
    some = "some of the " if len(curves) < len(fields.shown) else "the "
    title = f"pressure at {some}saved instants{load}" if run.lasts else f"pressure under {some}loads"
    return _pressures(curves, along, title)


def traction_panels(run: PlottedRun, fields: Fields) -> Iterator[Panel]:
    """Yield the panel of tractions along the long side of a narrow map at the chosen instant, if tractions are saved;
    with their bounds if the job has a coefficient of friction."""
    along, place = _long_side(fields.x, fields.y)
    traction, pressure = fields.read(f"traction_{along}"), fields.read("pressure")
    if traction is None or pressure is None:
        return
    t, p = _along(traction), _along(pressure)
    instant = run.instant(*fields.when(fields.chosen))
    bound = run.job.section("interface").coefficient
    touched = place[_under_traction(t, p, bound)]
    lines = [Line("traction", place, t, {"color": style.BLUE})]
    for sign, name in ((1, "bound"), (-1, "")) if bound is not None else ():
        lines.append(Line(name, place, sign * bound * p, BLACK | {"linestyle": ":"}))
    margin = 0.15 * np.ptp(touched) if touched.size else 0.0
    shown = (touched.min() - margin, touched.max() + margin) if margin else None
    yield Panel("maps", Axis(along, "m"), TRACTION, lines, f"traction along {along}, {instant}", x_range=shown)


def _make_profile(run: PlottedRun, fields: Fields, shape: Sphere | Cylinder) -> Panel:
    """Return a panel of pressures on a line through the axis, with Hertz's pressure on a half space under the last
    load."""
    across = isinstance(shape, Cylinder) and shape.axis == "x"
    centre = shape.center or (run.job.grid.lx / 2, run.job.grid.ly / 2)
    chosen, load = _choose_instants(run, fields)
    curves: list[Curve] = []
    for index, name in chosen:
        moved = run.moved(fields.steps[index])
        x, y, field = fields.x - centre[0] - moved[0], fields.y - centre[1] - moved[1], fields.file["pressure"][index]
        line = field[:, np.argmin(np.abs(x))] if across else field[np.argmin(np.abs(y))]
        curves.append((name, y if across else x, line))
    force = float(field.mean() * run.area)
    reach = RANGE * max(float(np.abs(along[pressure > 0.0]).max(initial=0.0)) for _, along, pressure in curves)
    theory: list[Curve] = []
    if isinstance(shape, Sphere) and force > 0.0 and not run.job.asked("response"):
        r, poisson = np.linspace(-reach, reach, 401), run.job.material.poisson
        for name, modulus in _find_moduli(run):
            theory.append((name, r, hertz.pressure(np.abs(r), force, shape.radius, modulus, poisson)))
    along, title = f"{'y' if across else 'x'} from the axis", f"pressure on a line through the axis{load}"
    return _pressures(curves, along, title, theory, reach)


def _find_moduli(run: PlottedRun) -> list[tuple[str, float]]:
    """Return the shear moduli [Pa] of the elastic bodies to compare with."""
    material = run.job.material.fitted
    if isinstance(material, Elastic):
        return [("Hertz", material.shear_modulus)]
    ends = ("Hertz, G(0)", material.instant_modulus), ("Hertz, G(∞)", material.long_modulus)
    return [end for end in ends if end[1] > 0.0]


Window = tuple[slice, slice]


class Look(NamedTuple):
    """Style of a map: unit, colours, colour of points without a value, and a note."""

    unit: str
    colors: str
    blank: str = "0.92"
    note: str = ""


LOOKS = {
    "pressure": Look("Pa", "inferno"),
    "gap": Look("m", "Blues_r", "k", " (contact black)"),
    "displacement": Look("m", "viridis"),
    "height": Look("m", "cividis", note=" (up is into the body)"),
    "fluid_pressure": Look("Pa", "viridis", "k", " (contact black)"),
    "temperature": Look("K", "hot", note=" rise"),
    "traction": Look("Pa", "inferno"),
    "slip": Look("", "viridis", note=": traction over its bound"),
}
TRACTIONS = ("traction_x", "traction_y")
STICK_MAPS = ("traction", "slip")  # drawn from both components and the pressure
OUTSIDE = ("gap", "fluid_pressure")  # drawn outside of contact
ROUNDING = 1e-6  # rounding: of a pressure, over the highest
TENSION = "RdBu_r"  # colours of pressures of both signs
PLACES = Axis("x", "m"), Axis("y", "m")
STRIP = 8  # most points across of a map that is drawn as a line
WIDE = 2.0  # width over height of maps of which each has a row
BRIGHTEST, OUTLIER = 99.5, 1.4  # percentile, and the ratio to it above which points do not set the colour range


def map_panels(run: PlottedRun, at: str = "") -> tuple[list[list[Panel]], list[Panel]]:
    """Return two lists of panels at one instant: groups of panels below each other (pressures on a line, and each map
    that is wide), and the panels of all other saved maps, or of tractions on a line.

    The instant `at` is a step or a time [s]. By default it is the last saved instant up to the row that shows the
    contact best (`Results.telling_row`). Raises InputError if nothing is saved at `at`.
    """
    try:
        with run.open_maps() as file:
            fields = Fields(file, at, until=run.telling_step)
            narrow = min(fields.x.size, fields.y.size) <= STRIP
            pressures = list(line_panels(run, fields, narrow)) if fields.read("pressure") is not None else []
            if narrow:
                return [pressures], list(traction_panels(run, fields))
            found = list(_panels(run, fields)) if fields.saved else []
            wide = run.job.grid.lx > WIDE * run.job.grid.ly  # one in a row
            return ([pressures, *([one] for one in found)], []) if wide else ([pressures], found)
    except (OSError, KeyError):
        if at:
            message = f"--at {at}: {run.path} has no maps; save them by output: {{fields: [...]}}"
            raise InputError(message) from None
        return [], []


def _panels(run: PlottedRun, fields: Fields) -> Iterator[Panel]:
    found = {name: fields.read(name) for name in (*LOOKS, *TRACTIONS)}
    pressure, (x, y) = found["pressure"], (found.pop(name) for name in TRACTIONS)
    if pressure is not None and x is not None and y is not None:
        found["traction"], found["slip"] = stick_maps(np.hypot(x, y), pressure, run.job)
    if found["gap"] is not None:
        del found["displacement"]  # displacement and gap show the same
    instant = run.instant(*fields.when(fields.chosen))
    for name, values in found.items():
        if values is not None:
            yield _panel(fields, name, mask(name, values, pressure, run.job), instant, _find_window(pressure))


def _panel(fields: Fields, name: str, values: Array, instant: str, window: Window) -> Panel:
    rows, columns = window
    part = values[window]
    limits = find_range(part)
    beyond = bool(np.nanmax(part, initial=-np.inf) > limits[1])
    drawn = _colors(name, (fields.x[columns], fields.y[rows]), part, limits, beyond)
    title = f"{name.replace('_', ' ')}{LOOKS[name].note}\n{instant}"
    return Panel("maps", *PLACES, title=title, colors=drawn)


def mask(name: str, values: Array, pressure: Array | None, job: Job) -> Array:
    """Return the `values` of the map called `name` for drawing, NaN at points that are not drawn.

    Pressures are drawn where they are positive; if adhesion makes some pressures negative, pressures are drawn
    everywhere. Gaps are drawn outside of contact, or where they are positive if pressures are not given. The pressure
    of a fluid is drawn outside of contact.
    """
    if name == "pressure":
        return values if (values < 0.0).any() else np.where(values > 0.0, values, np.nan)
    if name == "gap":
        closed = values <= 0.0 if pressure is None else touching_of(job, pressure, values)
        return np.where(closed, np.nan, np.maximum(values, 0.0))
    if name == "fluid_pressure" and pressure is not None:  # the rest of the pressure is that of contact
        return np.where(pressure - values > ROUNDING * np.abs(pressure).max(), np.nan, values)
    return values


def stick_maps(traction: Array, pressure: Array, job: Job) -> tuple[Array, Array]:
    """Return a map of |traction| where surfaces touch, and a map of its ratio to the bound, which is 1 where points
    slip.

    With a coefficient of friction the bound is this coefficient times the pressure. With a shear strength the bound is
    the largest traction in the map.
    """
    coefficient = job.section("interface").coefficient
    touching = _under_traction(traction, pressure, coefficient)
    bound = np.full(pressure.shape, traction.max()) if coefficient is None else coefficient * pressure
    share = np.divide(traction, bound, out=np.zeros_like(traction), where=bound > 0.0)
    return np.where(touching, traction, np.nan), np.where(touching, share, np.nan)


def _under_traction(traction: Array, pressure: Array, coefficient: float | None) -> NDArray[np.bool_]:
    """Return the map of points that touch. A shear strength acts at all of them, also where they pull; adhesion leaves
    small positive pressures elsewhere, by the errors of solves."""
    return pressure > 0.0 if coefficient is not None or not traction.any() else traction != 0.0


def _find_window(pressure: Array | None) -> Window:
    """Return the rows and columns around a contact that fills only part of the box; else all."""
    whole = slice(None), slice(None)
    if pressure is None or not (pressure > 0.0).any() or (pressure < 0.0).any():
        return whole
    cut = []
    for axis in (1, 0):
        touched = np.flatnonzero((pressure > 0.0).any(axis=axis))
        margin = (touched[-1] - touched[0]) // 2 + 3
        cut.append(slice(max(touched[0] - margin, 0), touched[-1] + margin + 1))
    return whole if pressure[cut[0], cut[1]].size > 0.5 * pressure.size else (cut[0], cut[1])


def find_range(values: Array) -> tuple[float, float]:
    """Return the lowest and the highest value of the colour scale; a few very high values do not extend it.

    The scale begins at 0 if no value is negative, and is symmetric if pressures have both signs. The result is (inf,
    -inf) if no point has a value.
    """
    finite = values[np.isfinite(values)]
    if not finite.size:
        return np.inf, -np.inf
    above = finite[finite > 0.0] if finite.min() < 0.0 < finite.max() else finite
    most, highest = float(np.percentile(above, BRIGHTEST)), float(above.max())
    return min(float(finite.min()), 0.0), highest if highest < OUTLIER * most else most


def _colors(
    name: str, points: tuple[Array, Array], values: Array, limits: tuple[float, float], clipped: bool = False
) -> Colors:
    """Return a map in its colours."""
    look, (low, high) = LOOKS[name], limits
    if name == "pressure" and low < 0.0:  # white at pressure 0
        look, low, high = look._replace(colors=TENSION), min(low, -high), max(-low, high)
    ends = [end for along in points for end in (along[0], 2 * along[-1] - along[-2])]
    of = Axis(name.replace("_", " "), look.unit)
    return Colors(values, (*ends,), of, low, high, look.colors, look.blank, clipped)


def _line(name: str, points: tuple[Array, Array], values: Array, limits: tuple[float, float]) -> Panel:
    """Return a narrow map as a line over its long side."""
    (along, place), (low, high) = _long_side(*points), limits
    line = Line("", place, _along(values), {"color": style.BLUE})
    shown = (low, low + 1.05 * (high - low)) if high > low else None
    of = Axis(name.replace("_", " "), LOOKS[name].unit)
    return Panel("maps", Axis(along, "m"), of, [line], bottom=False, y_range=shown)


def _long_side(x: Array, y: Array) -> tuple[str, Array]:
    """Return the name and the points [m] of the long side of a narrow map."""
    return ("x", x) if x.size > y.size else ("y", y)


def _along(values: Array) -> Array:
    """Return a narrow map along its long side, 0 where it has no value."""
    return np.nan_to_num(values[0] if values.shape[1] > values.shape[0] else values[:, 0])


def dataset_of(file: h5py.File, name: str) -> str:
    """Return the name of the data set with a map in a file, '' if there is none. The map of a quantity that is also a
    column, such as the temperature, is called `temperature_map`."""
    return next((key for key in (f"{name}_map", name) if key in file and file[key].ndim > 1), "")


def drawn_maps(file: h5py.File) -> list[str]:
    """Return the names of the maps that can be drawn from a file of fields."""
    sticks = all(key in file for key in (*TRACTIONS, "pressure"))
    return [name for name in LOOKS if dataset_of(file, name) or (sticks and name in STICK_MAPS)]


def draw_frames(
    file: h5py.File,
    name: str,
    labels: Mapping[int, str],
    job: Job,
    size: tuple[float, float] = (4.5, 4.0),
    dpi: int = 110,
) -> Iterator[Image.Image]:
    """Draw a saved map of shape (instant, y, x) at each index in `labels`, which has the text of each title, and yield
    the images. All images have one colour scale, and the `size` [inch] with `dpi` points per inch. Only the map and its
    title are drawn anew for each frame."""

    def read(index: int) -> Array:
        if name in STICK_MAPS:
            size = np.hypot(*(file[part][index] for part in TRACTIONS))
            return stick_maps(size, file["pressure"][index], job)[STICK_MAPS.index(name)]
        pressure = file["pressure"][index] if name in OUTSIDE and "pressure" in file else None
        return mask(name, file[dataset_of(file, name)][index], pressure, job)

    ranges = [find_range(read(index)) for index in labels]
    limits = min(low for low, _ in ranges), max(high for _, high in ranges)
    figure, points = Figure(figsize=size, dpi=dpi, layout="constrained"), (file["x"][...], file["y"][...])
    axes, canvas = figure.subplots(), FigureCanvasAgg(figure)
    titles = {index: f"{name.replace('_', ' ')}, {label}" for index, label in labels.items()}
    narrow, first = min(one.size for one in points) <= STRIP, next(iter(labels))
    if narrow:
        panel = _line(name, points, read(first), limits)
    else:
        panel = Panel("maps", *PLACES, colors=_colors(name, points, read(first), limits))
    draw(replace(panel, title=titles[first]), axes)
    lines = (one for one in axes.spines.values() if one.get_visible())
    changing = (*axes.images, *axes.lines, *lines, axes.title)
    style.arrange(figure)  # the layout of the first frame is kept for all
    figure.set_layout_engine(None)
    for one in changing:
        one.set_visible(False)
    figure.savefig(io.BytesIO(), format="raw", dpi=dpi)  # draws on the canvas what does not change
    background = canvas.copy_from_bbox(figure.bbox)
    for one in changing:
        one.set_visible(True)
    for index, title in titles.items():
        if narrow:
            axes.lines[0].set_ydata(_along(read(index)))
        else:
            axes.images[0].set_data(drawn_points(read(index)))
        axes.set_title(title)
        canvas.restore_region(background)
        for one in changing:
            axes.draw_artist(one)
        yield Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")


FRAMES = 200  # most frames of a movie; other instants are left out
SECONDS = 8.0  # duration of a movie with enough frames [s]
FASTEST, SLOWEST = 20, 2  # limits on the frames per second
FFMPEG, KINDS = "ffmpeg", (".gif", ".mp4")


def write_movie(directory: Path, name: str, out: Path | None = None) -> list[Path]:
    """Write a movie of the map `name` over all saved instants, with one colour scale; returns the paths.

    Without `out` the files are NAME.gif in the directory, and NAME.mp4 if ffmpeg exists. Raises InputError for another
    kind of file, an MP4 without ffmpeg, and a map that was not saved.
    """
    targets = [out] if out else [directory / f"{name}{kind}" for kind in KINDS if kind == ".gif" or _find_ffmpeg()]
    if targets[0].suffix not in KINDS:
        raise InputError(f"--movie writes a GIF or an MP4: --out must end in .gif or .mp4, got {targets[0]}")
    if targets[0].suffix == ".mp4" and not _find_ffmpeg():
        raise InputError(f"an MP4 needs the program {FFMPEG} on the path; give an --out that ends in .gif")
    try:
        frames, rate = _draw(directory, name)
    except hdf5.FAILURES as error:
        raise InputError(f"no movie from {directory / outputs.RUN.maps}: {files.reason(error)}") from error
    for target in targets:
        _write_gif(target, frames, rate) if target.suffix == ".gif" else _write_mp4(target, frames, rate)
    return targets


def _find_ffmpeg() -> str | None:
    return shutil.which(FFMPEG)


def _draw(directory: Path, name: str) -> tuple[list[Image.Image], int]:
    """Return the frames, and their rate [1/s]."""
    path = directory / outputs.RUN.maps
    run = PlottedRun(directory)
    with run.open_maps() as file:
        labels = label_frames(run, file)
        there = drawn_maps(file)
        if name not in there or not labels:
            raise InputError(f"{path} has no map of {name}; it has {', '.join(there) or 'none'}")
        chosen = choose_evenly(labels, FRAMES)
        rate = int(np.clip(round(len(chosen) / SECONDS), SLOWEST, FASTEST))
        return list(draw_frames(file, name, chosen, run.job)), rate


def _write_gif(target: Path, frames: Sequence[Image.Image], rate: int) -> None:
    first, *others = frames
    with files.replaced(target, files.is_marked) as movie:
        duration, comment = int(1000 / rate), files.MARK.encode()  # duration of a frame [ms]
        first.save(movie, "GIF", save_all=True, append_images=others, duration=duration, loop=0, comment=comment)


def _write_mp4(target: Path, frames: Sequence[Image.Image], rate: int) -> None:
    """Encode the frames by ffmpeg, with even numbers of points along each side, as players require."""
    width, height = (2 * (side // 2) for side in frames[0].size)
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(rate), "-i", "-"]
    look = ["-pix_fmt", "yuv420p", "-metadata", f"comment={files.MARK}", "-movflags", "+faststart", "-f", "mp4"]
    with files.replaced(target, files.is_marked) as movie:
        command = [_find_ffmpeg() or FFMPEG, "-v", "error", "-y", *raw, *look, f"file:{Path(movie.name).absolute()}"]
        pictures = b"".join(frame.crop((0, 0, width, height)).tobytes() for frame in frames)
        done = subprocess.run(command, input=pictures, capture_output=True, check=False)
        if done.returncode:
            why = (done.stderr.decode(errors="replace").strip().splitlines() or ["no message"])[-1]
            raise InputError(f"{FFMPEG} cannot write {target}: {why}")

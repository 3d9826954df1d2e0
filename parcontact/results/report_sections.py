"""Parts of a report, and its sections on results.

* Parts of a section are sentences, tables, pictures, browsers (which step through the pictures of a map), and
  downloads. All are stored in the page.
* Sections show the results of a run, a friction curve, a sweep or a study; a run and a curve also have their saved
  maps.
* Tables of curves show friction by speed and temperature for each pressure, of one curve or of several side by side,
  and the important lengths, frequencies and moduli.
"""

import base64
import io
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import h5py
import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from .. import capabilities, printed
from ..bands.choice import cut_bands, on_one_grid_of_all
from ..columns import STEADY, SWEEP, UNITS
from ..effects.branches import relaxation_of
from ..errors import InputError
from ..files import hdf5, outputs, tables
from ..job import Job, listing, load
from ..job.listing import answers
from ..march.sanity import excited_bands
from ..physics.prony import complex_modulus
from ..printed import quantity, with_error
from . import band_charts, info, maps, plotted_run, slide, style
from .panels import Panel, draw
from .plotted_run import Fields, PlottedRun, choose_evenly, label_frames, to_load
from .results import PLACES, Results, read_cases

SIZE = (4.2, 2.9)  # size of a panel, half the width of a laptop's screen [inch]
RC = {**style.RC, "svg.fonttype": "path"}  # letters as shapes, independent of fonts

Picture = tuple[str, str]  # data URI, and caption
Browser = tuple[str, Sequence[Picture], int]  # name of a map, its pictures, and the index of the first shown
Download = tuple[str, str, int]  # a file stored in the page: its name, data URI and size [bytes]


@dataclass(frozen=True)
class ReportTable:
    """A table of a report: names of columns, and rows of texts."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""


@dataclass(frozen=True)
class ReportSection:
    """A section of a report: a heading and contents, shown in the order of the fields. `texts` are shown verbatim."""

    title: str
    sentences: Sequence[str] = ()
    tables: Sequence[ReportTable] = ()
    pictures: Sequence[Picture] = ()
    browsers: Sequence[Browser] = ()
    texts: Sequence[tuple[str, str]] = ()
    downloads: Sequence[Download] = ()

    def __bool__(self) -> bool:
        """Return True if the section has contents."""
        return any((self.sentences, self.tables, self.pictures, self.browsers, self.texts, self.downloads))

    def without(self, places: Sequence[str]) -> "ReportSection":
        """Return the section with the directories `places` removed from the paths in its sentences and tables, so that
        a report does not show the directories of this machine."""

        def shorten(text: str) -> str:
            for place in places:
                text = text.replace(place, "")
            return text

        tables = [replace(one, rows=[[shorten(cell) for cell in row] for row in one.rows]) for one in self.tables]
        return replace(self, sentences=[shorten(text) for text in self.sentences], tables=tables)


@dataclass(frozen=True)
class Chapter:
    """A chapter of a report about one output directory; `headline` is a sentence with the results."""

    title: str
    directory: Path
    kind: str
    sections: Sequence[ReportSection]
    headline: str = ""


def draw_panel(panel: Panel, caption: str = "") -> Picture:
    """Return a picture of one panel, as SVG. By default the caption of the picture names the axes of the panel."""
    file = io.BytesIO()
    with style.drawing(RC):
        figure = Figure(figsize=SIZE, layout="constrained")
        axes = figure.subplots()
        draw(panel, axes)
        (extra,) = style.place_legends([[axes]])
        style.set_height(figure, SIZE[1] + extra)
        figure.savefig(file, format="svg", dpi=style.DPI, metadata={"Date": None})
    caption = caption or f"{panel.y.name} over {panel.x.name}".replace("\n", " ")
    return to_uri(file.getvalue(), "image/svg+xml"), caption


def embed_file(path: Path) -> Download:
    """Return a file as a download that is stored in the page."""
    data = path.read_bytes()
    return path.name, to_uri(data, "text/csv"), len(data)


def to_uri(data: bytes, kind: str) -> str:
    """Return data as a data URI."""
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"


MOST = 60  # most rows of a table
PLACE_DIGITS = 6  # significant digits of speeds, pressures and temperatures that count as equal
Place = tuple[float, float, float]  # speed [m/s], pressure [Pa], temperature [deg C] (NaN: not known)


def friction_tables(curve: Results) -> list[ReportTable]:
    """Return a table of friction for each pressure, with a row for each speed and a column for each temperature."""
    cells = {_round(one.at, curve.temperature): "not solved" for one in tables.read(curve.path)}
    cells = _cells(curve) | cells
    degrees, found = list(dict.fromkeys(place[2] for place in sorted(cells, key=_order))), []
    for pressure in dict.fromkeys(place[1] for place in sorted(cells, key=_order)):
        speeds = sorted({place[0] for place in cells if place[1] == pressure})
        friction = [[cells.get((speed, pressure, each), "–") for each in degrees] for speed in speeds]
        rows = [[quantity(speed, "m/s"), *values] for speed, values in zip(speeds, friction, strict=True)]
        head = ["velocity", *(f"at {each:g} °C" if each > -math.inf else "friction" for each in degrees)]
        found.append(ReportTable(head, rows[:MOST], f"friction under {quantity(pressure, 'Pa')}"))
    return found


def compared_table(directories: Sequence[Path], names: Sequence[str]) -> list[ReportTable]:
    """Return a list with one table of the friction of several curves, called `names`, at the points that two or more
    curves have; an empty list if there is no such point."""
    each = [_cells(Results(one, "steady")) if Results(one).has(outputs.STEADY.table) else {} for one in directories]
    places = sorted({place for cells in each for place in cells}, key=_order)
    shared = [place for place in places if sum(place in cells for cells in each) > 1]
    warm = any(place[2] > -math.inf for place in shared)
    rows = []
    for speed, pressure, degrees in shared[:MOST]:
        at = [quantity(speed, "m/s"), quantity(pressure, "Pa"), *([f"{degrees:g} °C"] if warm else [])]
        rows.append([*at, *(cells.get((speed, pressure, degrees), "–") for cells in each)])
    head = ["velocity", "pressure", *(["temperature"] if warm else []), *names]
    more = f", the first {MOST} of {len(shared)} points" if len(shared) > MOST else ""
    return [ReportTable(head, rows, f"friction side by side{more}")] if rows else []


def _cells(curve: Results) -> dict[Place, str]:
    """Return the friction with its error at each point of a curve."""
    columns = curve.table
    count = len(columns["friction"])
    degrees, errors = (columns.get(name, [math.nan] * count) for name in ("temperature", "error_friction"))
    found = zip(columns["velocity"], columns["pressure"], degrees, columns["friction"], errors, strict=True)
    return {_round(place, curve.temperature): with_error(mu, mu * error) for *place, mu, error in found}


def _round(place: Sequence[float], given: float) -> Place:
    """Return a point with values that count as equal as equal numbers; a temperature that is not known is -infinity."""
    speed, pressure, degrees = (float(f"{value:.{PLACE_DIGITS}g}") for value in place)
    degrees = given if math.isnan(degrees) else degrees
    return speed, pressure, -math.inf if math.isnan(degrees) else degrees


def _order(place: Place) -> tuple[float, float, float]:
    speed, pressure, degrees = place
    return degrees, pressure, speed


def scales_table(curve: Results) -> list[ReportTable]:
    """Return a table of the lengths, frequencies and moduli that matter for a curve; empty if the job's files are
    gone."""
    if (path := curve.job_file) is None:
        return []
    with suppress(InputError):
        job = load(path)
        rows = [*_lengths(job)]
        whole = on_one_grid_of_all(job)
        for one in excited_bands(whole, (job.steady.temperatures if job.steady else None) or ()):
            body = whole if one.temperature is None else whole.at_temperature(one.temperature)
            at = "" if one.temperature is None else f" at {one.temperature:g} °C"
            rows.append((f"frequencies that the job excites{at}", write_span(one.band, "Hz")))
            rows.append((f"shear moduli |G| at these frequencies{at}", write_span(_moduli(body, one.band), "Pa")))
        if (measured := getattr(job.material.fitted, "band", None)) is not None:
            rows.append(("measured frequencies, at the reference temperature", write_span(measured, "Hz")))
        return [ReportTable(("what matters", "range"), rows, "lengths, frequencies and moduli")]
    return []


def _lengths(job: Job) -> list[tuple[str, str]]:
    if job.bands is not None:
        ends = cut_bands(job).spectrum.ends
        return [("waves of the surface", write_span((2 * math.pi / ends[0], 2 * math.pi / ends[1]), "m"))]
    waves = ([getattr(part, f"{end}_wavelength", None) for end in ("long", "short")] for part in job.surface)
    rows = [("waves of the surface", write_span([end for end in each if end], "m")) for each in waves if all(each)]
    return [*rows, ("cell of the grid", quantity(job.grid.longest_cell, "m"))]


def _moduli(job: Job, band: tuple[float, float]) -> tuple[float, float]:
    """Return the magnitude of the shear modulus [Pa] at both ends of a band of frequencies [Hz]."""
    series = relaxation_of(job.material)
    omega = 2 * math.pi * np.array(band)
    low, high = np.abs(complex_modulus(omega, series.modulus_inf, series.moduli, series.relaxation_times)).tolist()
    return low, high


def write_span(ends: Sequence[float], unit: str) -> str:
    """Return the ends of a range as text, with their unit: 3 mm to 25 µm."""
    return " to ".join(quantity(end, unit) for end in ends)


STUDY_PICTURES = {outputs.STUDY_PICTURE: "errors over refinement and over time"}
INTERFACE = ("friction_viscous", "friction_interface")
SHOWN = (
    *("friction", "contact_area", "approach", "mean_gap", "max_pressure"),
    *(name for names in capabilities.stated("SHOWN") for name in names),
)
POINTS = (
    *("velocity", "temperature", "pressure", "friction", "error_friction", *INTERFACE),
    *("contact_area_corrected", "error_area", "mean_gap", "max_pressure"),
)
DIGITS = 5
MOST_ROWS = 200  # most rows of a table
MOST_MAPS = 24  # most pictures of one map
MAP_DPI = 100
COLORS = 256  # colours of a picture, with less than half the bytes of true colours
MAP_SIZE = (4.2, 3.5)  # size of the picture of a map [inch]


def describe_run(directory: Path) -> ReportSection:
    """Return the section on a run: histories, extreme and last values, and maps at saved instants."""
    run = PlottedRun(directory)
    axis, area = plotted_run.to_contact_area(run.columns["contact_area_corrected"], run.area * run.free)
    columns, units = {**run.table, "contact_area": area.tolist()}, {**UNITS, "contact_area": axis.unit}
    known = {name: [value for value in columns.get(name, ()) if value == value] for name in SHOWN}
    rows = [
        (name.replace("_", " "), *map(format_cell, (values[-1], min(values), max(values))), units.get(name, ""))
        for name, values in known.items()
        if values and (run.job.directions or not name.startswith("friction"))
    ]
    numbers = ReportTable(("measure", "last", "smallest", "largest", "unit"), rows)
    sentences = [
        *info.describe_run_in_words(run),
        *info.describe_theory(directory, run.job.history, run.job.grid.dx),
        info.describe_settings(directory),
    ]
    found = plotted_run.panels_of_run(run)
    unnamed = [replace(one, shades=[replace(shade, name="") for shade in one.shades]) for one in found[1:]]
    pictures = [*map(draw_panel, [*found[:1], *unnamed])]
    for known in answers("results", "PICTURES"):
        pictures += _stored(directory, known)
    return ReportSection("Results of the run", list(filter(None, sentences)), [numbers], pictures, browse_run(run))


def _stored(directory: Path, captions: Mapping[str, str]) -> list[Picture]:
    """Return the pictures of a directory that exist, by the names of their files and with their captions."""
    paths = {directory / name: caption for name, caption in captions.items()}
    there = {path: caption for path, caption in paths.items() if path.is_file() and not path.is_symlink()}
    return [(to_uri(path.read_bytes(), "image/png"), caption) for path, caption in there.items()]


def describe_curve(directory: Path) -> ReportSection:
    """Return the section on a friction curve: its points and their maps."""
    curve = Results(directory, "steady")
    columns = curve.table
    names = [name for name in POINTS if name in columns]
    head = [_add_unit(name).replace("_", " ") for name in names]
    table = _shorten(head, list(zip(*(columns[name] for name in names), strict=True)))
    pictures = [draw_panel(panel) for panel in band_charts.panels_of_curve(directory)]
    states = partial(_label_states, curve.free_area)
    browsers = _browse_file(curve, outputs.STEADY.maps, states, curve.job) if curve.job else []
    return ReportSection("Friction curve", (), [table, *_list_main_bands(curve)], pictures, browsers)


def describe_friction(directory: Path) -> ReportSection:
    """Return the section that begins the chapter on a friction curve: friction by speed and temperature, points that
    are not solved with the reasons, and the lengths, frequencies and moduli that matter."""
    curve = Results(directory, "steady")
    sentences = [f"The curve has {curve.lost}."] if curve.lost else []
    sentences += [f"{text[:1].upper()}{text[1:]}." for text in curve.unfinished if text != curve.lost]
    return ReportSection("Friction", sentences, [*friction_tables(curve), *scales_table(curve)])


def _list_main_bands(curve: Results) -> list[ReportTable]:
    """Return a table of the band with most friction at each point of a curve in bands."""
    if "velocity" not in (columns := curve.read(outputs.BANDS)):  # none, or one of a history
        return []
    names = [name for name in PLACES if any(value == value for value in columns[name])]
    points: dict[tuple[str, ...], list[int]] = {}
    for row in range(len(columns["velocity"])):
        points.setdefault(tuple(format_cell(columns[name][row]) for name in names), []).append(row)
    found = []
    for place, rows in points.items():
        friction = [columns["friction"][row] for row in rows]
        most = rows[friction.index(max(friction))]
        waves = write_span([columns[f"{end}_wavelength"][most] for end in ("long", "short")], "m")
        share = f"{100 * max(friction) / sum(friction):.0f} %" if sum(friction) > 0.0 else "–"
        found.append((*place, waves, share))
    table = _shorten([*map(_add_unit, names), "waves", "share of friction"], found)
    captions = filter(None, ["the band with most of the friction", table.caption])
    return [replace(table, caption="; ".join(captions))]


def describe_sweep(directory: Path) -> ReportSection:
    sweep = Results(directory, "sweep")
    rows = read_cases(sweep.points)
    used = [name for name in (rows[0] if rows else ()) if any(format_cell(row[name]) not in ("", "–") for row in rows)]
    table = _shorten(list(map(_add_unit, used)), [[row[name] for name in used] for row in rows])
    sentences = list(filter(None, [info.describe_settings(directory), *sweep.failed_cases(MOST_ROWS)]))
    return ReportSection("Sweep", sentences, [table], [*map(draw_panel, band_charts.panels_of_sweep(directory))])


def _add_unit(name: str) -> str:
    """Return the name of a column of a curve or a sweep, or a key of a job, with its unit: `pull_off [N]`,
    `history.0.velocity [m/s]`."""
    known = {column.name: column.unit for column in (*SWEEP, *STEADY)} | dict.fromkeys(slide.ERRORS, "relative")
    unit = known.get(name) or listing.unit_of_path(name)
    return f"{name} [{unit}]" if unit else name


def describe_study(directory: Path) -> ReportSection:
    """Return the section on a study: settings, errors and costs."""
    study = Results(directory, "study")
    rows = study.study_rows
    table = _shorten(list(rows[0]) if rows else [], [list(row.values()) for row in rows])
    sentences = study.sentences_of_study or ["The study is not finished."]
    return ReportSection("Cost of accuracy", sentences, [table], _stored(directory, STUDY_PICTURES))


def _shorten(head: Sequence[str], rows: Sequence[Sequence[object]]) -> ReportTable:
    """Return a table with at most MOST_ROWS rows."""
    more = f"the first {MOST_ROWS} of {len(rows)} rows; all are in the data" if len(rows) > MOST_ROWS else ""
    return ReportTable(head, [[format_cell(value) for value in row] for row in rows[:MOST_ROWS]], more)


def format_cell(value: object) -> str:
    """Return a number in few digits, a dash for NaN, or a word."""
    if isinstance(value, float):
        return "–" if math.isnan(value) else f"{value:.{DIGITS}g}"
    return str(value)


def browse_run(run: PlottedRun) -> list[Browser]:
    """Return browsers of all saved maps of a run, which step through time."""
    return _browse_file(run, outputs.RUN.maps, partial(label_frames, run), run.job, run.telling_step)


def _browse_file(
    results: Results, name: str, label: Callable[[h5py.File], dict[int, str]], job: Job, step: int | None = None
) -> list[Browser]:
    """Return browsers of maps, which start after a `step` or with the last map; none without the file. Raises
    InputError for a damaged file."""
    try:
        with results.open_maps(name) as file, style.drawing(RC):
            labels = choose_evenly(label(file), MOST_MAPS)
            chosen = Fields(file, until=step).chosen if step is not None else max(labels, default=0)
            names = maps.drawn_maps(file) if labels else []
            return [_browse_map(file, name, labels, job, chosen) for name in names]
    except hdf5.FAILURES:
        return []


def _browse_map(file: h5py.File, name: str, labels: dict[int, str], job: Job, chosen: int) -> Browser:
    counted = printed.with_bar(list(labels), f"maps of {name}", "map")
    images = _in_few_colors(maps.draw_frames(file, name, labels, job, MAP_SIZE, MAP_DPI))
    pictures = [(to_uri(image, "image/png"), labels[index]) for index, image in zip(counted, images, strict=True)]
    return name, pictures, max(sum(index <= chosen for index in labels) - 1, 0)


def _in_few_colors(images: Iterator[Image.Image]) -> Iterator[bytes]:
    """Yield a PNG of each image with the same COLORS colours: those of the first, whose bar of colours has all."""
    few: Image.Image | None = None
    for image in images:
        if few is None:
            few = image.quantize(COLORS, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
        png = io.BytesIO()
        image.quantize(palette=few, dither=Image.Dither.NONE).save(png, "png")
        yield png.getvalue()


def _label_states(area: float, file: h5py.File) -> dict[int, str]:
    """Return speeds and loads of the saved states as text: forces on the box of a free scene of this `area` [m^2]."""
    speeds = file["velocity"][...]
    axis, loads = to_load(file["load"][...], area)
    warm = [f", {t:g} °C" for t in file["temperature"][...]] if "temperature" in file else [""] * speeds.size
    known = np.flatnonzero(~np.isnan(speeds)).tolist()
    return {k: f"{printed.quantity(speeds[k], 'm/s')}, {printed.quantity(loads[k], axis.unit)}{warm[k]}" for k in known}

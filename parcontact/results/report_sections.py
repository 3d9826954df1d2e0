"""Sections of a report: results of a run, friction curve, sweep or study with maps; the rigid surface; the material."""

import io
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

import h5py
import numpy as np
from PIL import Image

from .. import capabilities, printed, streams
from ..bands.band import Band
from ..bands.choice import cut_bands, describe_cut, on_one_grid_of_all
from ..columns import STEADY, SWEEP, UNITS
from ..effects.relaxation import relaxation_of
from ..errors import InputError
from ..files import hdf5, outputs
from ..job import Dma, Indenter, Job, Zener, listing
from ..job.listing import answers
from ..job.meaning import excited_band
from ..march import rigid_surface
from ..march.measured_range import excited_bands
from ..parallel.fft import FFT
from ..parallel.slab import Slab
from ..physics import surface_statistics
from ..physics.prony import complex_modulus
from . import band_charts, info, maps, plotted_run, slide, style, surface_summary
from .curve_tables import (
    RC,
    Browser,
    Picture,
    ReportSection,
    ReportTable,
    draw_panel,
    friction_tables,
    scales_table,
    to_uri,
)
from .panels import Axis, Line, Panel, Shade
from .plotted_run import Fields, PlottedRun, choose_evenly, label_frames, to_load
from .results import PLACES, Results, read_cases

STUDY_PICTURES = {"convergence.png": "errors over refinement and over time"}
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
    columns = run.table
    known = {name: [value for value in columns.get(name, ()) if value == value] for name in SHOWN}
    rows = [
        (_to_words(name), *map(format_cell, (values[-1], min(values), max(values))), UNITS.get(name, ""))
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
    pictures = [*map(draw_panel, [*found[:1], *unnamed]), *_more_pictures(directory)]
    return ReportSection("Results of the run", list(filter(None, sentences)), [numbers], pictures, browse_run(run))


def _more_pictures(directory: Path) -> list[tuple[str, str]]:
    """Return the pictures of capabilities that exist."""
    known = {directory / name: words for found in answers("results", "PICTURES") for name, words in found.items()}
    there = {path: words for path, words in known.items() if path.is_file() and not path.is_symlink()}
    return [(to_uri(path.read_bytes(), "image/png"), words) for path, words in there.items()]


def describe_curve(directory: Path) -> ReportSection:
    """Return the section on a friction curve: its points and their maps."""
    curve = Results(directory, "steady")
    columns = curve.table
    names = [name for name in POINTS if name in columns]
    head = [_to_words(_add_unit(name)) for name in names]
    table = _shorten(head, list(zip(*(columns[name] for name in names), strict=True)))
    pictures = [draw_panel(panel) for panel in band_charts.panels_of_curve(directory)]
    states = partial(_label_states, curve.free_area)
    browsers = _browse_file(curve, outputs.STEADY.maps, states, curve.job) if curve.job else []
    return ReportSection("Friction curve", (), [table, *_list_main_bands(curve)], pictures, browsers)


def describe_friction(directory: Path) -> ReportSection:
    """Return the first section on a friction curve: friction by speed and temperature, unsolved points and why, and the
    lengths, frequencies and moduli that matter."""
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
        waves = " to ".join(printed.quantity(columns[f"{end}_wavelength"][most], "m") for end in ("long", "short"))
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
    settings, failed = info.describe_settings(directory), sweep.failed_cases(MOST_ROWS)
    sentences = list(filter(None, [settings, *failed]))
    return ReportSection(
        "Sweep", sentences, [table], [draw_panel(panel) for panel in band_charts.panels_of_sweep(directory)]
    )


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
    pictures = [
        (to_uri((directory / name).read_bytes(), "image/png"), caption)
        for name, caption in STUDY_PICTURES.items()
        if (directory / name).is_file()
    ]
    return ReportSection("Cost of accuracy", sentences, [table], pictures)


def _to_words(name: str) -> str:
    return name.replace("_", " ")


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
    counted = streams.with_bar(list(labels), f"maps of {name}", "map")
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


MOST_POINTS = 2**22  # most points of a surface that is computed for a report


def road_section(job: Job) -> ReportSection:
    """Return the section on the surface of a job, computed again; only its keys if its files are gone or it is too
    large."""
    shapes = ReportTable(
        ("shape",), [(listing.listed_line(part),) for part in job.surface], "shapes, whose heights add up"
    )
    if job.bands is not None:
        return _describe_bands(job, shapes)
    if job.grid.nx * job.grid.ny == 1:  # a job in bands without its files
        return ReportSection("Surface", ["The surface cannot be computed again: the files of the job do not exist."])
    if job.grid.nx * job.grid.ny > MOST_POINTS:
        return ReportSection(
            "Surface", ["The surface has too many points to be computed again for a report."], [shapes]
        )
    slab = Slab.alone(*job.grid.points)
    try:
        made, remarks = rigid_surface.make_surface(job, FFT(slab))
    except InputError as error:
        return ReportSection("Surface", [f"The surface cannot be made anew: {error}."], [shapes])
    heights, sentences = made.heights((0.0, 0.0), slab.empty()), [*remarks.notes, *map(str, remarks.doubts)]
    found = surface_statistics.surface_statistics(heights, job.grid.size)
    if not found.rms_height:
        return ReportSection("Surface", [*sentences, "The surface is flat."], [shapes])
    waves = any(not isinstance(part, Indenter) for part in job.surface)
    tables = [
        shapes,
        *([ReportTable(("on the grid of the job", "value"), surface_summary.list_statistics(found))] if waves else []),
    ]
    return ReportSection("Surface", sentences, tables, _draw(surface_summary.Sketch(heights, job.grid.size, found)))


def _describe_bands(job: Job, shapes: ReportTable) -> ReportSection:
    """Return the section on the bands of a job, and the surface of the coarsest one."""
    try:
        cut = cut_bands(job)
        setup = Band(job, cut, 0, 0).setup
    except InputError as error:
        return ReportSection("Surface", [f"The surface cannot be made anew: {error}."], [shapes])
    rows = []
    for band in range(cut.count):
        ends = " to ".join(printed.quantity(end, "m") for end in cut.wavelengths(band))
        rows.append((ends, f"{cut.rms_slope(band):.3g}", f"{cut.rms_slope(band, 0):.3g}"))
    bands = ReportTable(("waves", "rms slope", "with all longer waves"), rows, "bands, each on its own grid")
    heights = setup.surface.heights((0.0, 0.0), setup.slab.empty()) * setup.units.height
    found = surface_statistics.surface_statistics(heights, setup.grid.size)
    pictures = _draw(surface_summary.Sketch(heights, setup.grid.size, found), ", coarsest band")
    tables = [shapes, bands, ReportTable(("of the coarsest band", "value"), surface_summary.list_statistics(found))]
    return ReportSection("Surface", [f"{text}." for text in describe_cut(cut, job)], tables, pictures)


def _draw(sketch: surface_summary.Sketch, of: str = "") -> list[Picture]:
    return [draw_panel(panel, f"{caption}{of}") for caption, panel in surface_summary.panels_of(sketch).items()]


DECADES = 1.5  # range of a picture beyond the relaxation times [decades]
MODULI_POINTS = 400  # number of points of a line
CAPTION = "{} over frequency, at the temperature of the job"


def material_section(job: Job) -> ReportSection:
    """Return the section on the material of a job at its temperature."""
    if job.bands is not None:
        with suppress(InputError):  # its files no longer exist
            job = on_one_grid_of_all(job, cut_bands(job))
    series = relaxation_of(job.material)
    instant = series.modulus_inf + float(np.sum(series.moduli))
    rows = [
        ("long-term shear modulus", printed.quantity(series.modulus_inf, "Pa", 4)),
        ("instantaneous shear modulus", printed.quantity(instant, "Pa", 4)),
        ("Poisson's ratio", f"{job.material.poisson:g}"),
        ("relaxing branches", str(series.moduli.size)),
        *_describe_temperature(job),
    ]
    if job.included:
        rows.append(("included from", job.included))
    tables = [ReportTable(("property", "value"), rows)]
    if not series.moduli.size:
        return ReportSection("Material", tables=tables)
    branches = zip(series.relaxation_times, series.moduli, strict=True)
    listed = [(printed.quantity(float(tau), "s"), printed.quantity(float(modulus), "Pa")) for tau, modulus in branches]
    tables.append(ReportTable(("relaxation time", "modulus"), listed, "G(t) = G_inf + sum of modulus exp(-t/time)"))
    if (excited := _list_bands(job)).rows:
        tables.append(excited)
    return ReportSection(
        "Material",
        tables=tables,
        pictures=[draw_panel(panel, CAPTION.format(panel.y.name)) for panel in _over_frequency(job)],
    )


def _describe_temperature(job: Job) -> Iterator[tuple[str, str]]:
    found = job.material.fitted
    if isinstance(given := job.material.given, Dma):
        yield "fitted to", str(given.path)
    if not isinstance(found, Zener):
        return
    if found.shift is not None:
        reference = found.shift.made.reference
        temperature = reference if found.temperature is None else found.temperature
        yield "temperature", f"{temperature:g} °C (reference {reference:g} °C)"
        yield "shift factor a_T", f"{found.time_factor:.4g}"
        if found.shift.vertical is not None:
            yield "vertical shift factor b_T", f"{found.modulus_factor:.4g}"
    if found.band is not None:
        yield "measured frequencies, reduced to the reference", _write_band(found.band)
    if found.temperatures is not None:
        yield "measured temperatures", f"{found.temperatures[0]:g} to {found.temperatures[1]:g} °C"


def _list_bands(job: Job) -> ReportTable:
    """Return a table of the frequencies that sliding excites at each temperature."""
    found = excited_bands(job, (job.steady.temperatures if job.steady else None) or ())
    degrees = ("–" if one.temperature is None else f"{one.temperature:g} °C" for one in found)
    ranges = ((f"{one.factor:.3g}", _write_band(one.band), _write_band(one.reduced)) for one in found)
    rows = [(degree, *others) for degree, others in zip(degrees, ranges, strict=True)]
    caption = "frequencies of the passing waves of the surface, at all velocities of the job"
    return ReportTable(("temperature", "a_T", "excited by the job", "reduced to the reference"), rows, caption)


def _write_band(band: tuple[float, float]) -> str:
    return f"{printed.quantity(band[0], 'Hz')} to {printed.quantity(band[1], 'Hz')}"


def _over_frequency(job: Job) -> list[Panel]:
    """Return the panels of storage and loss modulus, and of the loss tangent, at all relaxation times and frequencies
    that the job excites."""
    series, band = relaxation_of(job.material), excited_band(job)
    natural = np.log10(1.0 / (2 * math.pi * series.relaxation_times))
    seen = [natural.min() - DECADES, natural.max() + DECADES, *map(math.log10, band or ())]
    frequency = np.logspace(min(seen), max(seen), MODULI_POINTS)
    omega = 2 * math.pi * frequency
    value = np.asarray(complex_modulus(omega, series.modulus_inf, series.moduli, series.relaxation_times))
    moduli = [Line("G' storage", frequency, value.real), Line("G'' loss", frequency, value.imag, style.line(1))]
    shades = [Shade("excited by the job", *band)] if band else []
    x, tangent = Axis("frequency", "Hz"), [Line("", frequency, value.imag / value.real)]
    return [
        Panel("moduli", x, Axis("shear modulus", "Pa"), moduli, shades=shades, log_x=True, log_y=True),
        Panel("tangent", x, Axis("loss tangent tan δ"), tangent, shades=shades, log_x=True),
    ]

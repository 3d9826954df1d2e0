"""Sections on results of a run, a friction curve, a sweep or a study, with browsers of their maps."""

import io
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import h5py
import numpy as np
from PIL import Image

from .. import capabilities, progress
from ..columns import STEADY, SWEEP, UNITS
from ..job import Job
from ..job.added_sections import answers
from ..storage import hdf5
from . import (
    charts,
    curve_charts,
    cycles,
    histories,
    maps,
    prefixes,
    slide,
    style,
    sweep_charts,
    theory_comparison,
    theory_settings,
)
from .curve_tables import friction_tables, scales_table
from .page_parts import RC, Browser, ReportSection, ReportTable, draw_chart, to_uri
from .plotted_run import Fields, PlottedRun, choose_evenly, label_frames, to_load
from .results import MAPS, STATES, Results, read_cases

STUDY_PICTURES = {"convergence.png": "errors over refinement and over time"}
INTERFACE = ("friction_viscous", "friction_interface")
SHOWN = (
    *("friction", "contact_area", "approach", "mean_gap", "max_pressure"),
    *(name for names in capabilities.offers("columns", "SHOWN") for name in names),
)
POINTS = (
    *("velocity", "temperature", "pressure", "friction", "error_friction", *INTERFACE),
    *("contact_area_corrected", "error_area", "mean_gap", "max_pressure"),
)
PLACE = {"velocity": "m/s", "pressure": "Pa", "temperature": "°C"}  # coordinates of a point of a curve in bands
DIGITS = 5
MOST_ROWS = 200  # most rows of a table
MOST_MAPS = 24  # most pictures of one map
MAP_DPI = 100
COLORS = 256  # colours of a picture, with less than half the bytes of true colours
MAP_SIZE = (4.2, 3.5)  # size of the picture of a map [inch]


def describe_run(directory: Path) -> ReportSection:
    """Return the section on a run: histories, extreme and last values, and maps over time."""
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
        *slide.describe_slide(run.job.history, run.job.initial, run.job.grid.dx, columns),
        *cycles.describe_cycles(run.job, columns),
        *(text for sentences in answers("results", "sentences") for text in sentences(run)),
        *theory_comparison.describe_theory(directory, run.job.history, run.job.grid.dx),
        theory_settings.describe_settings(directory),
    ]
    found = histories.chart_histories(run)
    pictures = [draw_chart(chart) for chart in (*found[:1], *map(charts.hide_stages, found[1:]))]
    pictures += _more_pictures(directory)
    return ReportSection("Results of the run", list(filter(None, sentences)), [numbers], pictures, browse_run(run))


def _more_pictures(directory: Path) -> list[tuple[str, str]]:
    """Return the pictures of capabilities that exist."""
    known = {directory / name: words for found in answers("results", "PICTURES") for name, words in found.items()}
    there = {path: words for path, words in known.items() if path.is_file() and not path.is_symlink()}
    return [(to_uri(path.read_bytes(), "image/png"), words) for path, words in there.items()]


def describe_curve(directory: Path) -> ReportSection:
    """Return the section on a friction curve: its points and their maps."""
    curve = Results(directory, "curve")
    columns = curve.table
    names = [name for name in POINTS if name in columns]
    units_of = columns.units | dict.fromkeys(slide.ERRORS, "relative")
    head = [f"{_to_words(name)} [{units_of[name]}]" if units_of[name] else _to_words(name) for name in names]
    table = _shorten(head, list(zip(*(columns[name] for name in names), strict=True)))
    pictures = [draw_chart(chart) for chart in curve_charts.chart_steady(directory)]
    states = partial(_label_states, curve.free_area)
    browsers = _browse_file(curve, STATES, states, curve.job) if curve.job else []
    return ReportSection("Friction curve", (), [table, *_list_main_bands(curve)], pictures, browsers)


def describe_friction(directory: Path) -> ReportSection:
    """Return the first section on a friction curve: friction over speed and temperature, what is not solved and why,
    and the lengths, frequencies and moduli that matter."""
    curve = Results(directory, "curve")
    sentences = [f"The curve has {curve.lost}."] if curve.lost else []
    sentences += [f"{text[:1].upper()}{text[1:]}." for text in curve.unfinished if text != curve.lost]
    return ReportSection("Friction", sentences, [*friction_tables(curve), *scales_table(curve)])


def _list_main_bands(curve: Results) -> list[ReportTable]:
    """Return a table of the band with most friction at each point of a curve in bands."""
    if not (columns := curve.read("bands.csv")):
        return []
    if "velocity" not in columns:  # of a history
        return []
    names = [name for name in PLACE if any(value == value for value in columns[name])]
    points: dict[tuple[str, ...], list[int]] = {}
    for row in range(len(columns["velocity"])):
        points.setdefault(tuple(format_cell(columns[name][row]) for name in names), []).append(row)
    found = []
    for place, rows in points.items():
        friction = [columns["friction"][row] for row in rows]
        most = rows[friction.index(max(friction))]
        waves = " to ".join(prefixes.quantity(columns[f"{end}_wavelength"][most], "m") for end in ("long", "short"))
        share = f"{100 * max(friction) / sum(friction):.0f} %" if sum(friction) > 0.0 else "–"
        found.append((*place, waves, share))
    head = [f"{_to_words(name)} [{unit}]" for name, unit in PLACE.items() if name in names]
    table = _shorten([*head, "waves", "share of friction"], found)
    captions = filter(None, ["the band with most of the friction", table.caption])
    return [replace(table, caption="; ".join(captions))]


def describe_sweep(directory: Path) -> ReportSection:
    sweep = Results(directory, "sweep")
    rows = read_cases(sweep.points)
    used = [name for name in (rows[0] if rows else ()) if any(format_cell(row[name]) not in ("", "–") for row in rows)]
    table = _shorten(list(map(_add_unit, used)), [[row[name] for name in used] for row in rows])
    settings, failed = theory_settings.describe_settings(directory), sweep.failed_cases(MOST_ROWS)
    sentences = list(filter(None, [settings, *failed]))
    return ReportSection(
        "Sweep", sentences, [table], [draw_chart(chart) for chart in sweep_charts.chart_sweep(directory)]
    )


def _add_unit(name: str) -> str:
    """Return the name of a column of a sweep, or a key of its job, with its unit: `pull_off [N]`, `history.0.velocity
    [m/s]`."""
    known = (
        {column.name: column.unit for column in (*SWEEP, *STEADY)}
        | sweep_charts.UNITS
        | dict.fromkeys(slide.ERRORS, "relative")
    )
    unit = known.get(name) or sweep_charts.UNITS.get(name.split(".")[-1].removesuffix("s"), "")
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
    """Return browsers of all saved maps of a run over time."""
    return _browse_file(run, MAPS, partial(label_frames, run), run.job, run.telling_step)


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
    counted = progress.with_bar(list(labels), f"maps of {name}", "map")
    images = zip(maps.draw_frames(file, name, labels, job, MAP_SIZE, MAP_DPI), counted, strict=True)
    first = max(sum(index <= chosen for index in labels) - 1, 0)
    return name, [(to_uri(to_small_png(image), "image/png"), labels[index]) for image, index in images], first


def to_small_png(image: Image.Image) -> bytes:
    """Return a PNG with COLORS colours, chosen so that rare colours are kept."""
    png = io.BytesIO()
    few = image.quantize(COLORS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    few.save(png, "png", optimize=True)
    return png.getvalue()


def _label_states(area: float, file: h5py.File) -> dict[int, str]:
    """Return speeds and loads of the saved states as text: forces on the box of a free scene of this `area` [m^2]."""
    speeds = file["velocity"][...]
    axis, loads = to_load(file["load"][...], area)
    warm = [f", {t:g} °C" for t in file["temperature"][...]] if "temperature" in file else [""] * speeds.size
    known = np.flatnonzero(~np.isnan(speeds)).tolist()
    return {
        k: f"{prefixes.quantity(speeds[k], 'm/s')}, {prefixes.quantity(loads[k], axis.unit)}{warm[k]}" for k in known
    }

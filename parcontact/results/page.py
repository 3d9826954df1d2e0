"""`parcontact report`: the page, its chapters, and sections on the job.

* The page is one HTML file, which loads no other files.
* Each output directory with a run, a friction curve, a sweep or a study has a chapter. Several directories have another
  chapter that compares them.
* The sections of a chapter show the job, its rigid surface and its material; errors and costs; warnings; the program,
  the machine and the runs; and references to cite. Warnings, estimated errors and counts are read from run.log and
  steady.log.
"""

import json
import math
import re
import stat
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from .. import job as jobs
from .. import printed
from ..bands.band import Band
from ..bands.choice import cut_bands, describe_cut, on_one_grid_of_all
from ..columns import TABLES
from ..effects.branches import relaxation_of
from ..errors import InputError
from ..files import files, hdf5, outputs
from ..files.hdf5 import PROGRAM
from ..files.recorder import WARNING, log_lines
from ..job import Dma, Indenter, Job, Zener, listing
from ..job.listing import plain_data
from ..job.meaning import excited_band
from ..job.reading import CASES, shown_job
from ..march import rigid_surface
from ..march.sanity import excited_bands
from ..parallel.fft import FFT
from ..parallel.slab import Slab
from ..physics.prony import complex_modulus
from ..physics.roughness import surface_statistics
from ..printed import name_cases
from . import info, inputs, plots, report_sections, style
from .panels import Axis, Line, Panel, Shade
from .report_sections import Chapter, Picture, ReportSection, ReportTable, compared_table, draw_panel, embed_file
from .results import Results, swept_keys
from .slide import ERRORS

COUNTS = "counts on root: "
ESTIMATE = "estimated error of "
MACHINE = re.compile(r"parcontact |machine: |batch job: |\d+ ranks?, ")  # beginnings of lines about the machine


BEYOND = "; more than the "  # in an estimate that exceeds numerics.accuracy


@dataclass(frozen=True)
class Log:
    """Contents of the logs of a directory. `warnings` has each warning once, in order. `estimates` are sentences on
    errors and `counts` are pairs of an operation and its number, both of the last run. `machine` has the lines on
    program and machine."""

    warnings: list[str]
    estimates: list[str]
    counts: list[Sequence[str]]
    machine: list[str]


def read_logs(directory: Path) -> Log:
    """Return the contents of the logs of a directory; empty without a log."""
    lines = [line for name in outputs.LOGS for line in log_lines(directory / name)]
    warnings = [line.removeprefix(WARNING) for line in lines if line.startswith(WARNING)]
    counted = [line.removeprefix(COUNTS) for line in lines if line.startswith(COUNTS)]  # allreduce 12, fft 64x64 3
    counts: list[Sequence[str]] = [part.rsplit(" ", 1) for part in counted[-1].split(", ")] if counted else []
    machine = [line for line in lines if MACHINE.match(line)]
    estimates = {line.partition(":")[0]: line for line in lines if line.startswith(ESTIMATE)}
    return Log(list(dict.fromkeys(warnings)), list(estimates.values()), counts, machine)


def warnings_of_cases(directory: Path) -> list[str]:
    """Return the warnings in the logs of a sweep's cases, and sentences on errors that exceed numerics.accuracy. Each
    sentence appears once, with the numbers of its cases."""
    found: dict[str, list[int]] = {}
    for path in sorted(directory.glob(f"{CASES}/*")):
        if path.name.isdecimal():
            logs = read_logs(path)
            beyond = [line.partition(":")[0] for line in logs.estimates if BEYOND in line]
            for text in [*logs.warnings, *(f"the {name} exceeds numerics.accuracy" for name in beyond)]:
                found.setdefault(text, []).append(int(path.name))
    return [f"{text} ({name_cases(cases)})" for text, cases in found.items()]


FRICTION = ERRORS[0]


def costs(results: Results, found: Log, job: Job) -> Iterator[ReportSection]:
    """Yield the sections on the errors of a run or a curve, and on wall time, operator calls and counts."""
    columns = results.table
    yield describe_errors(columns, found, job, results.kind == "steady")
    calls = [value for value in columns["operator_calls"] if value == value]
    rows = [
        ("steps or points", str(len(columns["seconds"]))),
        ("total wall time", f"{math.fsum(columns['seconds']):.4g} s"),
        ("operator calls", f"{math.fsum(calls):.6g}"),
    ]
    tables = [ReportTable(("cost", "value"), rows)]
    if found.counts:
        tables.append(ReportTable(("counted on one rank in the last run", "number"), found.counts))
    yield ReportSection("Cost", tables=tables)


def describe_errors(columns: Mapping[str, Sequence[float]], found: Log, job: Job, of_curve: bool) -> ReportSection:
    """Return the section on estimated errors: those of a friction curve at its worst and its best point, those of a run
    in its last row with a known error, and the sentences of the log. Friction is left out if nothing slides. The
    section is empty for a table without errors."""
    rows = []
    for column, name, asked in zip(ERRORS, ("friction", "contact area"), job.numerics.asked.both, strict=True):
        known = [error for error in columns.get(column, ()) if error == error]
        if known and (of_curve or job.directions or column != FRICTION):
            errors = (max(known), min(known)) if of_curve else (known[-1],)
            rows.append((name, *(f"{100 * error:.3g} %" for error in errors), f"{100 * asked:g} %"))
    ends = ("at the worst point", "at the best point") if of_curve else ("at the end",)
    tables = [ReportTable(("estimated error of", *ends, "numerics.accuracy"), rows)] if rows else []
    return ReportSection("Error budget", [f"{text}." for text in found.estimates] if rows else (), tables)


def origin_section(directory: Path, found: Log) -> ReportSection:
    """Return the section on the provenance of results: program, machine and runs. It is read from the newest file of a
    directory that has these attributes."""
    there = [directory / name for name in outputs.MAPS if (directory / name).is_file()]
    there += [path for _, path in outputs.find_checkpoints(directory)]
    for path in there:
        try:
            with Results(directory).open_maps(str(path.relative_to(directory))) as file:
                rows = [
                    ("said by", str(path.relative_to(directory))),
                    ("program", str(file.attrs["program"])),
                    ("ranks", str(file.attrs["ranks"])),
                    ("seeds", ", ".join(map(str, file.attrs["seeds"])) or "none"),
                    *json.loads(file.attrs["libraries"]).items(),
                ]
                runs = [
                    (str(one.runs), one.program, str(one.ranks), one.started, str(one.from_step))
                    for one in hdf5.read_chain(file)
                ]
        except (*hdf5.FAILURES, KeyError, ValueError):
            continue
        chain = ReportTable(("runs", "program", "ranks", "started", "from step"), runs, "runs that made the results")
        return ReportSection("Provenance", found.machine, [ReportTable(("of", "value"), rows), chain])
    return ReportSection("Provenance", found.machine or [f"This report was made by {PROGRAM}."])


def list_citations(job: Job | None) -> ReportSection:
    """Return the section with the references to cite for a job's results."""
    cited = hdf5.cite_lines(plain_data(job)) if job else ()
    return ReportSection("References to cite", [PROGRAM, *cited])


MOST_POINTS = 2**22  # most points of a surface that is computed for a report


def road_section(job: Job) -> ReportSection:
    """Return the section on the surface of a job, which is computed again. If the files of the job are gone, or the
    surface is too large, the section only has the keys of the shapes."""
    lines = [(listing.listed_line(part),) for part in job.surface]
    shapes = ReportTable(("shape",), lines, "shapes, whose heights add up")
    if job.bands is not None:
        return _describe_bands(job, shapes)
    if job.grid.nx * job.grid.ny == 1:  # a job in bands without its files
        return ReportSection("Surface", ["The surface cannot be computed again: the files of the job do not exist."])
    if job.grid.nx * job.grid.ny > MOST_POINTS:
        many = "The surface has too many points to be computed again for a report."
        return ReportSection("Surface", [many], [shapes])
    slab = Slab.alone(*job.grid.points)
    try:
        made, remarks = rigid_surface.make_surface(job, FFT(slab))
    except InputError as error:
        return ReportSection("Surface", [f"The surface cannot be made anew: {error}."], [shapes])
    heights, sentences = made.heights((0.0, 0.0), slab.empty()), [*remarks.notes, *map(str, remarks.doubts)]
    found = surface_statistics(heights, job.grid.size)
    if not found.rms_height:
        return ReportSection("Surface", [*sentences, "The surface is flat."], [shapes])
    waves = any(not isinstance(part, Indenter) for part in job.surface)
    statistics = ReportTable(("on the grid of the job", "value"), inputs.list_statistics(found))
    tables = [shapes, *([statistics] if waves else [])]
    return ReportSection("Surface", sentences, tables, _draw(inputs.Sketch(heights, job.grid.size, found)))


def _describe_bands(job: Job, shapes: ReportTable) -> ReportSection:
    """Return the section on the bands of a job, and the surface of the coarsest one."""
    try:
        cut = cut_bands(job)
        setup = Band(job, cut, 0, 0).setup
    except InputError as error:
        return ReportSection("Surface", [f"The surface cannot be made anew: {error}."], [shapes])
    rows = []
    for band in range(cut.count):
        ends = report_sections.write_span(cut.wavelengths(band), "m")
        rows.append((ends, f"{cut.rms_slope(band):.3g}", f"{cut.rms_slope(band, 0):.3g}"))
    bands = ReportTable(("waves", "rms slope", "with all longer waves"), rows, "bands, each on its own grid")
    heights = setup.surface.heights((0.0, 0.0), setup.slab.empty()) * setup.units.height
    found = surface_statistics(heights, setup.grid.size)
    pictures = _draw(inputs.Sketch(heights, setup.grid.size, found), ", coarsest band")
    tables = [shapes, bands, ReportTable(("of the coarsest band", "value"), inputs.list_statistics(found))]
    return ReportSection("Surface", [f"{text}." for text in describe_cut(cut, job)], tables, pictures)


def _draw(sketch: inputs.Sketch, of: str = "") -> list[Picture]:
    return [draw_panel(panel, f"{caption}{of}") for caption, panel in inputs.panels_of(sketch).items()]


DECADES = 1.5  # range of a picture beyond the relaxation times [decades]
MODULI_POINTS = 400  # number of points of a line
CAPTION = "{} over frequency, at the temperature of the job"


def material_section(job: Job) -> ReportSection:
    """Return the section on the material of a job at its temperature."""
    with suppress(InputError):  # its files no longer exist
        job = on_one_grid_of_all(job)
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
    pictures = [draw_panel(panel, CAPTION.format(panel.y.name)) for panel in _over_frequency(job)]
    return ReportSection("Material", tables=tables, pictures=pictures)


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
        yield "measured frequencies, reduced to the reference", report_sections.write_span(found.band, "Hz")
    if found.temperatures is not None:
        yield "measured temperatures", f"{found.temperatures[0]:g} to {found.temperatures[1]:g} °C"


def _list_bands(job: Job) -> ReportTable:
    """Return a table of the frequencies that sliding excites at each temperature."""
    found = excited_bands(job, (job.steady.temperatures if job.steady else None) or ())
    degrees = ("–" if one.temperature is None else f"{one.temperature:g} °C" for one in found)
    ranges = ([report_sections.write_span(band, "Hz") for band in (one.band, one.reduced)] for one in found)
    rows = [(degree, f"{one.factor:.3g}", *ends) for degree, one, ends in zip(degrees, found, ranges, strict=True)]
    caption = "frequencies of the passing waves of the surface, at all velocities of the job"
    return ReportTable(("temperature", "a_T", "excited by the job", "reduced to the reference"), rows, caption)


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


SHOWN = {  # words and sections of the kinds of results
    "run": ("run", report_sections.describe_run),
    "steady": ("friction curve", report_sections.describe_curve),
    "sweep": ("sweep", report_sections.describe_sweep),
    "study": ("study", report_sections.describe_study),
}
ORIGINALS = {each.resolved: each.copies[0] for each in outputs.BY_VERB.values() if each.copies}
ELSEWHERE = ("output.directory", "material.branches", "material.band")  # keys that are shown in other sections


def describe_directory(directory: Path) -> Chapter:
    """Return the chapter of a report about a directory. Raises InputError if it has no results."""
    results = Results(directory)
    there = [kind for kind in results.kinds if kind in SHOWN]
    if not there:
        raise InputError(
            f"{directory} has no results: it has none of {', '.join(outputs.BY_VERB[kind].table for kind in SHOWN)}"
        )
    sections = [SHOWN[kind][1](directory) for kind in there]
    if "steady" in there:
        sections.insert(0, report_sections.describe_friction(directory))
    found, title, cited, places = (read_logs(directory), "", list_citations(None), [f"{directory.absolute()}/"])
    if resolved := results.job_file:  # for a sweep, the job of its first case
        job, warnings = _read_job(resolved)
        title, places = job.title, [*_places(job), *places]
        asked = _describe_job(job, resolved.with_name(ORIGINALS[resolved.name]))
        of_job = [asked, material_section(job), road_section(job)]
        if there == ["sweep"]:
            of_job[0] = replace(asked, sentences=[_describe_swept(directory)])
            of_job = [replace(one, title=f"{one.title} of the first case") for one in of_job]
            warnings = warnings_of_cases(directory) or warnings
        sections += of_job
        if there[0] in ("run", "steady"):
            sections += costs(results, found, job)
        cited = list_citations(job)
        sections.append(ReportSection("Warnings", found.warnings or warnings or ["There was no warning."]))
    tables = (*TABLES, *outputs.SWEEP.tables)
    data = [embed_file(directory / name) for name in tables if name.endswith(".csv") and results.has(name)]
    text = "The tables, in SI units and with all digits, are stored in this file:"
    sections += [origin_section(directory, found), cited, ReportSection("Data", [text], downloads=data)]
    kinds = " and ".join(SHOWN[kind][0] for kind in there)
    shown = [one.without(sorted(places, key=len, reverse=True)) for one in sections if one]
    here, there_is = Path.cwd(), directory.absolute()
    named = there_is.relative_to(here) if there_is.is_relative_to(here) else Path(there_is.name)
    return Chapter(title or there_is.name, named, kinds, shown, info.find_headline(directory))


def compare_directories(directories: Sequence[Path]) -> Iterator[Chapter]:
    """Yield a chapter that compares several directories in common pictures, with one colour per directory."""
    if len(directories) > 1:
        shared = plots.compare_panels(directories)
        if shared:
            tables = compared_table(directories, plots.name_directories(directories))
            together = ReportSection("Together", tables=tables, pictures=[draw_panel(one) for one in shared])
            yield Chapter("Comparison", Path(), "", [together])


def _read_job(resolved: Path) -> tuple[Job, Sequence[str]]:
    """Return the job of an output directory and its warnings, which are omitted if its files no longer exist."""
    try:
        job = jobs.load(resolved)
        return job, job.warnings
    except InputError:
        return shown_job(resolved), ()


def _places(job: Job) -> list[str]:
    """Return the directories of this machine in a job, to be omitted in the report."""
    parts = [value for part in (*job.surface, job.material) for _, value in listing.items(part)]
    return [f"{path.parent}/" for path in (job.path, *parts) if isinstance(path, Path) and path.is_absolute()]


def _describe_swept(directory: Path) -> str:
    """Return a sentence on the swept keys and their values."""
    rows = Results(directory, "sweep").cases
    swept = {name: dict.fromkeys(str(row[name]) for row in rows) for name in swept_keys(rows)}
    values = "; ".join(f"{name} ({', '.join(found)})" for name, found in swept.items())
    return f"The sweep has {len(rows)} cases, with {values}."


def _describe_job(job: Job, given: Path) -> ReportSection:
    """Return a table of all keys with every default, and the original job file, if it exists."""
    rows = [row for row in listing.rows(job) if not row[0].startswith(ELSEWHERE)]
    texts = [("the original job file", given.read_text(errors="replace"))] if given.is_file() else []
    return ReportSection("Job", tables=[ReportTable(("key", "value", "unit"), rows)], texts=texts)


NAME, TEMPLATE = "report.html", "page.html.jinja"
LONG_WORD = re.compile(r"\S{14,}")  # word that is wider than a column on a phone
SMALL_NUMBER = re.compile(r"-?\d[\d.]*e-\d+")
BREAKS = re.compile(r"(?<=[_./,=:])(?=\w)")  # positions at which a long word may be broken
NUMBER = re.compile(r"(?<=\d) (?=±|%|°C|(?:[nµmkMG]?(?:Pa|N|m|s|J|Hz)|h|min|days|years)\b)|(?<=±) |(?<==) (?=[\d-])")


def write_report(directories: Sequence[Path], out: Path | None = None) -> Path:
    """Write the report of output directories, and return its path (default: report.html in the first directory).

    Raises InputError for a directory without results, and for a file that cannot be written.
    """
    target = out or directories[0] / NAME
    if target.suffix not in (".html", ".htm"):
        raise InputError(f"--out must end in .html, got {str(target)!r}")
    for directory in directories:
        if not directory.is_dir():
            raise InputError(f"{directory} is not a directory")
        _refuse_links(directory)
    text = render(directories)
    with files.writing(target), files.replaced(target, files.is_marked) as file:
        file.write(text.encode(errors="backslashreplace"))
    return target


def _refuse_links(directory: Path) -> None:
    """Raise InputError for links in a directory, which would publish files from elsewhere."""
    for path in (path for pattern in ("*", "checkpoint/*", "cases/*", "cases/*/*") for path in directory.glob(pattern)):
        kind = path.lstat().st_mode
        if not stat.S_ISREG(kind) and not stat.S_ISDIR(kind):
            kind_name = "a symbolic link" if stat.S_ISLNK(kind) else "not a regular file"
            raise InputError(f"{path} is {kind_name}, which a report does not read; replace it by the file itself")


def render(directories: Sequence[Path]) -> str:
    each = [describe_directory(directory) for directory in printed.with_bar(directories, "chapters", "chapter")]
    chapters = [*compare_directories(directories), *each]
    loader = PackageLoader("parcontact", "results")
    shown = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    shown.filters |= {"breakable": breakable, "whole_numbers": whole_numbers}
    made = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return shown.get_template(TEMPLATE).render(chapters=chapters, program=PROGRAM, made=made, mark=files.MARK)


def breakable(text: str, mark: str = "<wbr>") -> Markup:
    """Return a text whose long words may be broken only after `_./,=:`; browsers would break 1e-05 at its hyphen."""
    parts = LONG_WORD.sub(lambda word: BREAKS.sub(mark, word[0]), str(escape(text)))
    return Markup(SMALL_NUMBER.sub(r'<span class="n">\g<0></span>', parts))


def whole_numbers(text: str) -> str:
    """Return a sentence in which no line break separates a number, its error and its unit."""
    return NUMBER.sub("\N{NO-BREAK SPACE}", text)

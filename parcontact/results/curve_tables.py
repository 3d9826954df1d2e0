"""Parts of a report, and the tables of friction curves at its top.

* Parts are texts, tables, pictures, browsers of maps and data, all stored in the page.
* Tables show friction by speed and temperature for each pressure, of one curve or of several side by side, and the
  important lengths, frequencies and moduli.
"""

import base64
import io
import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..bands.choice import cut_bands, on_one_grid_of_all
from ..effects.relaxation import relaxation_of
from ..errors import InputError
from ..files import outputs, tables
from ..job import Job, load
from ..march.measured_range import excited_bands
from ..physics.prony import complex_modulus
from ..printed import quantity, with_error
from . import style
from .panels import Panel, draw
from .results import Results

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
        """Return the section with the directories `places` removed from paths in its sentences and tables."""

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
    """Return a picture of one panel, as SVG; its caption names its axes by default."""
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
DIGITS = 6  # significant digits of speeds, pressures and temperatures that count as equal
Place = tuple[float, float, float]  # speed [m/s], pressure [Pa], temperature [deg C] (NaN: not known)


def friction_tables(curve: Results) -> list[ReportTable]:
    """Return a table of friction for each pressure, with a row for each speed and a column for each temperature."""
    cells = {_round(one.at, curve.temperature): "not solved" for one in tables.read(curve.path)}
    cells = _cells(curve) | cells
    degrees, found = list(dict.fromkeys(place[2] for place in sorted(cells, key=_order))), []
    for pressure in dict.fromkeys(place[1] for place in sorted(cells, key=_order)):
        speeds = sorted({place[0] for place in cells if place[1] == pressure})
        rows = [
            [quantity(speed, "m/s"), *(cells.get((speed, pressure, each), "–") for each in degrees)] for speed in speeds
        ]
        head = ["velocity", *(f"at {each:g} °C" if each > -math.inf else "friction" for each in degrees)]
        found.append(ReportTable(head, rows[:MOST], f"friction under {quantity(pressure, 'Pa')}"))
    return found


def compared_table(directories: Sequence[Path], names: Sequence[str]) -> list[ReportTable]:
    """Return a table with the friction of several curves at points that two or more have; an empty list without any."""
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
    speed, pressure, degrees = (float(f"{value:.{DIGITS}g}") for value in place)
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
        whole = on_one_grid_of_all(job, cut_bands(job)) if job.bands is not None else job
        for one in excited_bands(whole, (job.steady.temperatures if job.steady else None) or ()):
            body = whole if one.temperature is None else whole.at_temperature(one.temperature)
            at = "" if one.temperature is None else f" at {one.temperature:g} °C"
            rows.append((f"frequencies that the job excites{at}", _span(one.band, "Hz")))
            rows.append((f"shear moduli |G| at these frequencies{at}", _span(_moduli(body, one.band), "Pa")))
        if (measured := getattr(job.material.fitted, "band", None)) is not None:
            rows.append(("measured frequencies, at the reference temperature", _span(measured, "Hz")))
        return [ReportTable(("what matters", "range"), rows, "lengths, frequencies and moduli")]
    return []


def _lengths(job: Job) -> list[tuple[str, str]]:
    if job.bands is not None:
        ends = cut_bands(job).spectrum.ends
        return [("waves of the surface", _span((2 * math.pi / ends[0], 2 * math.pi / ends[1]), "m"))]
    waves = ([getattr(part, f"{end}_wavelength", None) for end in ("long", "short")] for part in job.surface)
    rows = [("waves of the surface", _span([end for end in each if end], "m")) for each in waves if all(each)]
    return [*rows, ("cell of the grid", quantity(max(job.grid.dx, job.grid.dy), "m"))]


def _moduli(job: Job, band: tuple[float, float]) -> tuple[float, float]:
    """Return the magnitude of the shear modulus [Pa] at both ends of a band of frequencies [Hz]."""
    series = relaxation_of(job.material)
    omega = 2 * math.pi * np.array(band)
    low, high = np.abs(complex_modulus(omega, series.modulus_inf, series.moduli, series.relaxation_times)).tolist()
    return low, high


def _span(ends: Sequence[float], unit: str) -> str:
    return " to ".join(quantity(end, unit) for end in ends)

"""Pictures of a friction curve in bands: friction of each band over velocity, area over magnification, and what
capabilities have by band (`BAND_PANELS` of their pictures: keys and axes of columns).

Persson's theory for the same spectrum is drawn if `bands_theory.csv` exists.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..job.added_sections import answers
from ..parallel.slab import Array
from . import prefixes, style
from .charts import FRACTION, Axis, Chart, ChartLine
from .plotted_run import count_different, read_table

TABLE, THEORY = "bands.csv", "bands_theory.csv"
NEEDED = ("velocity", "pressure", "temperature", "band", "long_wavelength", "short_wavelength")
SHOWN = 4  # number of velocities that are drawn as lines
THIN = 1.0  # tuning: width of the lines of the theory [points]
AREA = Axis(FRACTION)
THEORY_LOOK = {"color": style.GREY, "linestyle": ":", "linewidth": THIN}
ENTRY = ChartLine("theory", np.zeros(0), np.zeros(0), THEORY_LOOK)  # in legends


def chart_bands(directory: Path) -> list[Chart]:
    """Return panels of a table of bands, for its first pressure and temperature."""
    if not (directory / TABLE).is_file():
        return []
    whole = read_table(directory / TABLE, (*NEEDED, "friction", "contact_area"))
    columns = _choose(whole)
    if not columns["velocity"].size:
        return []
    theory = None
    if (directory / THEORY).is_file():
        theory = _choose(read_table(directory / THEORY, ("velocity", "pressure", "temperature", "band")))
    found = [_friction(columns, theory), _over_bands("bands area", columns, theory, "contact_area")]
    for name, (key, axis) in (pair for panels in answers("pictures", "BAND_PANELS") for pair in panels.items()):
        if name in columns and np.isfinite(columns[name]).any():
            found.append(_over_bands(key, columns, None, name, axis))
    if at := _describe_first(whole):
        found = [replace(chart, y=replace(chart.y, name=f"{chart.y.name}\nat {at}")) for chart in found]
    return found


def _describe_first(columns: dict[str, Array]) -> str:
    """Return the first pressure and temperature as text, if the table has several."""
    firsts = [(name, columns[name][0], unit) for name, unit in (("pressure", "Pa"), ("temperature", "°C"))]
    several = [one for one in firsts if count_different(columns[one[0]]) > 1]
    return ", ".join(prefixes.quantity(float(value), unit) for _, value, unit in several)


def _choose(columns: dict[str, Array]) -> dict[str, Array]:
    """Return the rows of the first pressure and temperature."""
    if not columns["velocity"].size:
        return columns
    same = np.ones(columns["velocity"].size, bool)
    for name in ("pressure", "temperature"):
        first = columns[name][0]
        same &= np.isclose(columns[name], first, rtol=1e-6, equal_nan=True)
    return {name: values[same] for name, values in columns.items()}


def _friction(columns: dict[str, Array], theory: dict[str, Array] | None) -> Chart:
    """Return a chart of the friction of each band over velocity, stacked from the coarsest, with the theory's sum as a
    line."""
    series, bands, edges = list[ChartLine](), np.unique(columns["band"]), list[float]()
    for band, color in zip(bands, style.sequence(bands.size), strict=True):
        rows = _sorted(columns, columns["band"] == band)
        long, short = (float(columns[f"{end}_wavelength"][rows[0]]) for end in ("long", "short"))
        edges += [short] if edges else [long, short]
        series.append(ChartLine("", columns["velocity"][rows], columns["friction"][rows], {"color": color}, stack=0))
    if theory is not None:
        speeds = np.unique(theory["velocity"])
        sums = np.array([theory["friction"][theory["velocity"] == speed].sum() for speed in speeds])
        series += [ENTRY, ChartLine("", speeds, sums, THEORY_LOOK)]
    y = Axis("friction by band,\nlongest waves below")
    return Chart("bands", Axis("sliding velocity", "m/s"), y, series, log_x=True, edges=edges)


def _over_bands(
    key: str, columns: dict[str, Array], theory: dict[str, Array] | None, name: str, y: Axis = AREA
) -> Chart:
    """Return a chart of the area over magnification, or of another column over wavelength, for some velocities."""
    area, longest = y is AREA, float(columns["long_wavelength"].max())
    x = Axis("magnification") if area else Axis("shortest wave of the band", "m")
    series = []
    for number, speed in enumerate(_some(np.unique(columns["velocity"]))):
        for table, look in _tables(columns, theory, number):
            rows = np.flatnonzero(np.isclose(table["velocity"], speed, rtol=1e-6))
            rows = rows[np.argsort(table["band"][rows])]
            short = table["short_wavelength"][rows]
            label = prefixes.quantity(speed, "m/s") if table is columns else ""
            series.append(ChartLine(label, longest / short if area else short, table[name][rows], look))
    series += [] if theory is None else [ENTRY]
    return Chart(key, x, y, series, log_x=True)


def _tables(
    columns: dict[str, Array], theory: dict[str, Array] | None, number: int
) -> Iterator[tuple[dict[str, Array], dict[str, object]]]:
    yield columns, style.line(number) | {"marker": "o"}
    if theory is not None:
        yield theory, THEORY_LOOK | {"color": style.line(number)["color"]}


def _some(speeds: Array) -> Sequence[float]:
    places = np.unique(np.linspace(0, speeds.size - 1, min(SHOWN, speeds.size)).round().astype(int))
    return [float(speed) for speed in speeds[places]]


def _sorted(columns: dict[str, Array], chosen: NDArray[np.bool_]) -> NDArray[np.intp]:
    rows = np.flatnonzero(chosen)
    return rows[np.argsort(columns["velocity"][rows], kind="stable")]

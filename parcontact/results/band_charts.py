"""Pictures of a friction curve in bands: friction of each band over velocity, area over magnification, and what
capabilities have by band (`BAND_PANELS` of their pictures: keys and axes of columns); and of a history in bands over
the slip of each slide.

Persson's theory for the same spectrum is drawn if `bands_theory.csv` exists, or `theory.csv` for a history. Its slides
end at the friction of steady sliding, if `steady.csv` exists.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..job.added_sections import answers
from ..parallel.slab import Array
from . import prefixes, style
from .charts import FRACTION, Axis, Chart, ChartLine
from .plotted_run import PlottedRun, count_different
from .results import Results

TABLE, THEORY = "bands.csv", "bands_theory.csv"
NEEDED = ("velocity", "pressure", "temperature", "band", "long_wavelength", "short_wavelength")
SHOWN = 4  # number of velocities that are drawn as lines
THIN = 1.0  # tuning: width of the lines of the theory [points]
AREA = Axis(FRACTION)
THEORY_LOOK = {"color": style.GREY, "linestyle": ":", "linewidth": THIN}
OVER_TIME, STEADY = "theory.csv", "steady.csv"
STEADY_LOOK = {"color": style.GREY, "linestyle": "-", "linewidth": THIN}
STEADY_ENTRY = ChartLine("steady sliding", np.zeros(0), np.zeros(0), STEADY_LOOK)
SAME = 1e-9  # rounding: of distances
ENTRY = ChartLine("theory", np.zeros(0), np.zeros(0), THEORY_LOOK)  # in legends


def chart_bands(directory: Path) -> list[Chart]:
    """Return panels of a table of bands of a curve, for its first pressure and temperature."""
    curve = Results(directory, "curve")
    if "velocity" not in curve.read(TABLE):
        return []
    whole = curve.read(TABLE).arrays((*NEEDED, "friction", "contact_area"))
    columns = _choose(whole)
    if not columns["velocity"].size:
        return []
    theory = None
    if curve.has(THEORY):
        theory = _choose(curve.read(THEORY).arrays(("velocity", "pressure", "temperature", "band")))
    found = [_friction(columns, theory), _over_bands("bands area", columns, theory, "contact_area")]
    for name, (key, axis) in (pair for panels in answers("pictures", "BAND_PANELS") for pair in panels.items()):
        if name in columns and np.isfinite(columns[name]).any():
            found.append(_over_bands(key, columns, None, name, axis))
    if at := _describe_first(whole):
        found = [replace(chart, y=replace(chart.y, name=f"{chart.y.name}\nat {at}")) for chart in found]
    return found


def chart_slips(run: PlottedRun) -> list[Chart]:
    """Return panels of a history in bands over the slip since the start of each slide: friction and area, and friction
    by band in the last slide; none without a slide."""
    slides = [number for number, stage in enumerate(run.job.history) if stage.slides and stage.seconds]
    if not slides or "distance" not in run.read(TABLE):
        return []
    x, starts = Axis("slip of the stage", "m"), _starts(run)
    friction, area = list[ChartLine](), list[ChartLine]()
    for count, number in enumerate(slides):
        rows, look, name = run.rows_of_stages[number], style.line(count), run.job.history[number].name
        rows = [row for row in rows if run.columns["distance"][row] > starts[number]]
        slip = run.columns["distance"][rows] - starts[number]
        name = name if len(slides) > 1 else ""
        friction.append(ChartLine(name, slip, run.columns["friction"][rows], look))
        area.append(ChartLine(name, slip, run.columns["contact_area_corrected"][rows], look))
        others = [*_theory_of(run, starts[number], slip), *_steady_of(run, number, slip)]
        friction += [line for line, _ in others]
        area += [line for _, line in others]
    there = ((OVER_TIME, ENTRY), (STEADY, STEADY_ENTRY))
    entries = [entry for name, entry in there if run.has(name)]
    stages = run.read(TABLE).arrays()
    start, end = starts[slides[-1]], starts[slides[-1]] + _way(run, slides[-1])
    kept = (stages["distance"] > start) & (stages["distance"] <= end * (1.0 + SAME))
    own = {name: values[kept] for name, values in stages.items()}
    own["slip"] = own["distance"] - start
    return [
        Chart("bands slip", x, Axis("friction coefficient"), [*friction, *entries], log_x=True),
        Chart("bands slip area", x, Axis(FRACTION), [*area, *entries], log_x=True),
        _stacked(own, "slip", x),
    ]


def _way(run: PlottedRun, number: int) -> float:
    stage = run.job.history[number]
    return stage.seconds * stage.speed


def _starts(run: PlottedRun) -> Array:
    """Return the distance slid before each stage [m]."""
    return np.cumsum([0.0, *(_way(run, number) for number in range(len(run.job.history)))])


def _theory_of(run: PlottedRun, start: float, slip: Array) -> Iterator[tuple[ChartLine, ChartLine]]:
    """Yield friction and area of the theory over the slip of a stage."""
    if not run.has(OVER_TIME):
        return
    theory = run.read(OVER_TIME).arrays(("distance", "friction", "contact_area"))
    there = theory["distance"] - start
    rows = (there >= slip[0]) & (there <= slip[-1])
    of = lambda name: ChartLine("", there[rows], theory[name][rows], THEORY_LOOK)  # noqa: E731
    yield of("friction"), of("contact_area")


def _steady_of(run: PlottedRun, number: int, slip: Array) -> Iterator[tuple[ChartLine, ChartLine]]:
    """Yield lines at friction and area of steady sliding at the velocity of a stage, over the last decade."""
    if not run.has(STEADY):
        return
    stage, names = run.job.history[number], ("velocity", "pressure", "friction", "contact_area_corrected")
    curve = run.read(STEADY).arrays(names)
    same = np.isclose(curve["velocity"], stage.speed) & np.isclose(curve["pressure"], stage.load.start)
    for row in np.flatnonzero(same)[:1]:
        ends = np.array([max(slip[0], slip[-1] / 10.0), slip[-1]])
        yield tuple(ChartLine("", ends, np.full(2, curve[name][row]), STEADY_LOOK) for name in names[2:])  # type: ignore[misc]


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
    """Return a chart of the friction of each band over velocity, with the theory's sum as a line."""
    found = _stacked(columns, "velocity", Axis("sliding velocity", "m/s"))
    if theory is None:
        return found
    speeds = np.unique(theory["velocity"])
    sums = np.array([theory["friction"][theory["velocity"] == speed].sum() for speed in speeds])
    return replace(found, series=[*found.series, ENTRY, ChartLine("", speeds, sums, THEORY_LOOK)])


def _stacked(columns: dict[str, Array], over: str, x: Axis) -> Chart:
    """Return a chart of the friction of each band over a column, stacked from the coarsest."""
    series, bands, edges = list[ChartLine](), np.unique(columns["band"]), list[float]()
    for band, color in zip(bands, style.sequence(bands.size), strict=True):
        rows = np.flatnonzero(columns["band"] == band)
        rows = rows[np.argsort(columns[over][rows], kind="stable")]
        long, short = (float(columns[f"{end}_wavelength"][rows[0]]) for end in ("long", "short"))
        edges += [short] if edges else [long, short]
        series.append(ChartLine("", columns[over][rows], columns["friction"][rows], {"color": color}, stack=0))
    return Chart("bands", x, Axis("friction by band,\nlongest waves below"), series, log_x=True, edges=edges)


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

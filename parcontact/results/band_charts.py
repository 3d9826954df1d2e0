"""Panels of friction curves, of bands, and of sweeps.

A curve (steady.csv) is drawn against the velocity v, or against the pressure if only the pressure varies. Each
temperature has its own line. A further panel draws all of them against the reduced velocity a_T v, with the shift
factor a_T, as one master curve.

Four kinds of panels show bands: friction against velocity; friction against the slip since the start of each slide of a
history; contact area against magnification; and quantities of effects against the shortest wave of a band. If the table
of Persson's theory exists, its lines are added. A history also has a line for steady sliding if steady.csv exists.

Points of a sweep are cases, and lines are the means of the cases over seeds. Each value of a second swept key has its
own line and colour. Lines of different values of further keys have different dashes.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import printed
from ..columns import SWEEP, names_of
from ..errors import InputError
from ..files import outputs
from ..job import Stage, load
from ..job.listing import answers, unit_of_path
from ..parallel.slab import Array
from . import style
from .panels import Axis, ColumnPanel, Line, Panel, entry, offered
from .plotted_run import FRACTION, PlottedRun, count_different, round_digits, to_contact_area, to_load
from .results import PLACES, SAMPLES, Results, read_cases, swept_keys
from .slide import CORRECTED

NEEDED_OF_BANDS = ("velocity", "pressure", "temperature", "band", "long_wavelength", "short_wavelength")
SHOWN = 4  # number of velocities that are drawn as lines
THIN_LINE = 1.0  # tuning: width of the lines of the theory [points]
AREA = Axis(FRACTION)
THEORY_LOOK = {"color": style.GREY, "linestyle": ":", "linewidth": THIN_LINE}
OVER_TIME = style.line(1)  # of the theory, as in the panels of all histories
STEADY_LOOK = {"color": style.GREY, "linestyle": "-", "linewidth": THIN_LINE}
SAME = 1e-9  # rounding: of distances


def panels_of_bands(directory: Path, differing: Collection[str] = ()) -> list[Panel]:
    """Return panels of the bands of a friction curve (bands.csv) at the first pressure and temperature in this table,
    with the lines of the theory for the same pressure and temperature. Names of axes state the pressure, or the
    temperature, if it varies or is `differing` among several curves."""
    curve = Results(directory, "steady")
    if "velocity" not in curve.read(outputs.BANDS):
        return []
    whole = _read(curve, outputs.BANDS, (*NEEDED_OF_BANDS, "friction", "contact_area"))
    if not whole["velocity"].size:
        return []
    columns = _choose(whole, whole)
    theory = None
    if curve.has(outputs.BANDS_THEORY):
        theory = _choose(_read(curve, outputs.BANDS_THEORY, NEEDED_OF_BANDS[:4]), whole)
    found = [_friction(columns, theory), _over_bands("bands area", columns, theory, "contact_area")]
    for one in offered("BAND_PANELS"):
        (name,) = one.columns.values()
        if name in columns and np.isfinite(columns[name]).any():
            found.append(_over_bands(one.key, columns, None, name, one.y))
    firsts = [(name, float(whole[name][0]), unit) for name, unit in (("pressure", "Pa"), ("temperature", "°C"))]
    named = (one for one in firsts if one[0] in differing or count_different(whole[one[0]]) > 1)
    if at := ", ".join(printed.quantity(value, unit) for _, value, unit in named if value == value):
        found = [replace(panel, y=replace(panel.y, name=f"{panel.y.name}\nat {at}")) for panel in found]
    return found


def panels_of_slips(run: PlottedRun) -> list[Panel]:
    """Return panels of a history in bands against the slip since the start of each slide: friction and area, and
    friction by band in the last slide; an empty list without a slide."""
    stages = run.job.history
    ways = np.array([stage.seconds * stage.speed for stage in stages])
    starts = np.cumsum(ways) - ways
    slides = [number for number, stage in enumerate(stages) if stage.slides and stage.seconds]
    if not slides or "distance" not in run.read(outputs.BANDS):
        return []
    x, friction, area = Axis("slip of the stage", "m"), list[Line](), list[Line]()
    for count, number in enumerate(slides):
        rows = [row for row in run.rows_of_stages[number] if run.columns["distance"][row] > starts[number]]
        slip = run.columns["distance"][rows] - starts[number]
        own = slip, *(run.columns[name][rows] for name in ("friction", CORRECTED))
        name = stages[number].name if len(slides) > 1 else ""
        others = *_theory_of(run, starts[number], slip), *_steady_of(run, stages[number], slip)
        for label, look, (at, *values) in ((name, style.line(count + (count > 0)), own), *others):
            friction.append(Line(label, at, values[0], look))
            area.append(Line(label, at, values[1], look))
    names = ((outputs.THEORY.table, "theory", OVER_TIME), (outputs.STEADY.table, "steady sliding", STEADY_LOOK))
    entries = [entry(name, look) for table, name, look in names if run.has(table)]
    bands = run.read(outputs.BANDS).arrays()
    last = bands["distance"] - starts[slides[-1]]
    kept = (last > SAME * bands["distance"]) & (last <= ways[slides[-1]] + SAME * bands["distance"])
    return [
        Panel("bands slip", x, Axis("friction coefficient"), [*friction, *entries], log_x=True),
        Panel("bands slip area", x, Axis(FRACTION), [*area, *entries], log_x=True),
        _stacked({name: values[kept] for name, values in (bands | {"slip": last}).items()}, "slip", x),
    ]


Curve = tuple[str, dict[str, Any], tuple[Array, ...]]  # name, look, and slip, friction and area


def _theory_of(run: PlottedRun, start: float, slip: Array) -> Iterator[Curve]:
    """Yield friction and area of the theory over the slip of a stage."""
    if run.has(outputs.THEORY.table):
        theory = run.read(outputs.THEORY.table).arrays(("distance", "friction", "contact_area"))
        there = theory["distance"] - start
        rows = (there >= slip[0]) & (there <= slip[-1])
        yield "", OVER_TIME, (there[rows], theory["friction"][rows], theory["contact_area"][rows])


def _steady_of(run: PlottedRun, stage: Stage, slip: Array) -> Iterator[Curve]:
    """Yield friction and area of steady sliding at the velocity of a stage, over the last decade."""
    if run.has(outputs.STEADY.table):
        curve = run.read(outputs.STEADY.table).arrays(("velocity", "pressure", "friction", CORRECTED))
        same = np.isclose(curve["velocity"], stage.speed) & np.isclose(curve["pressure"], stage.load.start)
        ends = np.array([max(slip[0], slip[-1] / 10.0), slip[-1]])
        for row in np.flatnonzero(same)[:1]:
            yield "", STEADY_LOOK, (ends, *(np.full(2, curve[name][row]) for name in ("friction", CORRECTED)))


def _read(curve: Results, table: str, needed: Sequence[str]) -> dict[str, Array]:
    """Return a table of a curve; rows without a temperature have that of the job, if there is one."""
    columns = curve.read(table).arrays(needed)
    own = getattr(curve.job.material, "temperature", None) if curve.job else None
    if own is not None:
        columns["temperature"] = np.where(np.isnan(columns["temperature"]), own, columns["temperature"])
    return columns


def _choose(columns: dict[str, Array], whole: dict[str, Array]) -> dict[str, Array]:
    """Return the rows at the first pressure and temperature of another table."""
    same = np.ones(columns["velocity"].size, bool)
    for name in ("pressure", "temperature"):
        same &= np.isclose(columns[name], whole[name][0], rtol=1e-6, equal_nan=True)
    return {name: values[same] for name, values in columns.items()}


def _friction(columns: dict[str, Array], theory: dict[str, Array] | None) -> Panel:
    """Return a panel of the friction of each band over velocity, with the theory's sum as a line."""
    found = _stacked(columns, "velocity", Axis("sliding velocity", "m/s"))
    if theory is None or not (speeds := np.unique(theory["velocity"])).size:
        return found
    sums = np.array([theory["friction"][theory["velocity"] == speed].sum() for speed in speeds])
    return replace(found, series=[*found.series, entry("theory", THEORY_LOOK), Line("", speeds, sums, THEORY_LOOK)])


def _stacked(columns: dict[str, Array], over: str, x: Axis) -> Panel:
    """Return a panel of the friction of each band over a column, stacked from the coarsest."""
    series, bands, edges = list[Line](), np.unique(columns["band"]), list[float]()
    for band, color in zip(bands, style.sequence(bands.size), strict=True):
        rows = np.flatnonzero(columns["band"] == band)
        rows = rows[np.argsort(columns[over][rows], kind="stable")]
        long, short = (float(columns[f"{end}_wavelength"][rows[0]]) for end in ("long", "short"))
        edges += [short] if edges else [long, short]
        series.append(Line("", columns[over][rows], columns["friction"][rows], {"color": color}, stack=0))
    return Panel("bands", x, Axis("friction by band,\nlongest waves below"), series, log_x=True, edges=edges)


def _over_bands(
    key: str, columns: dict[str, Array], theory: dict[str, Array] | None, name: str, y: Axis = AREA
) -> Panel:
    """Return a panel of the area over magnification, or of another column over wavelength, for some velocities."""
    longest = float(columns["long_wavelength"].max())
    x = Axis("magnification") if y is AREA else Axis("shortest wave of the band", "m")
    speeds, by, tables = np.unique(columns["velocity"]), {"velocity": "m/s"}, list[dict[str, Array]]()
    shown = speeds[np.unique(np.linspace(0, speeds.size - 1, min(SHOWN, speeds.size)).round().astype(int))]
    for table in filter(None, (columns, theory)):
        kept = np.isclose(table["velocity"][:, None], shown, rtol=1e-6).any(axis=1)
        some = {column: values[kept] for column, values in table.items()}
        tables.append(some | {"x": longest / some["short_wavelength"] if y is AREA else some["short_wavelength"]})
    series = list(_make_lines(tables[0], "x", name, by))
    for thin in tables[1:]:
        series += _make_thin(thin, "x", name, by, ALONE, tables[0])
    return Panel(key, x, y, series, log_x=True)


NEEDED = ("velocity", "pressure", "friction", "contact_area")
COLD = "friction_cold"  # friction without feedback from heat
ALONE = "theory without finer waves"  # area of waves up to a magnification; bands also touch finer waves
THIN = {"theory": ":", ALONE: ":", "without feedback": "--"}  # dashes of thin lines, next to the simulation


def find_differing(directories: Sequence[Path]) -> list[str]:
    """Return which of temperature and pressure differ among the points of several friction curves."""
    tables = [Results(directory, "steady").table for directory in directories]
    found = {name: [value for table in tables for value in table.get(name, ())] for name in ("temperature", "pressure")}
    return [name for name, values in found.items() if count_different(np.array(values)) > 1]


def panels_of_curve(directory: Path, over: str = "", differing: Collection[str] = ()) -> list[Panel]:
    """Return panels of a table of steady states against the velocity; against the load if `over` is "load", or by
    default if the load alone varies. The list is empty without a state, and for `over` "time" or "distance", which
    states do not have. Lines are named by temperature and load if they vary, or are `differing` among several
    curves."""
    curve = Results(directory, "steady")
    columns, area = curve.table.arrays(NEEDED), curve.free_area
    if over in ("time", "distance") or not columns["velocity"].size:
        return []
    axes = {
        "velocity": Axis("sliding velocity", "m/s"),
        "load": to_load(columns["pressure"], area)[0],
        "temperature": Axis("temperature", "°C"),
        "reduced": Axis("shift factor × velocity", "m/s"),
        "friction": Axis("friction coefficient"),
        "area": to_contact_area(columns["contact_area"], area)[0],
    }
    _add_derived(columns, area)
    x, by = "velocity", "load"
    if over == "load" or (not over and count_different(columns[x]) < 2 <= count_different(columns[by])):
        x, by = by, x
    shared = {"load" if name == "pressure" else name for name in differing}
    names = [name for name in ("temperature", by) if name in columns and np.isfinite(columns[name]).all()]
    several = [name for name in names if name in shared or count_different(columns[name]) > 1]
    lines = {name: axes[name].unit for name in several or [by]}
    panels = [("steady friction", x, "friction"), ("steady area", x, "area")]
    if "temperature" in several and x == "velocity" and "reduced" in columns:
        panels.append(("steady master", "reduced", "friction"))
    for one in offered("CURVE_PANELS"):
        (name,) = one.columns.values()
        if name in columns:
            axes[name] = one.y
            panels.append((one.key, x, name))
    theory = {}
    if x == "velocity" and COLD not in columns and curve.has(outputs.STEADY_THEORY):  # the theory has no feedback
        theory = _read(curve, outputs.STEADY_THEORY, (*NEEDED, "temperature", "shift_factor"))
        _add_derived(theory, area)
    found = []
    for key, along, name in panels:
        series = list(_make_lines(columns, along, name, lines))
        if name == "friction" and along == x and COLD in columns:
            series += _make_thin(columns | {name: columns[COLD]}, along, name, lines, "without feedback", columns)
        if name in theory:
            alone = along == "reduced" and "load" not in lines  # over a_T v the theory is one line
            series += _make_thin(theory, along, name, {} if alone else lines, "theory", columns)
        found.append(Panel(key, axes[along], axes[name], series, log_x=True))
    with suppress(InputError):  # files of the job no longer exist
        job = load(directory / outputs.STEADY.resolved)
        found += [panel for panels_of in answers("pictures", "curve_panels", job) for panel in panels_of(job, columns)]
    return found + (panels_of_bands(directory, differing) if x == "velocity" else [])


def steady_title(directory: Path) -> str:
    """Return the title of a curve's picture: the title of its job. If all points have the same load, the title
    ends with this load: the force on a free box, else the mean pressure."""
    curve = Results(directory, "steady")
    axis, loads = to_load(curve.table.arrays(("pressure",))["pressure"], curve.free_area)
    name = (curve.job.title if curve.job else "") or "steady sliding"
    return f"{name}: {printed.quantity(loads[0], axis.unit)}" if count_different(loads) == 1 else name


def _add_derived(columns: dict[str, Array], area: float) -> None:
    """Return the columns of a table with loads, corrected areas, and speeds at the reference temperature."""
    columns["load"] = to_load(columns["pressure"], area)[1]
    columns["area"] = to_contact_area(columns.get("contact_area_corrected", columns["contact_area"]), area)[1]
    if "shift_factor" in columns:
        columns["reduced"] = columns["shift_factor"] * columns["velocity"]


def _make_lines(
    columns: dict[str, Array], x: str, y: str, by: dict[str, str], drawn: dict[str, Array] | None = None
) -> Iterator[Line]:
    """Yield a line for each combination of the columns `by`, given with their units, in a table that is `drawn`, which
    numbers the colours; by default in the same table."""
    error = columns.get(f"error_{y}")
    places, known = (
        np.array([round_digits(table[name]) for name in by]).reshape(len(by), table["velocity"].size)
        for table in (columns, columns if drawn is None else drawn)
    )
    values = np.unique(known, axis=1)
    for number, place in enumerate(values.T):
        rows = np.flatnonzero((places == place[:, None]).all(axis=0))
        rows = rows[np.argsort(columns[x][rows], kind="stable")]
        label = ", ".join(printed.quantity(value, unit) for value, unit in zip(place, by.values(), strict=True))
        look = _choose_look(values, number)
        yield Line(label, columns[x][rows], columns[y][rows], look, None if error is None else error[rows])


def _choose_look(values: Array, number: int) -> dict[str, Any]:
    """Return the look of a line out of those with different `values` of one column or of two, shape (columns, lines).

    Lines have colours and dashes of their own. If two columns vary, the column with more values has colours, and the
    other one has marks and dashes.
    """
    kinds = [np.unique(row) for row in values]
    if len(kinds) < 2 or min(kind.size for kind in kinds) < 2:
        return style.line(number, values.shape[1]) | {"marker": "o"}
    (hue, hues), (mark, _) = sorted(enumerate(kinds), key=lambda pair: -pair[1].size)
    places = [int(np.searchsorted(kind, row[number])) for kind, row in zip(kinds, values, strict=True)]
    dashes, marker = (looks[places[mark] % len(looks)] for looks in (style.DASHES, style.MARKERS))
    return {"color": style.colors(hues.size)[places[hue]], "linestyle": dashes, "marker": marker}


def _make_thin(
    columns: dict[str, Array], x: str, y: str, by: dict[str, str], label: str, drawn: dict[str, Array]
) -> Iterator[Line]:
    """Yield thin lines in addition to those of the simulation, which are `drawn`, in their colours and at their places
    only, and their entry of the legend."""
    look = {"color": style.GREY, "linestyle": THIN[label], "linewidth": THIN_LINE}
    lines = [line for line in _make_lines(columns, x, y, by, drawn) if line.x.size]
    if lines:
        yield entry(label, look)
    for line in lines:
        yield Line("", line.x, line.y, look | ({"color": line.look["color"]} if by else {}))


MARKERS, DASHES = ("o", "s"), ("--", ":")  # markers of means, dashes of theories, by column of a panel
GREY = {"color": style.GREY}  # entries of legends that hold for all colours
STYLES = ("-", "--", ":", "-.")  # dashes of lines, by the values of further keys
WIDE = 10.0  # ratio of the largest to the smallest number above which an axis is logarithmic
FRICTION = Axis("friction coefficient")
PANELS = (
    ColumnPanel("friction", FRICTION, {"highest": "mu_max", "dynamic": "mu_dyn"}),
    ColumnPanel("area", AREA, {"simulation": CORRECTED}),
    ColumnPanel("loss", Axis("loss per cycle", "J"), {"last cycle": "loss"}),
    ColumnPanel("phase", Axis("phase", "rad"), {"last cycle": "phase"}),
    ColumnPanel("energy", Axis("dissipated energy", "J"), {"dissipated": "dissipated"}),
)
CURVE_PANELS = (
    ColumnPanel("friction", FRICTION, {"steady sliding": "friction"}),
    ColumnPanel("area", AREA, {"steady sliding": CORRECTED}),
)
SHARES = {"friction": "error_friction", "loss": "error_loss", CORRECTED: "error_area"}  # columns of relative errors
SIZES = {name: f"{name}_error" for name in names_of(SWEEP) if f"{name}_error" in names_of(SWEEP)}  # of absolute errors

Rows = Sequence[dict[str, Any]]


def panels_of_sweep(directory: Path) -> list[Panel]:
    """Return panels of a sweep; an empty list without results, or if no swept key has numbers."""
    table = Results(directory, "sweep").points
    rows, place = read_cases(table), names_of(SWEEP).index
    panels = sorted((*PANELS, *offered("SWEEP_PANELS")), key=lambda panel: place(next(iter(panel.columns.values()))))
    keys = [name for name in _drop_joint_keys(rows, _swept(rows)) if all(isinstance(row[name], float) for row in rows)]
    if table.name == outputs.SWEPT_CURVES:
        panels = list(CURVE_PANELS)
        places = {name: {row[name] for row in rows if row[name] == row[name]} for name in PLACES}
        keys = [name for name, values in places.items() if len(values) > 1] + keys
    if not keys:
        return []
    boxes = {repr([row[name] for name in _swept(rows) if "grid." in name]) for row in rows}
    if (area := Results(directory, "sweep").free_area) and len(boxes) == 1:
        rows, panels = [_with_area(row, area) for row in rows], [_in_free_box(panel, area) for panel in panels]
    key = keys[0]
    word = key.split(".")[-1]
    x, found = Axis(word.replace("_", " "), unit_of_path(word)), []
    for panel in panels:
        series = _make_series(rows, key, panel.columns)
        if any(one.y.any() for one in series):  # after detachment there is neither friction nor area
            values = np.concatenate([one.x for one in series])
            wide = bool(values.min() > 0.0 and values.max() >= WIDE * values.min())
            found.append(Panel(panel.key, x, panel.y, series, log_x=wide))
    return found


def _with_area(row: dict[str, Any], area: float) -> dict[str, Any]:
    """Return a row of a sweep with contact areas [m²] in a box of an `area` [m²]."""
    found = {name: row.get(name) for name in (CORRECTED, "theory_contact_area")}
    return row | {name: share * area for name, share in found.items() if isinstance(share, float)}


def _in_free_box(panel: ColumnPanel, area: float) -> ColumnPanel:
    return replace(panel, y=to_contact_area(np.zeros(0), area)[0]) if panel.key == "area" else panel


def _swept(rows: Rows) -> list[str]:
    """Return the keys of a sweep except those that choose a sample, such as seeds."""
    return [name for name in swept_keys(rows) if name.split(".")[-1] not in SAMPLES]


def _drop_joint_keys(rows: Rows, names: Sequence[str]) -> list[str]:
    """Return the names with several values; of names that change together the first."""
    found: dict[tuple[int, ...], str] = {}
    for name in names:
        first: dict[str, int] = {}
        order = tuple(first.setdefault(repr(row[name]), number) for number, row in enumerate(rows))
        if any(order):
            found.setdefault(order, name)
    return list(found.values())


def _split(rows: Rows, key: str) -> dict[tuple[str, ...], Rows]:
    """Return the rows of each line by the values of the other keys, except `key`, the keys that change with it, and
    those that choose a sample."""
    places = [name for name in PLACES if name in rows[0]]
    others = [name for name in _drop_joint_keys(rows, [key, *places, *_swept(rows)]) if name != key]
    lines: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for row in rows:
        lines.setdefault(tuple(_named(name, row[name]) for name in others) or ("",), []).append(row)
    return dict(lines)


def _named(key: str, value: Any) -> str:
    """Return a value with its unit, and the name of its key unless the unit or word is clear."""
    word = key.split(".")[-1].removesuffix("s")
    if not isinstance(value, float):
        return Path(str(value)).stem
    text = printed.quantity(value, unit_of_path(key))
    return text if word in PLACES else f"{word.replace('_', ' ')} {text}"


def _make_series(rows: Rows, key: str, columns: Mapping[str, str]) -> list[Line]:
    """Return entries of the legend, and the lines of all columns: colours for the values of the first further key,
    dashes for those of the others, marks for the columns. Without further keys, columns have colours."""
    lines = {(hue, ", ".join(rest)): own for (hue, *rest), own in _split(rows, key).items()}
    if len({rest for _, rest in lines}) > len(STYLES):
        lines = {(", ".join(names), ""): own for names, own in lines.items()}
    hues, rests = (list(dict.fromkeys(names)) for names in zip(*lines, strict=True))
    colors, found = style.colors(max(len(hues), len(columns))), list[Line]()
    names = dict[str, dict[str, Any]]()
    names |= {hue: {"color": colors[k]} for k, hue in enumerate(hues) if len(hues) > 1}
    names |= {rest: GREY | {"linestyle": STYLES[k]} for k, rest in enumerate(rests) if len(rests) > 1}
    for (hue, rest), own in lines.items():
        for k, (name, column) in enumerate(columns.items()):
            color = colors[hues.index(hue) if len(lines) > 1 else k]
            look = {"color": color, "linestyle": STYLES[rests.index(rest)]}
            theory = f"theory, {name}" if len(columns) > 1 else "theory"
            for one in _make_lines_of_cases((name, theory), own, column, key, look, k):
                if one.name != name or len(lines) == 1:
                    names.setdefault(one.name, one.look if len(lines) == 1 else one.look | GREY)
                elif len(columns) > 1:
                    names.setdefault(name, GREY | {"marker": MARKERS[k], "linestyle": "none"})
                found.append(replace(one, name=""))
    return [*(entry(name, look) for name, look in names.items()), *found]


def _make_lines_of_cases(
    names: tuple[str, str], rows: Rows, column: str, key: str, look: dict[str, Any], number: int
) -> Iterator[Line]:
    """Yield the means of a column as a line with points, all cases as small dots, and the theory."""
    theirs = "contact_area" if column == CORRECTED else column
    x, y, theory = (_read_column(rows, wanted) for wanted in (key, column, f"theory_{theirs}"))
    if (there := np.isfinite(y)).any():
        at, means = _average(x[there], y[there])
        error = _read_errors(rows, column, y)[there][np.argsort(x[there])] if at.size == there.sum() else None
        yield Line(names[0], at, means, look | {"marker": MARKERS[number]}, error)
        if at.size < there.sum():
            dots = {"marker": ".", "linestyle": "none", "alpha": 0.5, "markersize": 3}
            yield Line("each case", x[there], y[there], look | dots)
    if (there := np.isfinite(theory)).any():
        thin = {"linestyle": DASHES[number], "linewidth": THIN_LINE}
        yield Line(names[1], *_average(x[there], theory[there]), look | thin)


def _average(x: Array, y: Array) -> tuple[Array, Array]:
    at = np.unique(x)
    return at, np.array([y[x == value].mean() for value in at])


def _read_errors(rows: Rows, column: str, values: Array) -> Array:
    """Return the relative errors of a column, NaN if unknown."""
    if column in SHARES:
        return _read_column(rows, SHARES[column])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(_read_column(rows, SIZES.get(column, "")) / np.abs(values))


def _read_column(rows: Rows, name: str) -> Array:
    values = [row.get(name) for row in rows]
    return np.array([value if isinstance(value, float) else np.nan for value in values])

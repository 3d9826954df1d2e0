"""Pictures of the results of a sweep: friction and contact area over the swept key, with theory if available; sweeps of
friction curves over velocity, or over another quantity that varies within curves.

Points are cases, lines their means over seeds. Each value of another key has its own line: values of the first such key
have colours, values of further keys dashes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..columns import SWEEP, names_of
from ..job.added_sections import answers
from ..parallel.slab import Array
from . import prefixes, style
from .charts import FRACTION, Axis, Chart, ChartLine
from .results import CURVES, PLACES, Results, read_cases, swept_keys
from .slide import CORRECTED
from .sweep_table import SAMPLES

UNITS = {"velocity": "m/s", "pressure": "Pa", "temperature": "°C", "force": "N", "size": "m", "distance": "m"}
UNITS |= {"duration": "s", "work": "J/m²", "range": "m", "shear_modulus": "Pa", "modulus_inf": "Pa"}
UNITS |= {"long_wavelength": "m", "short_wavelength": "m", "rms_height": "m", "frequency": "Hz", "amplitude": ""}
MARKERS, DASHES = ("o", "s"), ("--", ":")  # markers of means, dashes of theories, by column of a panel
THIN = 1.0  # tuning: width of lines of the theory [points]
GREY, EMPTY = {"color": style.GREY}, np.zeros(0)  # entries of legends that hold for all colours
STYLES = ("-", "--", ":", "-.")  # dashes of lines, by the values of further keys
WIDE = 10.0  # ratio of the largest to the smallest number above which an axis is logarithmic
Panels = tuple[tuple[str, Axis, dict[str, str]], ...]
FRICTION, AREA = Axis("friction coefficient"), Axis(FRACTION)
PANELS: Panels = (  # panels: columns by the names of lines
    ("friction", FRICTION, {"highest": "mu_max", "dynamic": "mu_dyn"}),
    ("area", AREA, {"simulation": CORRECTED}),
    ("loss", Axis("loss per cycle", "J"), {"last cycle": "loss"}),
    ("phase", Axis("phase", "rad"), {"last cycle": "phase"}),
    ("energy", Axis("dissipated energy", "J"), {"dissipated": "dissipated"}),
)
CURVE_PANELS: Panels = (
    ("friction", FRICTION, {"steady sliding": "friction"}),
    ("area", AREA, {"steady sliding": CORRECTED}),
)
SHARES = {
    "friction": "error_friction",
    "loss": "error_loss",
    CORRECTED: "error_area",
}  # columns with the relative error of a column
SIZES = {
    name: f"{name}_error" for name in names_of(SWEEP) if f"{name}_error" in names_of(SWEEP)
}  # columns with the absolute error of a column

Rows = Sequence[dict[str, Any]]


def all_panels() -> Panels:
    """Return the panels of a sweep, with those of capabilities, in the order of the columns of sweep.csv."""
    found = (*PANELS, *(panel for panels in answers("pictures", "SWEEP_PANELS") for panel in panels))
    place = names_of(SWEEP).index
    return tuple(sorted(found, key=lambda panel: place(next(iter(panel[2].values())))))


def chart_sweep(directory: Path) -> list[Chart]:
    """Return panels of a sweep; none without results, or without a swept key of numbers."""
    table = Results(directory, "sweep").points
    rows, panels = read_cases(table), all_panels()
    keys = _find_keys(rows)
    if table.name == CURVES:
        panels = CURVE_PANELS
        places = {name: {row[name] for row in rows if row[name] == row[name]} for name in PLACES}
        keys = [name for name, values in places.items() if len(values) > 1] + keys
    if not keys:
        return []
    key = keys[0]
    word = key.split(".")[-1]
    x, found = Axis(word.replace("_", " "), UNITS.get(word, "")), []
    for panel, y, columns in panels:
        series = _make_series(rows, key, columns)
        if any(one.y.any() for one in series):  # after detachment there is neither friction nor area
            values = np.concatenate([one.x for one in series])
            wide = bool(values.min() > 0.0 and values.max() >= WIDE * values.min())
            found.append(Chart(panel, x, y, series, log_x=wide))
    return found


def _find_keys(rows: Rows) -> list[str]:
    """Return the keys with several numbers, except those that choose a sample; of keys that change together the
    first."""
    keys = _drop_joint_keys(rows, _swept(rows))
    return [name for name in keys if all(isinstance(row[name], float) for row in rows)]


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
    text = prefixes.quantity(value, UNITS.get(word, ""))
    return text if word in PLACES else f"{word.replace('_', ' ')} {text}"


def _make_series(rows: Rows, key: str, columns: dict[str, str]) -> list[ChartLine]:
    """Return entries of the legend, and the lines of all columns: colours for the values of the first further key,
    dashes for those of the others, marks for the columns. Without further keys, columns have colours."""
    lines = {(hue, ", ".join(rest)): own for (hue, *rest), own in _split(rows, key).items()}
    if len({rest for _, rest in lines}) > len(STYLES):
        lines = {(", ".join(names), ""): own for names, own in lines.items()}
    hues, rests = (list(dict.fromkeys(names)) for names in zip(*lines, strict=True))
    colors, found = style.colors(max(len(hues), len(columns))), list[ChartLine]()
    names = dict[str, dict[str, Any]]()
    names |= {hue: {"color": colors[k]} for k, hue in enumerate(hues) if len(hues) > 1}
    names |= {rest: GREY | {"linestyle": STYLES[k]} for k, rest in enumerate(rests) if len(rests) > 1}
    for (hue, rest), own in lines.items():
        for k, (name, column) in enumerate(columns.items()):
            color = colors[hues.index(hue) if len(lines) > 1 else k]
            look = {"color": color, "linestyle": STYLES[rests.index(rest)]}
            theory = f"theory, {name}" if len(columns) > 1 else "theory"
            for one in _make_lines((name, theory), own, column, key, look, k):
                if one.name != name or len(lines) == 1:
                    names.setdefault(one.name, one.look if len(lines) == 1 else one.look | GREY)
                elif len(columns) > 1:
                    names.setdefault(name, GREY | {"marker": MARKERS[k], "linestyle": "none"})
                found.append(replace(one, name=""))
    return [*(ChartLine(name, EMPTY, EMPTY, look) for name, look in names.items()), *found]


def _make_lines(
    names: tuple[str, str], rows: Rows, column: str, key: str, look: dict[str, Any], number: int
) -> Iterator[ChartLine]:
    """Yield the means of a column as a line with points, all cases as small dots, and the theory."""
    theirs = "contact_area" if column == CORRECTED else column
    x, y, theory = (_read_column(rows, wanted) for wanted in (key, column, f"theory_{theirs}"))
    if (there := np.isfinite(y)).any():
        at, means = _average(x[there], y[there])
        error = _read_errors(rows, column, y)[there][np.argsort(x[there])] if at.size == there.sum() else None
        yield ChartLine(names[0], at, means, look | {"marker": MARKERS[number]}, error)
        if at.size < there.sum():
            dots = {"marker": ".", "linestyle": "none", "alpha": 0.5, "markersize": 3}
            yield ChartLine("each case", x[there], y[there], look | dots)
    if (there := np.isfinite(theory)).any():
        thin = {"linestyle": DASHES[number], "linewidth": THIN}
        yield ChartLine(names[1], *_average(x[there], theory[there]), look | thin)


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

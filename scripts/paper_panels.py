"""Parts that the figures of the paper share: tables of runs and sweeps, and lines over distance or a key."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from parcontact.effects.relaxation import relaxation_of
from parcontact.job import Job, load
from parcontact.plotting import style
from parcontact.storage import tables
from parcontact.summary import slide, sweep_table, theory_settings

QUANTITIES = (("mu_max", "$\\mu_{max}$"), ("mu_dyn", "$\\mu_{dyn}$"), ("contact_area", "area"))  # columns, names
WIDTH, HEIGHT = 3.15, 2.1  # of a picture and of a panel [inch]: 8 cm
TITLE = 5.2  # points, of the title of a legend
LOOKS: tuple[tuple[dict[str, Any], str, str, bool], ...] = (  # of sweeps: points, theory, its error; with names
    ({"fmt": "o-"}, "--", "-", True),
    ({"fmt": "D", "mfc": "none"}, ":", ":", False),  # on a finer grid
)


class MissingError(Exception):
    """The results that a figure is drawn from are not there."""


def there(path: Path) -> Path:
    if not path.is_file():
        raise MissingError(f"{path} is missing")
    return path


def columns(directory: Path, name: str = "measures.csv") -> dict[str, np.ndarray]:
    return {key: np.array(values) for key, values in tables.read(there(directory / name)).items()}


def panels(count: int, height: float = HEIGHT) -> tuple[Figure, Sequence[Axes]]:
    figure = Figure(figsize=(WIDTH, 0.15 + height * count), layout="constrained")
    return figure, figure.subplots(count, 1, squeeze=False)[:, 0]


def explain(axes: Axes, directory: Path, **look: Any) -> None:
    """The legend of a panel, with the settings of the theory if they are known, and those of all cases of a sweep."""
    axes.legend(**look, title=theory_settings.describe(directory) or None, title_fontsize=TITLE)


def moduli(job: Job) -> tuple[float, float]:
    """Return the moduli of the first instant and in the end [Pa]."""
    series = relaxation_of(job.material)
    return series.modulus_inf + float(series.moduli.sum()), series.modulus_inf


def over_distance(axes: Axes, directory: Path, name: str, label: str, number: int = 0, start: float = 0.0) -> None:
    """Simulation and theory of one case over the distance slid since an instant [s]; logarithmic, in um."""
    for table, dashes, of in (("measures.csv", "-", "simulation"), ("theory.csv", "--", "theory")):
        found = columns(directory, table)
        distance = found["distance"] - found["distance"][found["time"] <= start * (1 + 1e-9)][-1]
        slid = distance > 0
        axes.semilogx(1e6 * distance[slid], found[name][slid], dashes, color=style.COLORS[number], label=f"{of}{label}")


def means(rows: Sequence[dict[str, Any]], key: str, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values of a key, means and standard deviations over its cases that are done."""
    at = sorted({row[key] for row in rows})
    groups = [np.array([row[name] for row in rows if row[key] == value and row[name] == row[name]]) for value in at]
    there = [k for k, group in enumerate(groups) if group.size]
    spread = [groups[k].std(ddof=1) if groups[k].size > 1 else 0.0 for k in there]
    return np.array(at)[there], np.array([groups[k].mean() for k in there]), np.array(spread)


def rows_of(directory: Path) -> list[dict[str, Any]]:
    """Rows of the table of a sweep, with the contact area of simulations as corrected for its edges."""
    rows = sweep_table.read(there(directory / "sweep.csv"))
    for row in rows:
        case = directory / "cases" / f"{int(row['case']):03d}"
        if row["state"] == "done":
            found = tables.read(case / "measures.csv")
            found["contact_area"] = found[slide.CORRECTED]
            measured = slide.measure(load(case / "job.resolved.yaml").history, found)
            row["contact_area"] = measured.contact_area if measured else np.nan
    return rows


def over_key(out: Path, name: str, key: str, label: str, scale: float = 1.0) -> Figure:
    """Friction, area and the error of the theory over the key of a sweep; bars are standard deviations over seeds.

    The same with shorter waves, in the directory NAME_finer, has open markers, its theory dotted lines.
    """
    found = [rows_of(out / name)]
    if (out / f"{name}_finer" / "sweep.csv").is_file():
        found.append(rows_of(out / f"{name}_finer"))
    figure, (top, middle, bottom) = panels(3, 1.75)
    for rows, (marks, dashes, line, told) in zip(found, LOOKS, strict=False):
        for number, (axes, (column, short)) in enumerate(zip((top, top, middle), QUANTITIES, strict=True)):
            look = {"color": style.COLORS[number]}
            (x, y, spread), (tx, theory, _) = (means(rows, key, each) for each in (column, f"theory_{column}"))
            names = [f"{short}, simulation", f"{short}, theory", short] if told else [None] * 3
            axes.errorbar(scale * x, y, spread if told else None, label=names[0], capsize=2, **marks, **look)
            axes.plot(scale * tx, theory, dashes, label=names[1], **look)
            if x.size == tx.size:
                kind = {"mfc": marks.get("mfc"), "label": names[2]}
                bottom.plot(scale * x, 100 * (theory - y) / y, "os^"[number] + line, **look, **kind)
    top.set(ylabel="friction coefficient", ylim=(0, 1.7 * top.get_ylim()[1]))
    middle.set(ylabel="contact area ratio", yscale="log")
    bottom.axhline(0, color=style.GREY, lw=0.6)
    bottom.set(ylabel="theory − simulation [%]", xlabel=label)
    bottom.set_ylim(top=0.4 * abs(bottom.get_ylim()[0]))
    if len(found) > 1:
        bottom.plot([], [], "D:", color=style.GREY, mfc="none", label="waves of the paper")
    for axes in (top, middle, bottom):
        axes.set_xscale("log")
    explain(top, out / name, loc="upper center", ncols=2)
    middle.legend()
    bottom.legend(loc="upper right", ncols=2)
    return figure

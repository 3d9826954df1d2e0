"""How often what a run says of its errors holds, in tables and a picture."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas
from matplotlib.axes import Axes
from matplotlib.figure import Figure

PARTS = ("solver", "time", "folded", "mesh")
GOAL = 0.95  # of the scenes
HALF = 0.5 * (1.0 - 1e-6)  # of the true error is what an estimate has to be at least, up to rounding
ROUNDING = 1e-12  # of friction and of area: errors below it are none
SECOND_RANGE = 200  # from this number on scenes were not looked at before
QUANTITIES = {"friction": "friction", "area": "corrected area"}
CELLS = (0.0, 3.0, 4.0, 6.0, 8.0, 16.0, math.inf)
CLASSES = ("body", "surface", "boundary", "history", "cells")
HEAD = (
    "kept or warned | warned | of the others kept | estimate >= half of the error | estimate/error: median | 5 to 95 %"
)


def judged(table: Path) -> pandas.DataFrame:
    """A row for each scene and quantity, in turn, of which the scene says how wrong it is, and how it is to be judged.

    `told`: it says that the accuracy asked for is not met. `kept`: it is as wrong as asked for at most, up to rounding,
    or says that it is not. `resolved`: the true error is more than what the reference says of its own. `covered`: the
    estimate is at least half of the true error; differences that a reference cannot tell are none.
    """
    lines = pandas.read_csv(table).sort_values("scene")
    lines = lines[lines.failure.isna()]
    both = []
    for name in QUANTITIES:
        own = {f"{name}_{key}": key for key in ("true", "error", "estimate", "printed", "resolution", *PARTS)}
        both.append(lines.rename(columns={name: "value", **own}).assign(quantity=name))
    found = pandas.concat(both)[[*lines.columns[:8], *own.values(), "value", "quantity"]].dropna(subset="error")
    found["told"] = found.printed > found.asked
    found["kept"] = found.told | (found.error <= np.maximum(found.asked * found.true, ROUNDING))
    found["resolved"] = found.error > np.maximum(found.resolution, ROUNDING)
    found["covered"] = (found.estimate >= HALF * found.error) | ~found.resolved
    return found.sort_values("scene", kind="stable")


def misses(found: pandas.DataFrame) -> pandas.DataFrame:
    return found[~(found.kept & found.covered)]


def keeps_its_promise(found: pandas.DataFrame) -> bool:
    """Whether as many scenes as promised keep their accuracy, or say that they do not."""
    return bool(found.groupby("scene").kept.all().mean() >= GOAL)


def text(found: pandas.DataFrame, failed: pandas.DataFrame) -> str:
    """All tables, as Markdown."""
    return "\n".join(
        ["# Coverage of the error estimates\n", *_tables(found), *_missed(misses(found)), *_failed(failed), ""]
    )


def _tables(found: pandas.DataFrame) -> Iterator[str]:
    yield f"| scenes | of | {HEAD} |\n|{8 * '---|'}"
    late = found.scene >= SECOND_RANGE
    for title, some in (("first half", found[~late]), ("second half", found[late]), ("all", found)):
        for name, label in QUANTITIES.items():
            if len(own := some[some.quantity == name]):
                yield f"| {title}: {len(own)} | {label} | {_row(own)} |"
        if len(some):
            yield f"| {title}: {some.scene.nunique()} | both | {_row(some)} |"
    for name, label in QUANTITIES.items():
        yield f"\n## {label.capitalize()}, by class\n\n| class | scenes | {HEAD} |\n|{8 * '---|'}"
        own = found[found.quantity == name]
        cells = pandas.cut(own.cells, CELLS, labels=[_range(*pair) for pair in pairwise(CELLS)])
        for key in CLASSES:
            for group, some in own.groupby(cells if key == "cells" else key, observed=True):
                yield f"| {key}: {group} | {len(some)} | {_row(some)} |"


def _range(low: float, high: float) -> str:
    return f"{low:g} to {high:g}".rjust(7) if high < math.inf else f"above {low:g}"


def _row(some: pandas.DataFrame) -> str:
    """Shares of the scenes, in all that is asked of them, and quantiles of estimates over errors."""
    scenes = some.groupby("scene").agg({"kept": "all", "told": "any", "covered": "all"})
    silent = scenes[~scenes.told]
    others = f"{100 * silent.kept.mean():.1f} %" if len(silent) else "-"
    ratios = (some.estimate / some.error)[some.resolved]
    low, middle, high = np.percentile(ratios, [5, 50, 95]) if len(ratios) else [math.nan] * 3
    return (
        f"{100 * scenes.kept.mean():.1f} % | {100 * scenes.told.mean():.0f} % | {others} "
        f"| {100 * scenes.covered.mean():.1f} % | {middle:.2g} | {low:.2g} to {high:.2g}"
    )


def _missed(missed: pandas.DataFrame) -> Iterator[str]:
    yield "\n## Misses\n\nErrors and estimates are shares of the true value; `--job NUMBER` writes a job.\n"
    yield f"| scene | what | of | asked | true error | estimate | {', '.join(PARTS)} | class |\n|{8 * '---|'}"
    for line in missed.itertuples():
        what = " and ".join([*["not kept"] * (not line.kept), *["too small"] * (not line.covered)])
        absolute = not line.true > 0.0

        def told(number: float, line=line, absolute: bool = absolute) -> str:
            return f"{number:.2g}" if absolute else f"{100 * number / line.true:.2g} %"

        parts = ", ".join(told(getattr(line, part)) for part in PARTS)
        about = f"{line.body}, {line.surface}, {line.boundary}, {line.history}, {line.points}, {line.cells} cells"
        name = QUANTITIES[line.quantity] + " (absolute)" * absolute
        head = f"| {line.scene} | {what} | {name} | {100 * line.asked:.2g} % | {told(line.error)} "
        yield f"{head}| {told(line.estimate)} | {parts} | {about} |"


def _failed(failed: pandas.DataFrame) -> Iterator[str]:
    if len(failed):
        yield "\n## Scenes that ended without a result\n"
        yield from (f"* {line.scene}: {line.failure}" for line in failed.itertuples())


def picture(found: pandas.DataFrame, path: Path) -> None:
    """Estimates over true errors, a panel for each quantity and kind of class."""
    keys = ("surface", "history", "body")
    figure = Figure(figsize=(15, 9.5), layout="constrained")
    for row, name in zip(figure.subplots(len(QUANTITIES), len(keys)), QUANTITIES, strict=True):
        for axes, key in zip(row, keys, strict=True):
            _panel(axes, found[(found.quantity == name) & (found.error > ROUNDING)], key)
            axes.set(xlabel=f"true error of {QUANTITIES[name]} [-]", ylabel="estimate [-]")
    figure.savefig(path, dpi=110)


def _panel(axes: Axes, found: pandas.DataFrame, key: str) -> None:
    size = found.true.where(found.true != 0.0, found.value)
    for index, (group, some) in enumerate(found.groupby(key)):
        look = {"marker": "os^vDP*Xd"[index % 9], "color": f"C{index}", "label": group, "alpha": 0.8, "linewidth": 0}
        axes.scatter(some.error / size[some.index], some.estimate / size[some.index], s=16, **look)
    ends: Sequence[float] = np.array([1e-6, 10.0])
    for times, style, label in ((1.0, "-", "1x"), (2.0, "--", "2x, 1/2x"), (0.5, "--", None)):
        axes.plot(ends, times * ends, style, color="0.4", linewidth=0.8, label=label)
    axes.set(xscale="log", yscale="log", xlim=ends, ylim=ends)
    axes.legend(fontsize=7, loc="upper left", ncols=2)

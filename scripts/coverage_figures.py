"""The figures of `scripts/coverage.py`: how often what a run says of its errors holds, in a table and a picture."""

import csv
import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

Line = dict[str, str]
PARTS = ("solver", "time", "folded", "mesh")
GOAL = 0.95  # of the scenes
HALF = 0.5 * (1.0 - 1e-6)  # of the true error is what an estimate has to be at least, up to rounding
ROUNDING = 1e-12  # of friction and of area: errors below it are none
SECOND_RANGE = 200  # from this number on scenes were not looked at before
QUANTITIES = {"friction": "friction", "area": "corrected area"}
CLASSES = ("body", "surface", "boundary", "history", "cells")
HEAD = "kept or told | told | of the others kept | estimate >= half of the error | estimate/error: median | 5 to 95 %"
CELLS = (3.0, 4.0, 6.0, 8.0, 16.0)


def read(path: Path) -> list[Line]:
    """The lines of a table that are whole; none without a table."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return sorted((line for line in csv.DictReader(file) if None not in line.values()), key=_number)


def _number(line: Line) -> int:
    return int(line["scene"])


def value(line: Line, key: str) -> float:
    return float(line[key]) if line.get(key) else math.nan


def known(line: Line) -> list[str]:
    """The quantities of which it says how wrong they are."""
    return [name for name in QUANTITIES if line.get(f"{name}_error")]


def is_told(line: Line, name: str) -> bool:
    """Whether it says that the accuracy asked for is not met."""
    return value(line, f"{name}_printed") > value(line, "asked")


def is_kept(line: Line, name: str) -> bool:
    """Whether it is as wrong as asked for at most, up to rounding, or says that it is not."""
    allowed = max(value(line, "asked") * value(line, f"{name}_true"), ROUNDING)
    return is_told(line, name) or value(line, f"{name}_error") <= allowed


def is_covered(line: Line, name: str) -> bool:
    """Whether the estimate is at least half of the true error; differences that a reference cannot tell are none."""
    error = value(line, f"{name}_error")
    return value(line, f"{name}_estimate") >= HALF * error or not is_resolved(line, name)


def is_resolved(line: Line, name: str) -> bool:
    """Whether the true error is more than what the reference says of its own."""
    return value(line, f"{name}_error") > max(value(line, f"{name}_resolution"), ROUNDING)


def ratio(line: Line, name: str) -> float:
    return value(line, f"{name}_estimate") / value(line, f"{name}_error")


def misses(lines: list[Line]) -> list[int]:
    """Numbers of scenes that do not keep or do not cover something."""
    ran = [line for line in lines if not line["failure"]]
    wrong = [line for line in ran if not all(is_kept(line, n) and is_covered(line, n) for n in known(line))]
    return [_number(line) for line in wrong]


def figures(lines: list[Line]) -> tuple[str, bool]:
    """As Markdown, and whether the promise is kept."""
    ran = [line for line in lines if not line["failure"]]
    parts = ["# Coverage of the error estimates\n", *_all(lines, ran)]
    for name in QUANTITIES:
        parts += _by_class(ran, name)
    parts += _missed(ran)
    failed = [line for line in lines if line["failure"]]
    parts += ["\n## Scenes that ended without a result\n", *(f"* {a['scene']}: {a['failure']}" for a in failed)] * (
        len(failed) > 0
    )
    return "\n".join(parts) + "\n", _share(ran, lambda line: all(is_kept(line, n) for n in known(line))) >= GOAL


def _share(lines: list[Line], holds: Callable[[Line], bool]) -> float:
    return sum(holds(line) for line in lines) / len(lines) if lines else 1.0


def _all(lines: list[Line], ran: list[Line]) -> Iterator[str]:
    seconds = sum(value(line, key) for line in ran for key in ("seconds", "reference_seconds"))
    yield f"{len(lines)} scenes, {len(lines) - len(ran)} without a result, {seconds / 60:.1f} CPU minutes\n"
    yield f"| scenes | of | {HEAD} |"
    yield "|---|---|---|---|---|---|---|---|"
    first = [line for line in ran if _number(line) < SECOND_RANGE]
    second = [line for line in ran if _number(line) >= SECOND_RANGE]
    for title, some in (("first half", first), ("second half", second), ("all", ran)):
        for name, label in QUANTITIES.items():
            there = [line for line in some if name in known(line)]
            if there:
                yield f"| {title}: {len(there)} | {label} | {_row(there, [name])} |"
        if some:
            yield f"| {title}: {len(some)} | both | {_row(some, list(QUANTITIES))} |"


def _row(lines: list[Line], names: list[str]) -> str:
    def every(holds: Callable[[Line, str], bool]) -> float:
        return 100 * _share(lines, lambda line: all(holds(line, n) for n in names if n in known(line)))

    silent = [line for line in lines if not any(is_told(line, n) for n in names if n in known(line))]
    told = 100 * (1.0 - len(silent) / len(lines))
    others = f"{100 * _share(silent, lambda line: all(is_kept(line, n) for n in names if n in known(line))):.1f} %"
    ratios = [ratio(line, n) for line in lines for n in names if n in known(line) and is_resolved(line, n)]
    low, middle, high = np.percentile(ratios, [5, 50, 95]) if ratios else [math.nan] * 3
    kept, covered = every(is_kept), every(is_covered)
    return (
        f"{kept:.1f} % | {told:.0f} % | {others if silent else '-'} | {covered:.1f} % | {middle:.2g} "
        f"| {low:.2g} to {high:.2g}"
    )


def _by_class(ran: list[Line], name: str) -> Iterator[str]:
    """Quantiles of each class."""
    yield f"\n## {QUANTITIES[name].capitalize()}, by class\n"
    yield f"| class | scenes | {HEAD} |"
    yield "|---|---|---|---|---|---|---|---|"
    for key in CLASSES:
        groups: dict[str, list[Line]] = {}
        for line in ran:
            if name in known(line):
                groups.setdefault(_class(line, key), []).append(line)
        for group in sorted(groups):
            yield f"| {key}: {group} | {len(groups[group])} | {_row(groups[group], [name])} |"


def _class(line: Line, key: str) -> str:
    if key != "cells":
        return line[key]
    cells, low = value(line, "cells"), 0.0
    for high in CELLS:
        if cells <= high:
            return f"{low:g} to {high:g}".rjust(7)
        low = high
    return f"above {low:g}"


def _missed(ran: list[Line]) -> Iterator[str]:
    yield "\n## Misses\n"
    yield "Errors and estimates are shares of the true value; `--job NUMBER` writes the job of a scene.\n"
    yield "| scene | what | of | asked | true error | estimate | solver, time, folded, mesh | class |"
    yield "|---|---|---|---|---|---|---|---|"
    for line in ran:
        for name in known(line):
            wrong = [*["not kept"] * (not is_kept(line, name)), *["too small"] * (not is_covered(line, name))]
            if wrong:
                yield _miss(line, name, " and ".join(wrong))


def _miss(line: Line, name: str, what: str) -> str:
    true = value(line, f"{name}_true")
    size = true if true > 0.0 else math.nan
    unit = "" if true > 0.0 else " (absolute)"

    def told(key: str) -> str:
        number = value(line, f"{name}_{key}")
        return f"{number:.2g}" if size != size else f"{100 * number / size:.2g} %"

    about = ", ".join(line[key] for key in ("body", "surface", "boundary", "history", "points"))
    parts = ", ".join(told(part) for part in PARTS)
    return (
        f"| {line['scene']} | {what} | {QUANTITIES[name]}{unit} | {100 * value(line, 'asked'):.2g} % | {told('error')} "
        f"| {told('estimate')} | {parts} | {about}, {line['cells']} cells |"
    )


def picture(lines: list[Line], path: Path) -> None:
    """Estimates over true errors, a panel for each quantity and kind of class."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    ran = [line for line in lines if not line["failure"]]
    keys = ("surface", "history", "body")
    figure, axes = pyplot.subplots(len(QUANTITIES), len(keys), figsize=(15, 9.5), squeeze=False, layout="constrained")
    for row, name in zip(axes, QUANTITIES, strict=True):
        for axis, key in zip(row, keys, strict=True):
            _panel(axis, [line for line in ran if name in known(line)], name, key)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def _panel(axis, lines, name, key):
    for index, group in enumerate(sorted({line[key] for line in lines})):
        some = [line for line in lines if line[key] == group and value(line, f"{name}_error") > ROUNDING]
        relative = [value(line, f"{name}_true") or value(line, name) for line in some]
        x = [value(line, f"{name}_error") / size for line, size in zip(some, relative, strict=True)]
        y = [value(line, f"{name}_estimate") / size for line, size in zip(some, relative, strict=True)]
        axis.scatter(x, y, s=16, marker="os^vDP*Xd"[index % 9], color=f"C{index}", label=group, alpha=0.8, linewidth=0)
    ends = np.array([1e-6, 10.0])
    for times, style, label in ((1.0, "-", "1x"), (2.0, "--", "2x, 1/2x"), (0.5, "--", None)):
        axis.plot(ends, times * ends, style, color="0.4", linewidth=0.8, label=label)
    axis.set(xscale="log", yscale="log", xlim=(1e-6, 10.0), ylim=(1e-6, 10.0))
    axis.set(xlabel=f"true error of {QUANTITIES[name]} [-]", ylabel="estimate [-]")
    axis.legend(fontsize=7, loc="upper left", ncols=2)

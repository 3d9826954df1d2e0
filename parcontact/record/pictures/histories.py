"""Histories: what was measured, over time, distance or load."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from ...parallel.slab import Array
from .run import Panel, Run, scaled

BLUE, RED, GREEN, GREY = "#1f4e79", "#b03a2e", "#3a7d44", "0.55"


@dataclass(frozen=True)
class Abscissa:
    """What histories are drawn over, and where the stages are."""

    label: str
    values: Array
    stages: Sequence[tuple[str, float, float]] = ()
    marker: str = ""

    def mark(self, axes: Axes, named: bool) -> None:
        """Show where stages begin, and the names of those that are wide enough."""
        span = float(np.ptp(self.values)) or 1.0
        for number, (name, start, end) in enumerate(self.stages):
            if number:
                axes.axvline(start, color=GREY, lw=0.7, ls=":", zorder=0)
            if named and len(self.stages) > 1 and end - start > 0.02 * len(name) * span:
                middle = ((start + end) / 2, 1.02)
                axes.text(*middle, name, color=GREY, ha="center", fontsize=8, transform=axes.get_xaxis_transform())


def histories(run: Run) -> Iterator[Panel]:
    """Panels of what was measured."""
    if not run.curves:
        return
    over = _over_time(run) if run.lasts else _over_load(run)
    if run.slides:
        yield _friction(over, run.column("friction"))
    contact = run.column("contact_area")
    if run.free:
        small = contact.max() * run.area < 1e-9
        area, name = contact * run.area * (1e12 if small else 1e6), f"contact area [{'µm' if small else 'mm'}²]"
        where = np.where(run.column("pressure") > 0.0, run.column("approach"), np.nan)
        yield _lines(over, name, "", [("", area, BLUE)], bottom=0.0, named=not run.slides)
        yield _lines(over, "approach", "m", [("", where, BLUE)])
    else:
        yield _lines(over, "contact area / nominal area", "", [("", contact, BLUE)], bottom=0.0)
        if contact.min() < 1.0:
            yield _lines(over, "mean gap", "m", [("", run.column("mean_gap"), BLUE)], bottom=0.0)
    yield _lines(over, "highest pressure", "Pa", [("", run.column("max_pressure"), RED)], bottom=0.0)
    name, unit, load = run.load
    if run.lasts and np.ptp(load) > 1e-9 * load.max():
        yield _lines(over, name, unit, [("", load, BLUE)], bottom=0.0)
    if run.lasts and np.isfinite(run.column("work")).all():
        parts = (("work done on the body", "work", "k"), ("dissipated", "dissipated", RED), ("stored", "stored", GREEN))
        yield _lines(over, "energy", "J", [(label, run.column(column), color) for label, column, color in parts])


def numbers(run: Run) -> str:
    """What the last solve has found, in words."""
    name, unit, load = run.load
    where = "approach" if run.free else "mean_gap"
    found = [(name, unit, load), (where.replace("_", " "), "m", run.column(where))]
    found.append(("highest pressure", "Pa", run.column("max_pressure")))
    area = f"contact area {run.column('contact_area')[-1]:.4g} of the nominal"
    if run.free:
        area = f"contact area {run.column('contact_area')[-1] * run.area * 1e6:.4g} mm²"
    texts = []
    for label, symbol, values in found:
        prefixed, (shown,) = scaled(symbol, values)
        texts.append(f"{label} {shown[-1]:.4g} {prefixed}")
    return ",   ".join([texts[0], area, *texts[1:]])


def _over_time(run: Run) -> Abscissa:
    """Distance if the surface slides in all stages that last, else time."""
    slides = all(stage.speed > 0.0 for stage in run.job.history if stage.seconds)
    name, unit = ("distance", "m") if slides else ("time", "s")
    label, (values,) = scaled(unit, run.column(name))
    found = run.stages
    stages = []
    for number in sorted(set(found.tolist())):
        rows = np.flatnonzero(found == number)
        start = values[max(rows[0] - 1, 0)]
        stages.append((run.job.history[number].name, float(start), float(values[rows[-1]])))
    return Abscissa(f"{'distance slid' if slides else 'time'} [{label}]", values, stages)


def _over_load(run: Run) -> Abscissa:
    name, unit, load = run.load
    label, (values,) = scaled(unit, load)
    return Abscissa(f"{name} [{label}]", values, marker="o")


def _lines(
    over: Abscissa,
    name: str,
    unit: str,
    series: Sequence[tuple[str, Array, str]],
    bottom: float | None = None,
    named: bool = False,
) -> Panel:
    def draw(axes: Axes) -> None:
        label, shown = scaled(unit, *(values for _, values, _ in series)) if unit else ("", [s[1] for s in series])
        for (text, _, color), values in zip(series, shown, strict=True):
            axes.plot(over.values, values, over.marker + "-", ms=4, color=color, label=text or None)
        axes.set(xlabel=over.label, ylabel=f"{name} [{label}]" if label else name)
        axes.set_ylim(bottom=bottom)
        over.mark(axes, named)
        if series[0][0]:
            axes.legend()

    return draw


def _friction(over: Abscissa, friction: Array) -> Panel:
    plain = _lines(over, "friction coefficient", "", [("", friction, BLUE)], bottom=0.0, named=True)

    def draw(axes: Axes) -> None:
        plain(axes)
        peak = int(np.argmax(friction))
        if 0 < peak < friction.size - 1 and friction[peak] > 1.02 * friction[-1]:
            x, unit = over.values[peak], over.label.rsplit("[", 1)[-1].rstrip("]")
            axes.plot(x, friction[peak], "o", ms=4, color=RED)
            text = f"{friction[peak]:.3g} at {x:.3g} {unit}"
            axes.annotate(text, (x, friction[peak]), (8, -3), textcoords="offset points", color=RED, fontsize=8)

    return draw

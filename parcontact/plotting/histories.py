"""Histories: what was measured in a run, over time, distance, velocity or load."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..parallel.slab import Array
from ..storage import measures
from . import style, units
from .charts import FRACTION, Axis, Chart, Series
from .run import Run

EARLY = 0.05  # of the time that is shown: as long as half of the rows lie within it, a linear axis is hardly used
FEW_ROWS = 8
OVER = ("time", "distance", "velocity", "load")


@dataclass(frozen=True)
class Abscissa:
    """What histories are drawn over: which rows, in SI, and where the stages are."""

    axis: Axis
    values: Array
    rows: NDArray[np.intp]
    stages: Sequence[tuple[str, float, float]] = ()
    marked: bool = False

    def series(self, values: Array, name: str = "", number: int = 0) -> Series:
        look = {
            **style.line(number),
            **({"linestyle": "-"} if not name else {}),
            **({"marker": "o"} if self.marked else {}),
        }
        return Series(name, self.values, values[self.rows], look)


def charts(run: Run, over: str = "") -> list[Chart]:
    """Panels of what was measured; none of a single solve. Raises InputError where there is nothing to draw over."""
    if not run.curves:
        return []
    along = _abscissa(run, over)
    log = along.axis.unit == "s" and _steps_grow(along.values)
    changes: dict[str, Any] = {"stages": along.stages, "spikes": not along.marked, "log_x": log}
    found = [replace(chart, **changes, named=number == 0) for number, chart in enumerate(_charts(run, along))]
    return found if along.marked else [_beside_theory(chart, run) for chart in found]


def _steps_grow(times: Array) -> bool:
    """Whether most rows are so early that only a logarithmic axis tells them apart."""
    later = times[times > 0.0]
    return later.size > FEW_ROWS and bool(np.median(later) < EARLY * later[-1]) and bool(later[0] < EARLY * later[-1])


def _beside_theory(chart: Chart, run: Run) -> Chart:
    """Friction and contact area with the lines of theory.csv, if that is in the directory of the run."""
    column = {"friction": "friction", "area": "contact_area"}.get(chart.key)
    table = run.directory / "theory.csv"
    if column is None or run.backwards or not table.is_file():
        return chart
    theory = {name: np.array(values) for name, values in measures.read(table).items()}
    over = "distance" if chart.x.unit == "m" else "time"
    (own,) = chart.series
    lines = [replace(own, name="simulation"), Series("theory", theory[over], theory[column], style.line(1))]
    if chart.key == "friction" and run.viscous is not None:  # the theory knows of no interface
        lines.append(Series("without interface", own.x, run.viscous, style.line(2)))
    return replace(chart, series=lines)


def _charts(run: Run, along: Abscissa) -> Iterator[Chart]:
    if run.slides:
        signed = run.backwards and not along.marked  # over the speed, no direction is told
        name = "friction coefficient" + "\nalong x" * signed
        values = along.series(run.signed if signed else run.column("friction"))
        yield Chart("friction", along.axis, Axis(name), [values], peak=not along.marked)
    contact = run.column("contact_area")
    if run.free:
        yield Chart("area", along.axis, Axis("contact area", "m²"), [along.series(contact * run.area)])
        where = np.where(run.column("pressure") > 0.0, run.column("approach"), np.nan)
        yield Chart("approach", along.axis, Axis("approach", "m"), [along.series(where)], bottom=False)
    else:
        yield Chart("area", along.axis, Axis(FRACTION), [along.series(contact)])
        if contact.min() < 1.0:
            yield Chart("gap", along.axis, Axis("mean gap", "m"), [along.series(run.column("mean_gap"))])
    highest = along.series(run.column("max_pressure"))
    yield Chart("pressure", along.axis, Axis("highest pressure", "Pa"), [highest])
    name, unit, load = run.load
    if run.lasts and np.ptp(load) > 1e-9 * load.max():
        yield Chart("load", along.axis, Axis(name, unit), [along.series(load)])
    if run.lasts and np.isfinite(run.column("work")).all():
        parts = (("work done", "work"), ("dissipated", "dissipated"), ("stored", "stored"))
        lines = [along.series(run.column(column), label, number) for number, (label, column) in enumerate(parts)]
        yield Chart("energy", along.axis, Axis("energy", "J"), lines)


def numbers(run: Run) -> str:
    """What the last solve has found, in words."""
    name, unit, load = run.load
    area = f"contact area {run.column('contact_area')[-1]:.4g} of the nominal"
    if run.free:
        area = f"contact area {units.text(run.column('contact_area')[-1] * run.area, 'm²', 4)}"
    where = "approach" if run.free else "mean_gap"
    lengths = f"{where.replace('_', ' ')} {units.text(run.column(where)[-1], 'm', 4)}"
    pressure = f"highest pressure {units.text(run.column('max_pressure')[-1], 'Pa', 4)}"
    return f"{name} {units.text(load[-1], unit, 4)},  {area},\n{lengths},  {pressure}"


def _abscissa(run: Run, over: str) -> Abscissa:
    """What was asked for, else the distance if the surface slides in all stages that last, else time, else the load."""
    everywhere = np.arange(run.column("step").size)
    if not over:
        slides = run.slides and all(stage.speed > 0.0 for stage in run.job.history if stage.seconds)
        over = ("distance" if slides else "time") if run.lasts else "load"
    if over == "load":
        name, unit, load = run.load
        return Abscissa(Axis(name, unit), load, everywhere, marked=True)
    if over == "velocity":
        return _over_velocity(run)
    name, unit = ("distance slid", "m") if over == "distance" else ("time", "s")
    values = run.column(over)
    if not np.ptp(values):
        raise InputError(f"{run.directory}: there is nothing to draw over {over}, which stays {values[-1]:g} {unit}")
    return Abscissa(Axis(name, unit), values, everywhere, _stages(run, values))


def _stages(run: Run, values: Array) -> list[tuple[str, float, float]]:
    found = run.stages
    stages = []
    for number in sorted(set(found.tolist()) - {-1}):
        rows = np.flatnonzero(found == number)
        stages.append((run.job.history[number].name, float(values[max(rows[0] - 1, 0)]), float(values[rows[-1]])))
    return stages


def refuse_one_velocity(run: Run) -> None:
    """Raise InputError for a run that slides at one velocity: over it there is a dot, but no line."""
    speeds = {stage.speed for stage in run.job.history if stage.speed > 0.0}
    if len(speeds) == 1:
        raise InputError(
            f"{run.directory}: there is nothing to draw over velocity, which is {speeds.pop():g} m/s wherever the "
            "surface slides; --compare draws several runs in one picture"
        )


def _over_velocity(run: Run) -> Abscissa:
    """The last row of each stage that slides: what has come of its velocity."""
    found = run.stages
    speeds = {int(np.flatnonzero(found == k)[-1]): run.job.history[k].speed for k in set(found.tolist()) - {-1}}
    rows = sorted((row for row, speed in speeds.items() if speed > 0.0), key=lambda row: speeds[row])
    if not rows:
        raise InputError(f"{run.directory}: there is nothing to draw over velocity, the surface slides in no stage")
    values = np.array([speeds[row] for row in rows])
    return Abscissa(Axis("sliding velocity", "m/s"), values, np.array(rows), marked=True)

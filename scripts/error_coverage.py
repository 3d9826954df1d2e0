"""Coverage of the error estimates: random scenes against references four times as fine at a tenth of the accuracy.

    .venv/bin/python scripts/error_coverage.py [--scenes 400] [--from 0] [--to out/coverage] [--processes 1] [--anew]
    .venv/bin/python scripts/error_coverage.py --figures [--to out/coverage]
    .venv/bin/python scripts/error_coverage.py --job NUMBER [--to out/coverage]

Elastic and viscoelastic bodies, five kinds of surfaces, periodic and free boxes, loads from 0.1 % of contact to all of
it, histories of nine kinds, 2 to 16 cells per shortest wave; numerics.accuracy from 0.3 to 10 %. Each scene becomes a
line of scenes.csv at once: run again, it goes on with those that lack. `coverage.md` has the figures and each miss by
name, `coverage.png` estimates over true errors, and `misses/` the jobs of the misses, with their maps, to run them.
References are kept in `references/`: `--anew` makes all runs again, but only the references that lack.

Scenes below 200 served to find the constants of the estimates; the others were not looked at before these were final.
Ends with 1 if less than 95 % of the scenes are as wrong as asked for at most, or said that they are not.
"""

import csv
import json
import math
import multiprocessing
import os
import sys
import time
import warnings
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"  # one process, one core

import campaign
import numpy as np
import pandas
import runs
from coverage_scenes import FINER, Json, Sketch, sketch
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from parcontact import scene
from parcontact.accuracy.budget import NAMES, Parts, weight_of
from parcontact.errors import InputError, RunError
from parcontact.history.timeline import Timeline
from parcontact.job import Job
from parcontact.march.loop import March
from parcontact.parallel.slab import Slab
from parcontact.steady_sliding import curve
from parcontact.steady_sliding.sliding import SteadySliding

SHARPER = 10.0  # times the accuracy is asked of a reference
SAME_TIME = 1e-9
GOAL = 0.95  # of the scenes
HALF = 0.5 * (1.0 - 1e-6)  # of the true error is what an estimate has to be at least, up to rounding
ROUNDING = 1e-12  # of friction and of area: errors below it are none
SECOND_RANGE = 200  # from this number on scenes were not looked at before
QUANTITIES = {"friction": "friction", "area": "corrected area"}
PLACES = {"friction": 3, "area": 4}  # in the rows of a series
CELLS = (0.0, 3.0, 4.0, 6.0, 8.0, 16.0, math.inf)
CLASSES = ("body", "surface", "boundary", "history", "cells")
HEAD = (
    "kept or warned | warned | of the others kept | estimate >= half of the error | estimate/error: median | 5 to 95 %"
)
KEYS = ("", "_true", "_error", "_estimate", "_printed", "_resolution", *(f"_{part}" for part in NAMES))
COLUMNS = ("scene", "body", "surface", "boundary", "history", "cells", "asked", "points", "steps", "seconds")
COLUMNS += ("reference_seconds", *(f"{name}{key}" for name in QUANTITIES for key in KEYS), "failure")


# -- one scene: its run, its reference, and how far apart they are -----------------------------------------------------
#
# Errors are those of which the sentences of the budget speak: means over the distance slid, over time where nothing
# slides. A reference is read at the instants of the run. Friction of an elastic body is 0.


@dataclass
class Series:
    """Results of a run: a row of time, place among the rows of that time, weight, friction and area for each
    instant; the weight is 0 where nothing touches. And how wrong it says that it is in the mean, by part, in absolute
    terms; `printed` is the relative error in all."""

    rows: list[list[float]]
    within: dict[str, dict[str, float]]
    steps: int
    seconds: float = 0.0

    def mean(self, column: int, other: "Series | None" = None) -> float:
        """The mean of a column with the weights of this series, of its own values or another's at its instants."""
        total = sum(row[2] for row in self.rows)
        of = self if other is None else other
        return sum(row[2] * of.at(column, row[0], int(row[1])) for row in self.rows) / total if total else math.nan

    def at(self, column: int, instant: float, place: int) -> float:
        times = [row[0] for row in self.rows]
        first = bisect_left(times, instant * (1.0 - SAME_TIME))
        there = bisect_right(times, instant * (1.0 + SAME_TIME)) - first
        if there > 0:
            return self.rows[first + min(place, there - 1)][column]
        if not 0 < first < len(times):
            return self.rows[min(first, len(times) - 1)][column]
        share = (instant - times[first - 1]) / (times[first] - times[first - 1])
        return (1.0 - share) * self.rows[first - 1][column] + share * self.rows[first][column]


def run(plain: Json) -> Series:
    """March a job in this process, or solve its steady state."""
    began = time.process_time()
    with warnings.catch_warnings(action="ignore"):
        job = Job.model_validate(plain)
        found = _march(job) if job.history else _steady(job)
    found.seconds = time.process_time() - began
    return found


def _march(job: Job) -> Series:
    march = runs.begun(job)
    rows, before = list[list[float]](), march.row

    def note(now: March) -> None:
        nonlocal before
        row, timeline = now.row, now.timeline()
        far = weight_of(row.distance - before.distance, row.time - before.time)
        before = row
        friction = row.measures.friction if row.distance > 0.0 else 0.0
        weight = far if row.errors else 0.0
        rows.append([row.time, place_of(timeline, row.step), weight, friction, row.measures.contact_area_corrected])

    runs.marched(march, note)
    total = max(sum(row[2] for row in rows), 1e-300)
    means = [sum(row[2] * row[column] for row in rows) / total for column in PLACES.values()]
    return Series(rows, _within(march.state.errors, means), len(rows) - 1)


def place_of(timeline: Timeline, step: int) -> int:
    """Return how many rows before that of a step have its time; the initial state is one, at 0."""
    time, place = timeline[step].time if step else 0.0, 0
    while place < step and (timeline[step - place - 1].time if step > place + 1 else 0.0) == time:
        place += 1
    return place


def _within(errors: object, means: list[float]) -> dict[str, dict[str, float]]:
    """Absolute errors by part, and the relative one in all, as it is printed."""
    found = {}
    for name, mean in zip(PLACES, means, strict=True):
        parts: Parts | None = getattr(errors, name)
        if parts is not None:
            found[name] = {part: getattr(parts, part) * mean for part in NAMES} | {"printed": parts.total}
    return found


def _steady(job: Job) -> Series:
    wanted = curve.request(job)
    sliding = SteadySliding(scene.set_up(job, Slab.alone(*job.grid.points)))
    speed, pressure, _ = wanted.points[0]
    point = sliding.solve(wanted.velocity(speed), pressure)
    means = [point.friction, point.measures.contact_area_corrected]
    return Series([[0.0, 0.0, 1.0, *means]], _within(point.errors, means), 1)


def compare(number: int, references: Path) -> Json:
    """A line of the table: what the scene is, what its run says, and what is true."""
    made = sketch(number)
    line: Json = {"scene": number, **made.kind, "points": "x".join(map(str, made.plain["grid"]["points"]))}
    try:
        with TemporaryDirectory() as directory:
            own = run(made.job(Path(directory)))
            other = reference(made, Path(directory), references / f"{number}.json")
    except (RunError, InputError, ValueError) as error:
        return {**line, "failure": " ".join(str(error).split())[:300]}
    line |= {"steps": own.steps, "seconds": round(own.seconds, 3), "reference_seconds": round(other.seconds, 3)}
    for name, column in PLACES.items():
        if parts := own.within.get(name):
            mean, true = own.mean(column), own.mean(column, other)
            resolution = sum(other.within.get(name, {}).get(part, 0.0) for part in NAMES)
            if name == "friction" and made.kind["body"] == "elastic":
                true = resolution = 0.0
            estimate = sum(parts[part] for part in NAMES)
            found = {"true": true, "error": abs(mean - true), "estimate": estimate, "resolution": resolution, **parts}
            line |= {name: mean, **{f"{name}_{key}": value for key, value in found.items()}}
    return line


def reference(made: Sketch, directory: Path, kept: Path) -> Series:
    """The series on the finer grid, made now or kept before."""
    if kept.exists():
        return Series(**json.loads(kept.read_text()))
    found = run(made.job(directory, FINER, SHARPER))
    kept.parent.mkdir(parents=True, exist_ok=True)
    new = kept.with_suffix(".new")
    new.write_text(json.dumps(asdict(found)))
    new.replace(kept)
    return found


# -- tables and a picture ----------------------------------------------------------------------------------------------


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
        own = {f"{name}_{key}": key for key in ("true", "error", "estimate", "printed", "resolution", *NAMES)}
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


def text_of(found: pandas.DataFrame, failed: pandas.DataFrame) -> str:
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
    yield f"| scene | what | of | asked | true error | estimate | {', '.join(NAMES)} | class |\n|{8 * '---|'}"
    for line in missed.itertuples():
        what = " and ".join([*["not kept"] * (not line.kept), *["too small"] * (not line.covered)])
        absolute = not line.true > 0.0

        def told(number: float, line=line, absolute: bool = absolute) -> str:
            return f"{number:.2g}" if absolute else f"{100 * number / line.true:.2g} %"

        parts = ", ".join(told(getattr(line, part)) for part in NAMES)
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
    ends = np.array([1e-6, 10.0])
    for times, style, label in ((1.0, "-", "1x"), (2.0, "--", "2x, 1/2x"), (0.5, "--", None)):
        axes.plot(ends, times * ends, style, color="0.4", linewidth=0.8, label=label)
    axes.set(xscale="log", yscale="log", xlim=ends, ylim=ends)
    axes.legend(fontsize=7, loc="upper left", ncols=2)


# -- all scenes --------------------------------------------------------------------------------------------------------


def make(numbers: Iterable[int], to: Path, processes: int, anew: bool) -> None:
    """Add the lines that lack to the table, as they are ready."""
    table = to / "scenes.csv"
    if anew:
        table.unlink(missing_ok=True)
    to.mkdir(parents=True, exist_ok=True)
    if not table.exists():
        table.write_text(",".join(COLUMNS) + "\n")
    lacking = sorted(set(numbers) - set(pandas.read_csv(table).scene))
    with table.open("a", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        for count, line in enumerate(_made(lacking, to / "references", processes), start=1):
            writer.writerow({key: line.get(key, "") for key in COLUMNS})
            file.flush()
            if count % 20 == 0 or count == len(lacking):
                print(f"{count} of {len(lacking)} scenes", flush=True)


def _made(lacking: list[int], references: Path, processes: int) -> Iterator[Json]:
    if processes == 1:
        yield from (compare(number, references) for number in lacking)
        return
    with ProcessPoolExecutor(processes, multiprocessing.get_context("spawn")) as pool:
        for done in as_completed([pool.submit(compare, number, references) for number in lacking]):
            yield done.result()


def write_job(number: int, to: Path) -> Path:
    """Write a job file, which `parcontact` runs, and its map if it has one."""
    to.mkdir(parents=True, exist_ok=True)
    path = to / f"scene_{number}.yaml"
    path.write_text(json.dumps(sketch(number).job(to.resolve()), indent=1) + "\n")
    return path


def conclude(to: Path) -> bool:
    """Write figures, picture, and jobs of the misses; whether as many as promised are covered."""
    lines, found = pandas.read_csv(to / "scenes.csv"), judged(to / "scenes.csv")
    text = text_of(found, lines[lines.failure.notna()])
    (to / "coverage.md").write_text(text)
    print(text)
    picture(found, to / "coverage.png")
    for number in sorted(set(misses(found).scene)):
        write_job(number, to / "misses")
    minutes = (lines.seconds.sum() + lines.reference_seconds.sum()) / 60.0
    print(f"{len(lines)} scenes, {minutes:.1f} CPU minutes; written: {to / 'coverage.md'}, {to / 'coverage.png'}")
    return keeps_its_promise(found)


def main() -> int:
    options = campaign.parser(
        __doc__,
        trials=400,
        what="scenes",
        to=("out/coverage", "the directory of the tables"),
        processes=(1, "at a time"),
        anew=(False, "make all runs again; references are kept"),
        figures=(False, "only the figures of the scenes that are there"),
        job=(-1, "only write the job of this scene"),
    )
    asked = options.parse_args()
    to = Path(asked.to)
    if asked.job >= 0:
        print(write_job(asked.job, to))
        return 0
    if not asked.figures:
        make(campaign.numbers(asked), to, asked.processes, asked.anew)
    return 0 if conclude(to) else 1


if __name__ == "__main__":
    sys.exit(main())

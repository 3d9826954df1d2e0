"""Coverage of the error estimates: random scenes against references four times as fine at a tenth of the accuracy.

    .venv/bin/python scripts/error_coverage.py [--scenes 400] [--from 0] [--to out/coverage] [--limit 25]
    .venv/bin/python scripts/error_coverage.py --figures [--to out/coverage]
    .venv/bin/python scripts/error_coverage.py --job NUMBER [--to out/coverage]

Scenes have elastic and viscoelastic bodies, layers, hardness, heat and adhesion. They have five kinds of surfaces in
periodic and free boxes, contact areas from 0.1 % to all of the box, nine kinds of histories, 2 to 16 cells per shortest
wave, and a numerics.accuracy from 0.5 to 10 %. A scene that takes longer than `--limit` seconds of CPU, its reference
included, is left out.

Each scene becomes a file with all observations of its steps. Constants can be fitted and assessed from these files
without another run: `--figures` estimates all errors anew. `coverage.md` has the tables and each miss by name,
`coverage.png` estimates over true errors. Constants were fitted to scenes below 760; later scenes are for validation.
It judges AREA, STILL, IDENTICAL, VIEWS, STEADY_AREA, LOST, FREE_LOST, ENERGY and PULL_OFF of `march.budget`.
The exit code is 1 if less than 95 % of the later scenes are within the requested accuracy, or report that they are not.
"""

import json
import math
import os
import signal
import sys
import time
import warnings
from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, fields
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"  # one process, one core

import campaign
import numpy as np
import pandas
import runs
from coverage_scenes import FINER, Json, Sketch, sketch
from matplotlib.figure import Figure

from parcontact.effects.adhesion import effect, results
from parcontact.errors import InputError, RunError
from parcontact.job import Job
from parcontact.job.history import Timeline
from parcontact.march import curve, scene, state, steady
from parcontact.march.budget import UNKNOWN, ErrorBudget, estimate, estimate_steady, weight_of
from parcontact.march.loop import March
from parcontact.march.steady import SteadySliding
from parcontact.march.time_error import RunProperties, StepObservation
from parcontact.parallel.slab import Slab
from parcontact.physics.prony import Prony

SHARPER = 10.0  # accuracy of a scene over the accuracy of its reference
SAME_TIME = 1e-9
GOAL = 0.95  # least share of the later scenes
FITTED = 760  # constants were fitted to scenes below this number
ROUNDING = 1e-10  # relative errors below it count as 0
QUANTITIES = ("friction", "area", "energy", "flash temperature", "pull-off")
CLASSES = ("history", "surface", "body", "boundary", "effect")
HEAD = "kept or warned | warned | within | estimate/error: median | 5 to 95 %"
SEEN: list[tuple[RunProperties, StepObservation]] = []  # observations of the present run


class TooLongError(Exception):
    """A scene takes more CPU time than the limit."""


# -- observations of one scene and its reference -----------------------------------------------------------------------


def record_observations() -> None:
    """Make the estimates of steps and of steady states record their observations in SEEN."""

    def noting(own: Any) -> Any:
        def judge(run: RunProperties, observed: StepObservation) -> ErrorBudget:
            SEEN.append((run, observed))
            found: ErrorBudget = own(run, observed)
            return found

        return judge

    state.estimate, steady.estimate_steady = noting(estimate), noting(estimate_steady)


def run(plain: Json) -> Json:
    """March a job in this process, or solve its steady states; return the rows with their observations."""
    SEEN.clear()
    with warnings.catch_warnings(action="ignore"):
        job = Job.model_validate(plain)
        return _march(job) if job.history else _steady(job)


def _march(job: Job) -> Json:
    march, rows = runs.begun(job), list[Json]()
    before, properties = march.row, dict[str, Any]()
    names = [name for effect in march.scene.effects.values() for name in _names(effect)]

    def note(now: March) -> None:
        nonlocal before
        row, measures = now.row, now.row.measures
        far = weight_of(row.distance - before.distance, row.time - before.time)
        before, added = row, dict(zip(names, row.added, strict=False))
        rows.append(
            {
                "time": row.time,
                "place": place_of(now.timeline(), row.step),
                "weight": far if row.errors else 0.0,
                "friction": measures.friction if row.distance > 0.0 else 0.0,
                "area": measures.contact_area_corrected,
                "counted": measures.contact_area,
                "pressure": measures.pressure,
                "approach": measures.approach,
                "max_pressure": measures.max_pressure,
                "dissipated": row.dissipated,
                **added,
                "stated": _stated(row.errors),
                "seen": asdict(SEEN[0][1]) if SEEN and row.errors else None,
            }
        )
        if SEEN:
            properties.update(_plain(SEEN[0][0]))
        SEEN.clear()

    runs.marched(march, note)
    box = job.grid.lx * job.grid.ly
    found = {"rows": rows, "run": properties, "box": box, "tolerance": job.numerics.tolerance}
    if job.section("adhesion") is None:
        return found
    law = effect.law_of(job)
    return {**found, "coarseness": law.cell / law.zone}


def _steady(job: Job) -> Json:
    wanted = curve.request(job)
    sliding = SteadySliding(scene.set_up(job, Slab.alone(*job.grid.points)))
    speed, pressure, _ = wanted.points[0]
    point = sliding.solve(wanted.velocity(speed), pressure)
    row = {"time": 0.0, "place": 0, "weight": 1.0, "friction": point.friction}
    row |= {"area": point.measures.contact_area_corrected, "counted": point.measures.contact_area}
    if "thermal" in point.effects:
        row |= {"flash_temperature": point.effects["thermal"].mean, "error_flash": point.error_friction}
    (properties, observed), *_ = SEEN
    row |= {"stated": _stated(point.errors), "seen": asdict(observed)}
    return {"rows": [row], "run": _plain(properties)}


def _names(effect: Any) -> list[str]:
    return [str(getattr(column, "name", column)) for column in getattr(effect, "columns", ())]


def _stated(errors: ErrorBudget | None) -> list[float] | None:
    """Return the stated errors of friction and area of a row, 0 without friction."""
    return errors and [errors.friction.of_friction if errors.friction else 0.0, errors.area.total]


def _plain(properties: RunProperties) -> Json:
    found = {each.name: getattr(properties, each.name) for each in fields(properties)}
    prony = properties.prony
    return found | {"prony": prony and [prony.modulus_inf, prony.moduli.tolist(), prony.relaxation_times.tolist()]}


def place_of(timeline: Timeline, step: int) -> int:
    """Return the number of earlier rows at the time of a step; the initial state is a row at time 0."""
    time, place = timeline[step].time if step else 0.0, 0
    while place < step and (timeline[step - place - 1].time if step > place + 1 else 0.0) == time:
        place += 1
    return place


def made(number: int, to: Path, limit: float) -> Iterator[str]:
    """Write the observations of a scene and its reference; yield the reason of a failure."""
    path, drawn = to / "scenes" / f"{number}.json", sketch(number)
    if path.exists():
        return
    line: Json = {"scene": number, **drawn.kind}

    def stop(*_: object) -> None:
        raise TooLongError(f"takes longer than {limit:g} s")

    signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, limit)
    began = time.process_time()
    try:
        with TemporaryDirectory() as directory:
            line["own"] = run(drawn.job(Path(directory)))
            line["reference"] = run(drawn.job(Path(directory), FINER, SHARPER))
            for row in line["reference"]["rows"]:
                del row["seen"]
    except (RunError, InputError, ValueError, TooLongError) as error:
        line["failure"] = " ".join(str(error).split())[:300]
        yield line["failure"]
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    line["seconds"] = time.process_time() - began
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(line, default=float))


# -- true and estimated errors -----------------------------------------------------------------------------------------
#
# Errors refer to means over the distance slid, or over time if nothing slides, as printed at the end of a run.
# A reference is read at the instants of the run. Friction of an elastic body is 0.


def at(rows: list[Json], name: str, row: Json) -> float:
    """Return the value of a reference at the instant of a row."""
    times, instant = [each["time"] for each in rows], row["time"]
    first = bisect_left(times, instant * (1.0 - SAME_TIME))
    there = bisect_right(times, instant * (1.0 + SAME_TIME)) - first
    if there > 0:
        return float(rows[first + min(row["place"], there - 1)][name])
    if not 0 < first < len(times):
        return float(rows[min(first, len(times) - 1)][name])
    share = (instant - times[first - 1]) / (times[first] - times[first - 1])
    return float((1.0 - share) * rows[first - 1][name] + share * rows[first][name])


def judged(to: Path) -> pandas.DataFrame:
    """Return a row for each scene and quantity: its value, the true error and the estimate, both relative to the value.

    `reported`: the run reports that the requested accuracy is not met. `kept`: the error is within the accuracy, or
    reported. `within`: the error is within the estimate, or the error of friction is stated as "1 or more".
    """
    lines = []
    for path in sorted((to / "scenes").glob("*.json"), key=lambda path: int(path.stem)):
        line = json.loads(path.read_text())
        if "reference" in line and line["own"]["run"]:
            own, reference = line.pop("own"), line.pop("reference")
            lines += [{**line, **found} for found in (*_means(line, own, reference), *_others(own, reference))]
    found = pandas.DataFrame(lines)
    found["reported"] = found.estimate > found.asked
    found["kept"] = found.reported | (found.error <= np.maximum(found.asked, ROUNDING))
    found["within"] = found.error <= np.maximum(found.estimate, ROUNDING)
    found["within"] |= (found.quantity == "friction") & (found.estimate >= 1.0)
    return found


def _means(line: Json, own: Json, reference: Json) -> Iterator[Json]:
    """Yield friction and area, with errors estimated anew from the observations of the steps."""
    data = {**own["run"], "cell": tuple(own["run"]["cell"]), "points": own["run"].get("points", own.get("points"))}
    if data["prony"]:
        modulus, moduli, times = data["prony"]
        data["prony"] = Prony(modulus, np.array(moduli), np.array(times))
    properties, judge = RunProperties(**data), estimate_steady if line["history"] == "steady" else estimate
    sums = {name: np.zeros(4) for name in QUANTITIES[:2]}
    for row in own["rows"]:
        if not row["weight"] or not row.get("seen"):
            continue
        budget = judge(properties, StepObservation(**row["seen"]))
        if not budget.resolved:
            continue
        for name, parts in (("friction", budget.friction), ("area", budget.area)):
            if parts is not None and row[name]:
                no_friction = name == "friction" and line["body"] == "elastic" and not row["seen"]["interface"]
                true = 0.0 if no_friction else at(reference["rows"], name, row)
                sums[name] += row["weight"] * np.array([1.0, row[name], row[name] - true, row[name] * parts.total])
    for name, (weight, value, error, stated) in sums.items():
        if weight:
            estimated = stated / value
            if name == "friction" and estimated > UNKNOWN:
                estimated = max(estimated, 1.0)
            yield {"quantity": name, "value": value / weight, "error": abs(error) / value, "estimate": estimated}


def _others(own: Json, reference: Json) -> Iterator[Json]:
    """Yield dissipated energy, flash temperature and pull-off, if they are known and an error is stated."""
    (*_, last), (*_, true) = own["rows"], reference["rows"]
    pairs = {
        "energy": ("dissipated", last.get("error_energy", math.nan) / (last.get("dissipated") or math.nan)),
        "flash temperature": ("flash_temperature", last.get("error_flash", math.nan)),
    }
    for quantity, (name, estimated) in pairs.items():
        if math.isfinite(estimated) and last[name]:
            error = abs(true[name] / last[name] - 1.0)
            yield {"quantity": quantity, "value": last[name], "error": error, "estimate": estimated}
    if "tensile_area" in last:
        found = [_pull_off(each) for each in (own, reference)]
        if all(found) and found[0] and found[1] and math.isfinite(found[0][1]):
            (load, within), (exact, _) = found
            yield {"quantity": "pull-off", "value": load, "error": abs(exact / load - 1.0), "estimate": within / load}


def _pull_off(series: Json) -> tuple[float, float] | None:
    """Return the last pull-off of a run and its error [N]; None without one."""
    names = ("time", "pressure", "approach", "max_pressure")
    columns = {name: [row[name] for row in series["rows"]] for name in names}
    columns["contact_area"] = [row["counted"] for row in series["rows"]]
    columns["error_area"] = [row["stated"][1] if row["stated"] else math.nan for row in series["rows"]]
    pulls = results.find(columns, coarseness=series["coarseness"])
    if not pulls:
        return None
    pull = pulls[-1]
    return -pull.pressure * series["box"], pull.error(series["tolerance"]) * series["box"]


# -- tables and a picture ----------------------------------------------------------------------------------------------


def tables(found: pandas.DataFrame) -> Iterator[str]:
    """Yield all tables in Markdown."""
    yield f"| scenes | of | {HEAD} |\n|{7 * '---|'}"
    for title, some in (("fitted", found[found.scene < FITTED]), ("later", found[found.scene >= FITTED])):
        for name in QUANTITIES:
            if len(own := some[some.quantity == name]):
                yield f"| {title}: {len(own)} | {name} | {_row(own)} |"
    heads = " | ".join(f"{name}: scenes | within | estimate/error" for name in QUANTITIES[:2])
    yield f"\n| class | {heads} |\n|{7 * '---|'}"
    for key in CLASSES:
        for group, some in found.groupby(key):
            cells = " | ".join(_short_row(some[some.quantity == name]) for name in QUANTITIES[:2])
            yield f"| {key}: {group} | {cells} |"
    yield "\n### Misses\n\n| scene | of | asked | true error | estimate | class |\n|---|---|---|---|---|---|"
    for each in found[~(found.kept & found.within)].itertuples():
        about = ", ".join(str(getattr(each, key)) for key in CLASSES)
        numbers = f"{100 * each.asked:.2g} % | {100 * each.error:.2g} % | {100 * each.estimate:.2g} %"
        yield f"| {each.scene} | {each.quantity} | {numbers} | {about}, {each.cells:g} cells |"


def _short_row(some: pandas.DataFrame) -> str:
    """Return the number of scenes, the share with an error within the estimate, and the median of estimate over
    error."""
    if not len(some):
        return " | | "
    ratio = (some.estimate / some.error)[some.error > ROUNDING].median()
    return f"{len(some)} | {100 * some.within.mean():.1f} % | {ratio:.2g}"


def _row(some: pandas.DataFrame) -> str:
    ratios = (some.estimate / some.error)[some.error > ROUNDING]
    low, middle, high = np.percentile(ratios, [5, 50, 95]) if len(ratios) else [math.nan] * 3
    shares = " | ".join(f"{100 * some[name].mean():.1f} %" for name in ("kept", "reported", "within"))
    return f"{shares} | {middle:.2g} | {low:.2g} to {high:.2g}"


def picture(found: pandas.DataFrame, path: Path) -> None:
    """Draw estimates over true errors, by history, in a panel for friction and one for the area."""
    figure, ends = Figure(figsize=(11, 5.2), layout="constrained"), np.array([1e-6, 10.0])
    for axes, name in zip(figure.subplots(1, 2), QUANTITIES[:2], strict=True):
        own = found[(found.quantity == name) & (found.error > ROUNDING)]
        for index, (group, some) in enumerate(own.groupby("history")):
            look = {"marker": "os^vDP*Xd"[index % 9], "color": f"C{index}", "label": group, "alpha": 0.8}
            axes.scatter(some.error, some.estimate, s=16, linewidth=0, **look)
        axes.plot(ends, ends, "-", color="0.4", linewidth=0.8)
        axes.set(xscale="log", yscale="log", xlim=ends, ylim=ends)
        axes.set(xlabel=f"true error of {'friction' if name == 'friction' else 'the area'} [-]", ylabel="estimate [-]")
        axes.legend(fontsize=7, loc="upper left", ncols=2)
    figure.savefig(path, dpi=110)


def conclude(to: Path) -> bool:
    """Write tables and picture; return True if the promised share of later scenes is covered."""
    found = judged(to)
    text = "\n".join(["# Coverage of the error estimates\n", *tables(found), ""])
    (to / "coverage.md").write_text(text)
    picture(found, to / "coverage.png")
    print(text)
    print(f"{found.scene.nunique()} scenes; written: {to / 'coverage.md'}, {to / 'coverage.png'}")
    unseen = found[(found.scene >= FITTED) & found.quantity.isin(QUANTITIES[:2])]
    return bool(unseen.groupby("scene").kept.all().mean() >= GOAL) if len(unseen) else True


def write_job(drawn: Sketch, to: Path) -> Path:
    """Write a job file, which `parcontact` runs, and its map if it has one."""
    to.mkdir(parents=True, exist_ok=True)
    path = to / f"scene_{drawn.number}.yaml"
    path.write_text(json.dumps(drawn.job(to.resolve()), indent=1) + "\n")
    return path


def main() -> int:
    options = campaign.parser(
        __doc__,
        trials=400,
        what="scenes",
        to=("out/coverage", "directory of the tables"),
        limit=(25.0, "limit on the CPU time of a scene [s]"),
        figures=(False, "only make the figures of existing scenes"),
        job=(-1, "only write the job of this scene"),
    )
    asked = options.parse_args()
    to = Path(asked.to)
    if asked.job >= 0:
        print(write_job(sketch(asked.job), to))
        return 0
    if not asked.figures:
        record_observations()
        campaign.go(asked, lambda number: made(number, to, asked.limit), Counter())
    return 0 if conclude(to) else 1


if __name__ == "__main__":
    sys.exit(main())

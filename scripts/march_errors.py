#!/usr/bin/env python3
"""Errors of friction and area by the time steps of random marches, against steps of an eighth of a cell on one mesh.

    .venv/bin/python scripts/march_errors.py [--marches 66] [--seed 0] [--from 0] [--only NUMBER]

Marches are slides from rest, oblique slides, steps of velocity and reversals, on rough surfaces of 6 to 16 cells per
shortest wave; every fifth one slides in full contact, and every fifth one rests under a load. The first table has the
relative error of mu_dyn with steps of given lengths, its bias, and operator calls. The second compares the part `time`
of the error budget with the true error by these steps: its median over the error, and the share of marches in which it
is at least the error, for friction (if the error by the mesh is below AGREE) and for the area. The third is for chosen
steps: operator calls, errors, and how often the errors of mu_dyn and mu_max are within the estimates of the run.

The constants of `march.time_error` that name this script are judged by the second table: PASSING and LINEAR_PASSING by
slides, MANY_WAVES by full contact, LINEAR_PAIR, EQUAL_DIFFERENCE and PAIR_SHARE by rests and by slides with two
velocities, EULER, EULER_AREA and TIME_AREA by all. Results are on the manual's pages `method` and `accuracy`.
"""

import math
import sys
import warnings
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from itertools import product
from random import Random
from typing import Any

import campaign
import numpy as np
from numpy.typing import NDArray
from runs import begun, marched

from parcontact.files.recorder import StepRow
from parcontact.results import slide

Json = dict[str, Any]
POINTS, SIZE, WAY = 64, 1e-3, 24  # points along each side, its length [m], cells slid
CELL = SIZE / POINTS
EXACT = {"tolerance": 1e-6, "branch_error": 0.0}
INTEGRATORS = "exponential-linear", "exponential", "backward-euler"
GIVEN = [(name, cells) for name in INTEGRATORS for cells in (2.0, 1.0, 0.5)]
KINDS = "slide", "full", "rest"
LASTS = 16  # steps of a rest that count as steps of one cell
ACCURACIES = 0.1, 0.03, 0.01
ROUNDING = 1e-7  # least true error that counts
AGREE = 0.01  # largest error of friction by the mesh for which time steps dominate the error


def kind_of(number: int) -> str:
    """Return whether a march slides, slides in full contact, or rests."""
    return {3: "full", 4: "rest"}.get(number % 5, "slide")


def march_of(seed: int, number: int, kind: str = "slide") -> Json:
    """Return a random job without its numerics."""
    dice = Random(f"march {seed} {number}")
    short, speed, slope = (
        dice.choice([6, 8, 8, 12, 16]) * CELL,
        10.0 ** dice.uniform(-3, 0),
        10.0 ** dice.uniform(-2, -1),
    )
    count = dice.choice([1, 1, 2, 4, 8])
    branches = [
        {
            "modulus": 10.0 ** dice.uniform(5.7, 7.0) / count,
            "relaxation_time": short / speed * 10.0 ** dice.uniform(-1.5, 1.5),
        }
        for _ in range(count)
    ]
    modulus = math.sqrt(1e6 * (1e6 + sum(branch["modulus"] for branch in branches)))
    stage = {
        "pressure": 2.6 * slope * modulus * 10.0 ** dice.uniform(-1.3, 0.0),
        "velocity": speed,
        "distance": WAY * CELL,
    }
    before = {**stage, "distance": WAY / 3 * CELL}
    history = dice.choice(
        [
            [stage],
            [stage],
            [{**stage, "velocity": [0.8 * speed, 0.6 * speed]}],
            [before, {**stage, "velocity": speed * 10.0 ** dice.uniform(-1.5, 1.5)}],
            [before, {**stage, "velocity": -speed}],
        ]
    )
    if kind == "full":
        full = 8.0 * slope * (1e6 + sum(branch["modulus"] for branch in branches))
        history = [{**stage, "pressure": full}]
    elif kind == "rest":
        history = [{"pressure": stage["pressure"], "duration": short / speed}]
    long, hurst, surface = max(SIZE / 3, 2 * short), dice.uniform(0.6, 0.95), dice.randrange(10**6)
    rough = {"hurst": hurst, "long_wavelength": long, "short_wavelength": short, "rms_slope": slope, "seed": surface}
    return {
        "grid": {"points": POINTS, "size": SIZE},
        "surface": {"shape": "rough", **rough},
        "material": {"model": "zener", "modulus_inf": 1e6, "branches": branches},
        "history": history,
    }


def steps_of(stage: Json, cells: float) -> Json:
    """Return the key that gives a stage steps of so many cells, or of this share of a LASTS-th of a rest."""
    if "velocity" in stage:
        return {"cells_per_step": cells}
    return {"time_step": cells * stage["duration"] / LASTS}


def run(job: Json, cells: float | None = None, **numerics: Any) -> tuple[dict[str, NDArray[Any]], list[StepRow], Any]:
    """Return the columns of a run, its rows, and its stages."""
    history = [stage if cells is None else {**stage, **steps_of(stage, cells)} for stage in job["history"]]
    march = begun({**job, "history": history, "numerics": numerics})
    rows, _ = marched(march)
    parts = [row.errors.friction if row.errors else None for row in rows]
    columns = {
        "time": [row.time for row in rows],
        "distance": [row.distance for row in rows],
        "friction": [row.measures.friction for row in rows],
        "contact_area": [row.measures.contact_area for row in rows],
        "area": [row.measures.contact_area_corrected for row in rows],
        "time_of_area": [row.errors.area.time if row.errors else math.nan for row in rows],
        "error_friction": [math.nan if each is None else each.total for each in parts],
        "time_error": [math.nan if each is None else each.time for each in parts],
        "mesh_error": [math.nan if each is None else each.mesh for each in parts],
    }
    return {name: np.array(values) for name, values in columns.items()}, rows, march.scene.choices.timeline.history


def late(columns: dict[str, NDArray[Any]], name: str) -> float:
    """Return the mean of a column over its second half."""
    return float(np.nanmean(columns[name][-max(2, len(columns[name]) // 2) :]))


def trial(seed: int, found: dict[Any, list[tuple[float, ...]]], number: int) -> Iterator[str]:
    """March a job with all settings; append the errors to `found`."""
    kind = kind_of(number)
    job = march_of(seed, number, kind)
    columns, _, stages = run(job, 0.125, **EXACT)
    names = {"slide": ("friction", "area"), "full": ("friction",), "rest": ("area",)}[kind]
    exact, true = slide.measure_slide(stages, columns), {name: late(columns, name) for name in names}
    for name, cells in GIVEN:
        columns, rows, stages = run(job, cells, integrator=name, tolerance=1e-5, branch_error=0.0)
        for what, part in (("friction", "time_error"), ("area", "time_of_area")):
            if what in names and (what == "area" or late(columns, "mesh_error") < AGREE):
                off = abs(late(columns, what) / true[what] - 1.0)
                found[kind, what, name, cells].append((late(columns, part) / max(off, ROUNDING), off))
        mine, calls = slide.measure_slide(stages, columns), sum(row.operator_calls for row in rows)
        if kind == "slide" and mine and exact:
            found[name, cells].append((mine.mu_dyn / exact.mu_dyn - 1.0, calls))
    for name, accuracy in product(INTEGRATORS[:2], ACCURACIES if kind == "slide" else ()):
        columns, rows, stages = run(job, integrator=name, accuracy=accuracy)
        mine, stated = slide.measure_slide(stages, columns), slide.absolute_errors(stages, columns, CELL)
        assert mine is not None
        assert exact is not None
        off, highest = mine.mu_dyn - exact.mu_dyn, mine.mu_max - exact.mu_max
        within = (abs(off) <= stated["mu_dyn"], abs(highest) <= stated["mu_max"])
        row = (off / exact.mu_dyn, sum(row.operator_calls for row in rows), stated["mu_dyn"] / abs(off))
        found[name, accuracy, "chosen"].append((*row, *map(float, within), highest / exact.mu_max))
    yield from ()


def tell(found: dict[Any, list[tuple[float, ...]]]) -> None:
    """Print the three tables, errors in per cent."""
    print("steps given: cells per step, median, bias and largest error, calls")
    for name, cells in GIVEN:
        if (name, cells) in found:
            errors, calls = _columns(found[name, cells])
            print(f"{name:18} {cells:4g} {_errors(errors)} {calls.sum():8.0f}")
    print("time part over error: median, share of 1 or more, number of marches, median error in per cent")
    for kind, what, (name, cells) in product(KINDS, ("friction", "area"), GIVEN):
        if pairs := found.get((kind, what, name, cells)):
            ratios, off = _columns(pairs)
            numbers = f"{np.median(ratios):6.2f} {np.mean(ratios >= 1.0):5.2f} of {len(ratios)}"
            print(f"{kind:6} {what:9} {name:18} {cells:4g} {numbers} {100.0 * np.median(off):8.3f}")
    print("steps chosen: accuracy, errors of mu_dyn, calls, stated over true, within: mu_dyn, mu_max; error of mu_max")
    for name, accuracy in product(INTEGRATORS[:2], ACCURACIES):
        if rows := found.get((name, accuracy, "chosen")):
            errors, calls, ratios, dynamic, highest, off = _columns(rows)
            numbers = f"{np.median(ratios):5.1f} {dynamic.mean():5.2f} {highest.mean():5.2f}"
            print(f"{name:18} {accuracy:4g} {_errors(errors)} {calls.sum():8.0f} {numbers} {_errors(off)}")


def _columns(lines: Sequence[tuple[float, ...]]) -> NDArray[np.float64]:
    return np.array(lines).T


def _errors(errors: NDArray[np.float64]) -> str:
    size = 100.0 * np.abs(errors)
    return f"{np.median(size):6.2f} {100.0 * errors.mean():6.2f} {size.max():6.1f}"


def main() -> int:
    asked = campaign.parser(__doc__, trials=66, what="marches").parse_args()
    warnings.simplefilter("ignore")
    found: dict[Any, list[tuple[float, ...]]] = defaultdict(list)
    faulty = campaign.go(asked, lambda number: trial(asked.seed, found, number), Counter())
    tell(found)
    return 1 if faulty else 0


if __name__ == "__main__":
    sys.exit(main())

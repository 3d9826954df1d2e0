"""Whether steps that choose themselves keep what numerics.accuracy asks for, and what that costs.

    .venv/bin/python scripts/time_steps.py [points] [scene ...]

Each scene is marched with `time_step: auto` at an accuracy of 5, 1 and 0.3 %, and with a ladder of steps made by hand:
a cell of sliding per step, or a factor of 1.2 at rest, and finer and coarser ones. The reference has the finest steps,
a half of the finest of the ladder, and a hundredth of the tolerance. The mesh is the same throughout. Printed are the
errors of the highest friction, of its mean over the last three quarters of the slide (dynamic), and of the mean contact
area there, each over the accuracy asked for; and the operator calls, over those of the cheapest rung of the ladder that
keeps all three within the accuracy.
"""

import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mpi4py import MPI

from parcontact import job as jobs
from parcontact.job.sections.listing import plain
from parcontact.march import loop
from parcontact.parallel.slab import Slab
from parcontact.steady_sliding import start
from parcontact.storage.row import Row
from parcontact.summary.slide import mean_over_end

Json = dict[str, Any]
ACCURACIES = (0.05, 0.01, 0.003)
LADDER = (4.0, 2.0, 1.0, 0.5, 0.25, 0.125, 0.0625)  # cells per step
PRONY = [{"modulus": 2e6 * 3.0**-k, "relaxation_time": 1e-6 * 10.0**k} for k in range(5)]
RUBBER = {"model": "zener", "modulus_inf": 1e5, "branches": PRONY}
SOLID = {"model": "zener", "modulus_inf": 0.275e6, "branches": [{"modulus": 2.475e6, "relaxation_time": 1e-3}]}
TYRE = plain(jobs.load(Path(__file__).parents[1] / "jobs" / "velocity_step.yaml"))["material"]
REST = {"first": 1e-3, "growth": 1.2}  # of the duration


class Found(NamedTuple):
    """Of one run: highest and dynamic friction, mean corrected area of the last slide; operator calls and steps."""

    highest: float
    dynamic: float
    area: float
    calls: int
    steps: int


def rough(points: int, pressure: float, material: Json, *stages: Json, start_at: float | None = None) -> Json:
    surface = {
        "shape": "rough",
        "hurst": 0.9,
        "long_wavelength": 2.5e-4,
        "short_wavelength": 16e-3 / points,  # 16 cells
        "rms_slope": 0.02,
    }
    history = [{"pressure": pressure, **stage} for stage in stages]
    job: Json = {"grid": {"points": points, "size": 1e-3}, "surface": surface, "material": material, "history": history}
    if start_at is not None:
        job["initial"] = {"state": "steady", "velocity": start_at, "pressure": pressure}
    return job


def slide(velocity: float, cells: float, cell: float) -> Json:
    return {"velocity": velocity, "distance": cells * cell}


def scenes(points: int) -> dict[str, Json]:
    cell, rest = 1e-3 / points, {"duration": 1e-2}
    ball = {"shape": "sphere", "radius": 1e-2, "center": [2e-3, 3e-3]}
    line = {"shape": "cylinder", "radius": 1e-2, "center": [1.5e-3, 0.0]}
    fine = {"points": [4 * points, 1], "size": [4e-3, 1e-3]}
    steady = {"state": "steady", "velocity": 0.1, "pressure": 2e4}
    on = slide(1.0, 48.0, cell)
    return {
        "sphere": {
            "grid": {"points": points, "size": 6e-3, "boundary": "free"},
            "surface": ball,
            "material": SOLID,
            "history": [{"force": 0.15, **rest}, {"force": 0.15, **slide(0.046765, 24.0, 6e-3 / points)}],
        },
        "cylinder": {
            "grid": fine,
            "surface": line,
            "material": SOLID,
            "initial": steady,
            "history": [{"pressure": 2e4, **slide(0.2, 96.0, 1e-3 / points)}],
        },
        "rough, 0.4 %": rough(points, 1e2, RUBBER, on, start_at=1.0),
        "rough, 8 %": rough(points, 2e3, RUBBER, on, start_at=1.0),
        "rough, 60 %": rough(points, 2e4, RUBBER, on, start_at=1.0),
        "rough, 99 %": rough(points, 1e5, RUBBER, on, start_at=1.0),
        "velocity step": rough(points, 1e5, TYRE, slide(3.0, 64.0, cell), start_at=0.01),
        "dwell, then slide": rough(points, 1e4, RUBBER, rest, slide(0.1, 32.0, cell)),
        "one branch": rough(points, 2e4, SOLID, slide(0.1, 48.0, cell), start_at=0.1),
    }


def by_hand(stage: Json, cells: float) -> Json:
    """A stage with steps of so many cells: after a jump they begin with a thousandth of one."""
    if "velocity" not in stage:
        first, growth = stage["duration"] * REST["first"] * cells, REST["growth"] ** cells
        return {**stage, "time_step": {"first": first, "growth": growth}}
    return {**stage, "cells_per_step": cells}


def climb(history: list[Json], cells: float, cell: float, jumps: bool) -> list[Json]:
    """The stages of a history by hand; the first sliding one has short steps at its beginning if the velocity jumps."""
    made = list[Json]()
    for stage in history:
        if "velocity" not in stage or not jumps:
            made.append(by_hand(stage, cells))
            continue
        grown = 8.0 * cell
        first = {"first": 1e-3 * cells * cell / stage["velocity"], "growth": 1.2**cells}
        made.append({**stage, "distance": grown, "time_step": first})
        made.append(by_hand({**stage, "distance": stage["distance"] - grown}, cells))
    return made


def march(data: Json, history: list[Json], **numerics: float) -> Found:
    job = jobs.Job.model_validate({**data, "history": history, "numerics": numerics})
    begun = start.first(job, Slab(MPI.COMM_SELF, *job.grid.points))
    rows: list[Row] = []
    loop.run(begun, [lambda now: rows.append(now.row)])
    x, friction, area = (np.array(values) for values in zip(*map(_point, rows), strict=True))
    during = x >= 1e-9 * x[-1] if x[-1] > 0.0 else x >= 0.0
    during[int(np.argmax(during)) - 1] |= bool(during[0]) is False
    x, friction, area = x[during], friction[during], area[during]
    calls = sum(row.operator_calls for row in rows[1:])
    highest = float(friction[1:].max())
    return Found(highest, mean_over_end(x, friction), mean_over_end(x, area), calls, len(rows) - 1)


def _point(row: Row) -> tuple[float, float, float]:
    return row.distance, row.measures.friction, row.measures.contact_area_corrected


def errors(found: Found, exact: Found) -> list[float]:
    """Relative, of highest and dynamic friction and of area."""
    return [abs(a / b - 1.0) for a, b in zip(found[:3], exact[:3], strict=True)]


def compare(data: Json, name: str, accuracies: tuple[float, ...], ladder: tuple[float, ...]) -> list[float]:
    """Print the lines of a scene; error over accuracy and cost over the best by hand, of each accuracy."""
    grid = jobs.Grid.model_validate(data["grid"])
    jumps = name in ("velocity step", "dwell, then slide", "sphere", "cylinder")

    def hand(cells: float, **numerics: float) -> Found:
        return march(data, climb(data["history"], cells, grid.dx, jumps), **numerics)

    exact = hand(ladder[-1] / 2.0, tolerance=5e-3 * 1e-2, branch_error=1e-4)
    ratios = list[float]()
    for accuracy in accuracies:
        rungs = [hand(cells, accuracy=accuracy) for cells in ladder]
        good = [rung.calls for rung in rungs if max(errors(rung, exact)) <= accuracy]
        found = march(data, data["history"], accuracy=accuracy)
        wrong = [error / accuracy for error in errors(found, exact)]
        cost = found.calls / min(good) if good else float("nan")
        ratios += [max(wrong), cost]
        shares = "".join(f"{share:9.2f}" for share in wrong)
        print(f"{name:20}{accuracy:8.3g}{shares}{found.steps:8d}{found.calls:8d}{cost:8.2f}", flush=True)
    return ratios


def main(points: int = 128, *names: str, accuracies: tuple[float, ...] = ACCURACIES) -> None:
    print(
        f"{'error over accuracy':20}{'accuracy':>8}{'highest':>9}{'dynamic':>9}{'area':>9}{'steps':>8}{'calls':>8}",
        end="",
    )
    print(f"{'cost':>8}")
    ratios = list[float]()
    for name, data in scenes(points).items():
        if not names or name in names:
            ratios += compare(data, name, accuracies, LADDER)
    shares, costs = np.array(ratios[::2]), np.array(ratios[1::2])
    known = costs[np.isfinite(costs)]
    print(f"error over accuracy: {shares.max():.2f} at most, {np.median(shares):.2f} in the median; ", end="")
    print(f"cost over the best by hand: {known.max():.2f} at most, {np.median(known):.2f} in the median")


if __name__ == "__main__":
    main(*([int(sys.argv[1])] if sys.argv[1:] else []), *sys.argv[2:])

"""How honest the error budget is: estimated over true errors of friction and area, for solver and time steps.

    .venv/bin/python scripts/error_budget.py [scene ...] [--points 64] [--finer 8] [--surfaces 4] [--seed 0]
        [--velocity 1] [--cells 1]

Each scene is marched with its own settings, with a tolerance 1e-4 of that, and with time steps so many times finer (and
the small tolerance). The first two differ by the solver's error, the last two by that of the time steps. Errors are
those of friction and area over the last two thirds of the history: of friction by the solver, which change their sign
from step to step, as rms, by the time steps, which do not, of the mean; of area, which are some points in some of the
steps, the mean of their size. An error may happen to be small on one surface; an estimate is of its usual size: so
both are means over several random surfaces. Another first seed, and velocities and cells per step times these numbers,
make other cases than those by which the estimates were found.
"""

import campaign
import numpy as np
from runs import Json, begun, marched
from sample_scenes import SOLID, cylinder, rough, slide, sphere

from parcontact.job import Numerics

SMALL = 1e-4
COUNTS = 1e-3  # errors that are smaller matter little
PARTS = ("solver friction", "time friction", "solver area", "time area")
DWELL = {"duration": 1e-2, "time_step": {"first": 1e-6, "growth": 1.5}}
COLUMNS = {"friction": "friction", "area": "contact_area_corrected"}


def scenes(points: int, faster: float, cells: float) -> dict[str, Json]:
    """All slide by 32 cells."""

    def on(velocity: float, box: float = 1e-3) -> Json:
        return {**slide(faster * velocity, 32 * box / points), "cells_per_step": cells}

    return {
        "sphere": sphere(points, on(0.046765, 6e-3)),
        "cylinder": cylinder(points, on(0.1)),
        "rough, very light": rough(points, 1e2, on(1.0)),
        "rough, light": rough(points, 2e3, on(1.0)),
        "rough": rough(points, 2e4, on(1.0)),
        "rough, heavy": rough(points, 1e5, on(1.0)),
        "rough, nearly full contact": rough(points, 2.5e5, on(1.0)),
        "rough, one branch": rough(points, 2e4, on(0.1), material=SOLID),
        "rough, dwell and slide": rough(points, 1e4, DWELL, on(0.1)),
    }


def finer(stage: Json, times: int) -> Json:
    if "cells_per_step" in stage:
        return {**stage, "cells_per_step": stage["cells_per_step"] / times}
    first, growth = stage["time_step"].values()
    return {**stage, "time_step": {"first": first / times, "growth": growth ** (1.0 / times)}}


def compare(data: Json, integrator: str, times: int) -> list[tuple[float, float]]:
    """Estimated and true relative error of each part."""
    runs = []
    for share, fine in ((1.0, 1), (SMALL, 1), (SMALL, times)):
        numerics = {"integrator": integrator, "branch_error": 0.0, "tolerance": Numerics().tolerance * share}
        history = [finer(stage, fine) for stage in data["history"]]
        runs.append(marched(begun({**data, "history": history, "numerics": numerics}))[0])
    late = [row for row in runs[0] if row.time > 0.35 * runs[0][-1].time and row.errors and row.errors.friction]
    found = []
    for name, column in COLUMNS.items():
        own, exact, finest = (
            np.interp(
                [row.time for row in late], *zip(*((r.time, getattr(r.measures, column)) for r in rows), strict=True)
            )
            for rows in runs
        )
        size, parts = np.sqrt(np.mean(finest**2)), [getattr(row.errors, name) for row in late]
        solver, steps = own - exact, exact - finest
        true = np.sqrt(np.mean(solver**2)), abs(np.mean(steps))
        if name == "area":
            true = np.mean(abs(solver)), np.mean(abs(steps))
        for part, error in zip(("solver", "time"), true, strict=True):
            weights = [getattr(one, part) * value for one, value in zip(parts, own, strict=True)]
            found.append((float(np.mean(weights) / np.mean(own)), float(error / size)))
    return found


def main() -> None:
    options = campaign.parser(
        __doc__,
        trials=4,
        what="surfaces",
        points=(64, "along x and y"),
        finer=(8, "times as fine are the time steps of the reference"),
        velocity=(1.0, "times as fast"),
        cells=(1.0, "per step"),
    )
    options.add_argument("scenes", nargs="*", help=f"of {'; '.join(scenes(64, 1.0, 1.0))}")
    asked = options.parse_args()
    print(f"{'estimated/true':32}" + "".join(f"{part:>24}" for part in PARTS))
    table = []
    for integrator in ("exponential", "backward-euler"):
        for name, data in scenes(asked.points, asked.velocity, asked.cells).items():
            if asked.scenes and name not in asked.scenes:
                continue
            surfaces = [data]
            if data["surface"]["shape"] == "rough":
                seeds = range(asked.seed, asked.seed + asked.trials)
                surfaces = [{**data, "surface": {**data["surface"], "seed": seed}} for seed in seeds]
            found = np.mean([compare(one, integrator, asked.finer) for one in surfaces], axis=0)
            table.append(found)
            cells = (f"{a:9.1e}/{b:7.1e} {f'{a / b:6.2g}' if b else '     -'}" for a, b in found)
            print(f"{name + ', ' + integrator[:3]:32}" + "".join(cells), flush=True)
    for part, pairs in zip(PARTS, np.swapaxes(table, 0, 1), strict=True):
        for least, which in ((0.0, "the true errors"), (COUNTS, f"those above {100 * COUNTS:g} %")):
            if ratios := [a / b for a, b in pairs if b > least]:
                print(f"{part}: estimates are {min(ratios):.2g} to {max(ratios):.2g} times {which}")


if __name__ == "__main__":
    main()

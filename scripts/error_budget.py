"""How honest the error budget is: estimated over true errors of friction and area, for solver and time steps.

    .venv/bin/python scripts/error_budget.py [--points 64] [--finer 8] [--surfaces 4] [--seed 0] [--velocity 1]
        [--cells 1]

Each scene is marched with its own settings, with a tolerance 1e-4 of that, and with time steps so many times finer (and
the small tolerance). The first two differ by the solver's error, the last two by that of the time steps. Errors are
those of friction and area over the last two thirds of the history: of friction by the solver, which change their sign
from step to step, as rms, by the time steps, which do not, of the mean; of area, which are some points in some of the
steps, the mean of their size. An error may happen to be small on one surface; an estimate is of its usual size: so
both are means over several random surfaces. Another first seed, and velocities and cells per step times these numbers,
make other cases than those by which the estimates were found.
"""

import argparse
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from parcontact import job as jobs
from parcontact import scene
from parcontact.march import loop
from parcontact.march.loop import March
from parcontact.parallel.slab import Slab
from parcontact.physics.budget import Parts
from parcontact.storage.row import Row

Json = dict[str, Any]
SMALL = 1e-4
COUNTS = 1e-3  # errors that are smaller matter little
PARTS = ("solver friction", "time friction", "solver area", "time area")
BRANCHES = [{"modulus": 2e6 * 3.0**-k, "relaxation_time": 1e-6 * 10.0**k} for k in range(5)]
RUBBER = {"model": "zener", "modulus_inf": 1e5, "branches": BRANCHES}
SOLID = {"model": "zener", "modulus_inf": 0.275e6, "branches": [{"modulus": 2.475e6, "relaxation_time": 1e-3}]}


def rough(points: int, pressure: float, velocity: float, material: Json = RUBBER) -> Json:
    wave = min(16.0 / points * 1e-3, 1.25e-4)  # 16 cells where the box has room for two such waves in its longest
    surface = {"shape": "rough", "hurst": 0.9, "long_wavelength": 2.5e-4, "short_wavelength": wave, "rms_slope": 0.02}
    stage = {"pressure": pressure, "velocity": velocity, "distance": 32e-3 / points, "cells_per_step": 1}
    return {"grid": {"points": points, "size": 1e-3}, "surface": surface, "material": material, "history": [stage]}


def sphere(points: int, velocity: float) -> Json:
    ball = {"shape": "sphere", "radius": 1e-2, "center": [2e-3, 3e-3]}
    stage = {"force": 0.15, "velocity": velocity, "distance": 32 * 6e-3 / points, "cells_per_step": 1}
    grid = {"points": points, "size": 6e-3, "boundary": "free"}
    return {"grid": grid, "surface": ball, "material": SOLID, "history": [stage]}


def change(data: Json, seed: int, faster: float, cells: float) -> Json:
    """A scene with another rough surface, and other velocities and steps."""
    surface = {**data["surface"], "seed": seed} if data["surface"]["shape"] == "rough" else data["surface"]
    stages = [
        {**s, "velocity": s["velocity"] * faster, "cells_per_step": cells} if "velocity" in s else s
        for s in data["history"]
    ]
    return {**data, "surface": surface, "history": stages}


def scenes(points: int) -> dict[str, Json]:
    cylinder = {"shape": "cylinder", "radius": 1e-2, "center": [1.5e-3, 0.0]}
    stage = {"pressure": 2e4, "velocity": 0.1, "distance": 32 * 4e-3 / (4 * points), "cells_per_step": 1}
    line = {"grid": {"points": [4 * points, 1], "size": [4e-3, 1e-3]}, "surface": cylinder, "history": [stage]}
    slow = rough(points, 1e4, 0.1)
    slow["history"].insert(0, {"pressure": 1e4, "duration": 1e-2, "time_step": {"first": 1e-6, "growth": 1.5}})
    return {
        "sphere": sphere(points, 0.046765),
        "cylinder": {**line, "material": SOLID},
        "rough, very light": rough(points, 1e2, 1.0),
        "rough, light": rough(points, 2e3, 1.0),
        "rough": rough(points, 2e4, 1.0),
        "rough, heavy": rough(points, 1e5, 1.0),
        "rough, nearly full contact": rough(points, 2.5e5, 1.0),
        "rough, one branch": rough(points, 2e4, 0.1, SOLID),
        "rough, dwell and slide": slow,
    }


def march(data: Json, tolerance: float | None, fine: int, integrator: str) -> list[Row]:
    numerics = {"integrator": integrator, "branch_error": 0.0, **({"tolerance": tolerance} if tolerance else {})}
    history = [_finer(stage, fine) for stage in data["history"]]
    job = jobs.Job.model_validate({**data, "history": history, "numerics": numerics})
    rows: list[Row] = []
    loop.run(March(scene.build(job, Slab(MPI.COMM_SELF, *job.grid.points))), [lambda now: rows.append(now.row)])
    return rows


def _finer(stage: Json, fine: int) -> Json:
    if "cells_per_step" in stage:
        return {**stage, "cells_per_step": stage["cells_per_step"] / fine}
    step = stage["time_step"]
    return {**stage, "time_step": {"first": step["first"] / fine, "growth": step["growth"] ** (1.0 / fine)}}


def series(rows: list[Row], times: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    """Of a measure, at some instants."""
    return np.interp(times, [row.time for row in rows], [getattr(row.measures, name) for row in rows])


def compare(data: Json, integrator: str, finer: int) -> dict[str, tuple[float, float]]:
    """Estimated and true relative error by part and measure."""
    tolerance = jobs.Numerics().tolerance
    own, exact, finest = (
        march(data, tolerance * share, fine, integrator) for share, fine in ((1.0, 1), (SMALL, 1), (SMALL, finer))
    )
    late = [row for row in own if row.time > 0.35 * own[-1].time and row.errors and row.errors.friction]
    times = np.array([row.time for row in late])
    found = {}
    for measure, name in (("friction", "friction"), ("area", "contact_area_corrected")):
        a, b, c = (series(rows, times, name) for rows in (own, exact, finest))
        size = np.sqrt(np.mean(c**2))
        true = {
            "solver": np.sqrt(np.mean((a - b) ** 2)) if measure == "friction" else np.mean(abs(a - b)),
            "time": abs(np.mean(b - c)) if measure == "friction" else np.mean(abs(b - c)),
        }
        for part, error in true.items():
            parts: list[Parts] = [getattr(row.errors, measure) for row in late if row.errors]
            estimate = np.mean([getattr(one, part) * v for one, v in zip(parts, a, strict=True)]) / np.mean(a)
            found[f"{part} {measure}"] = float(estimate), float(error / size)
    return found


def mean_over(surfaces: list[dict[str, tuple[float, float]]]) -> dict[str, tuple[float, float]]:
    """Of estimates and of true errors."""
    return {
        part: (float(np.mean([one[part][0] for one in surfaces])), float(np.mean([one[part][1] for one in surfaces])))
        for part in PARTS
    }


def main(points: int, finer: int, surfaces: int, seed: int, velocity: float, cells: float) -> None:
    print(f"{'estimated/true':32}" + "".join(f"{part:>24}" for part in PARTS))
    honest: dict[str, list[tuple[float, float]]] = {part: [] for part in PARTS}
    for integrator in ("exponential", "backward-euler"):
        for name, data in scenes(points).items():
            seeds = range(seed, seed + (surfaces if data["surface"]["shape"] == "rough" else 1))
            found = mean_over([compare(change(data, one, velocity, cells), integrator, finer) for one in seeds])
            print(f"{name + ', ' + integrator[:3]:32}", end="")
            for part in PARTS:
                estimate, true = found[part]
                honest[part].append((estimate, true))
                ratio = f"{estimate / true:6.2g}" if true > 0.0 else "     -"
                print(f"{estimate:9.1e}/{true:7.1e} {ratio}", end="")
            print(flush=True)
    for part, pairs in honest.items():
        for least, which in ((0.0, "the true errors"), (COUNTS, f"those above {100 * COUNTS:g} %")):
            ratios = [estimate / true for estimate, true in pairs if true > least]
            if ratios:
                print(f"{part}: estimates are {min(ratios):.2g} to {max(ratios):.2g} times {which}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    for name, kind, given in (
        ("points", int, 64),
        ("finer", int, 8),
        ("surfaces", int, 4),
        ("seed", int, 0),
        ("velocity", float, 1.0),
        ("cells", float, 1.0),
    ):
        parser.add_argument(f"--{name}", type=kind, default=given)
    main(**vars(parser.parse_args()))

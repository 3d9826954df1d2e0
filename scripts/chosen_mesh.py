#!/usr/bin/env python3
"""Check if the meshes chosen by `points: auto` keep numerics.accuracy, and if cheaper meshes would keep it.

    .venv/bin/python scripts/chosen_mesh.py [--scenes 10] [--seed 0] [--area 1.0] [--dozens 1] [--finest 1920]

Each scene is a steady state of a random rough surface with `--dozens` of its shortest waves along a side: Hurst
exponents of 0.5 to 1, slopes of 0.01 to 0.2, 1 to 80 % of contact, bodies of one branch or of twelve. Accuracies are
5, 1 and 0.3 % of friction; accuracies of the area are `--area` times as large. The reference has `--finest` points
along each side, 160 cells per shortest wave, or 80 with 24 waves. Its area is extrapolated from this mesh and half as
many points.

A chosen mesh is compared with the cheapest mesh that has LENGTHS along each side and cells up to 4 : 1. Errors scatter
and change signs from mesh to mesh, so a coarse mesh may keep an accuracy by chance. The cheapest mesh is therefore one
that keeps the accuracy together with all meshes that are as fine or finer along each side.

The last lines judge MORE of `march.mesh`, by the guessed over the true area; LONG_CELLS of `physics.records`, by the
true excess of the counted area over the assumed one, on meshes with square and with long cells; and SEED_FRICTION and
SEED_AREA of `job.advice`, by the scatter over SEEDS surfaces times the number of longest waves along a side. SURE of
`job.advice`, and SLOWNESS of `march.mesh`, are judged by the errors of chosen meshes.

The exit code is 0 if at most a tenth of the accuracies is missed, and if chosen meshes have in the median at most MOST
times the points of the cheapest ones.
"""

import argparse
import math
import statistics
import sys
import warnings
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from functools import cache, partial
from itertools import product
from operator import le
from random import Random
from typing import Any

import campaign
import numpy as np

import parcontact as pc
from parcontact.march.mesh import guesses, load

ACCURACIES = (0.05, 0.01, 0.003)
SIZE, DOZEN = 1e-3, 12
MOST = 1.5  # points over the points of the cheapest mesh
LENGTHS = (32, 48, 64, 80, 96, 128, 160, 192, 240, 288, 384, 480)  # points along a side for a dozen of shortest waves
AREA_ORDER = 1.0  # order of the error, as edges of contact are wrong by a share of a cell
AREA, DOZENS = "accuracy of the area over accuracy of friction", "dozens of shortest waves along a side of the box"

LONGEST_WAVES, SEEDS = 3, 6  # longest waves along a side, and surfaces for their scatter
LEAST_CELLS, LONG = 5, 4  # cells per shortest wave, and ratio of their sides, where excesses are compared

Mesh = tuple[int, int]
Ratios = dict[str, list[float]]
Keeps = Callable[[Mesh], bool]


def scene(seed: int, number: int, dozens: int) -> dict[str, Any]:
    """Return a job without points and accuracy."""
    wave = SIZE / (DOZEN * dozens)
    dice = Random(f"mesh {seed} {number}")
    slope, speed = 10.0 ** dice.uniform(-2.0, -0.7), 10.0 ** dice.uniform(-1.5, 1.0)
    rough = {"shape": "rough", "hurst": round(dice.uniform(0.5, 1.0), 2), "rms_slope": slope, "seed": number}
    tau = wave / speed * 10.0 ** dice.uniform(-1.0, 1.0) / (2.0 * math.pi)
    one = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 10.0 ** dice.uniform(5.5, 7.5)}]}
    one["branches"][0]["relaxation_time"] = tau  # type: ignore[index]
    body = one if dice.random() < 0.5 else {"include": "synthetic_tyre"}
    area = 10.0 ** dice.uniform(-2.0, -0.1)
    stiffness = abs(complex(pc.material(body).complex_modulus(2.0 * math.pi * speed / (wave))))
    pressure = stiffness * slope * (2.0 * area + 8.0 * max(area - 0.5, 0.0))
    return {
        "grid": {"size": SIZE},
        "surface": {**rough, "long_wavelength": SIZE / LONGEST_WAVES, "short_wavelength": wave},
        "material": body,
        "steady": {"velocities": [speed], "pressures": [pressure]},
    }


def steady(job: dict[str, Any], mesh: Mesh) -> tuple[float, float, float]:
    """Return friction, corrected and counted area, with a tolerance of a hundredth of the smallest accuracy."""
    numerics = {"tolerance": 3e-5, "branch_error": 0.0}
    found = pc.steady({**job, "grid": {"points": list(mesh), "size": SIZE}, "numerics": numerics})
    return float(found.friction[0]), float(found.contact_area_corrected[0]), float(found.contact_area[0])


def trial(asked: argparse.Namespace, counts: Counter[str], ratios: Ratios, number: int) -> Iterator[str]:
    """Yield the missed accuracies; append ratios of points, areas and their excesses."""
    job, meshes = scene(asked.seed, number, asked.dozens), meshes_of(asked.dozens, asked.finest)
    solved = cache(partial(steady, job))
    finest, half = solved((asked.finest, asked.finest)), solved((asked.finest // 2, asked.finest // 2))
    true = finest[0], finest[1] + (finest[1] - half[1]) / (2.0**AREA_ORDER - 1.0)
    print(f"{number}: friction {true[0]:.5f}, area {true[1]:.4f}", flush=True)

    def errors(mesh: Mesh) -> tuple[float, float]:
        friction, area, _ = solved(mesh)
        return abs(friction / true[0] - 1.0), abs(area / true[1] - 1.0)

    for accuracy in ACCURACIES:
        wanted = {"friction": accuracy, "area": min(asked.area * accuracy, 0.9)}
        limits = tuple(wanted.values())
        keeps: Keeps = cache(lambda mesh, limits=limits: all(map(le, errors(mesh), limits)))
        chosen = load({**job, "grid": {"points": "auto", "size": SIZE}, "numerics": {"accuracy": wanted}}).grid.points
        found = " and ".join(f"{100 * error:.2f} %" for error in errors(chosen))
        counts["accuracies"] += 1
        text, best = f"{100 * accuracy:g} %: {chosen[0]} x {chosen[1]}", cheapest(keeps, meshes, math.prod(chosen))
        ratios["points"].append(math.prod(chosen) / math.prod(best or chosen))
        print(f"  {text}, errors {found}; cheapest: {f'{best[0]} x {best[1]}' if best else 'this one'}", flush=True)
        if not keeps(chosen):
            counts["missed"] += 1
            yield f"{text} points have errors of {found}"
    read = load({**job, "grid": {"points": 64, "size": SIZE}})
    ratios["guess"].append(guesses(read, SIZE / (DOZEN * asked.dozens), SIZE**2)[0].share / true[1])
    dense = DOZEN * asked.dozens * LEAST_CELLS
    for name, mesh in (("square", (dense, dense)), ("long", (LONG * dense, dense)), ("long", (dense, LONG * dense))):
        _, corrected, counted = solved(mesh)
        ratios[name].append((counted - true[1]) / (counted - corrected))
    others = [{**job, "surface": {**job["surface"], "seed": 1000 + seed}} for seed in range(SEEDS)]
    values = np.array([steady(other, (dense, dense))[:2] for other in others])
    scatter = LONGEST_WAVES * values.std(axis=0, ddof=1) / values.mean(axis=0)
    for name, value in zip(("friction", "area"), scatter.tolist(), strict=True):
        ratios[name].append(value)


def meshes_of(dozens: int, finest: int) -> list[Mesh]:
    """Return the meshes for a number of dozens of shortest waves, the cheapest first. All are much coarser than the
    reference."""
    lengths = [dozens * length for length in LENGTHS if 4 * length <= finest]
    return sorted(((nx, ny) for nx, ny in product(lengths, lengths) if ny <= nx <= 4 * ny), key=math.prod)


def cheapest(keeps: Keeps, meshes: list[Mesh], most: int) -> Mesh | None:
    """Return the mesh with the fewest points, below `most`, that keeps the accuracy together with all meshes that are
    as fine or finer along each side; None without one."""
    for one in (mesh for mesh in meshes if math.prod(mesh) < most):
        if all(keeps(other) for other in meshes if other[0] >= one[0] and other[1] >= one[1]):
            return one
    return None


def main() -> int:
    finest = 1920, "points of the reference along a side"
    options = campaign.parser(__doc__, 10, "scenes", area=(1.0, AREA), dozens=(1, DOZENS), finest=finest)
    asked, counts, ratios = options.parse_args(), Counter[str](), defaultdict[str, list[float]](list)
    warnings.simplefilter("ignore")
    campaign.go(asked, partial(trial, asked, counts, ratios), counts)
    median, more = statistics.median(ratios["points"]), sum(ratio > MOST for ratio in ratios["points"])
    print(f"points over points of the cheapest mesh: {median:.2f} in the median, above {MOST} {more} times")
    print(f"guessed area over the true one: {statistics.median(ratios['guess']):.2f} in the median")
    excess = ", ".join(f"{name} cells {statistics.median(ratios[name]):.2f}" for name in ("square", "long"))
    seeds = ", ".join(f"{name} {statistics.median(ratios[name]):.2f}" for name in ("friction", "area"))
    print(f"scatter of surfaces times longest waves along a side, median: {seeds}")
    print(f"excess of the counted area over the assumed one, median: {excess}")
    return 0 if counts["missed"] <= 0.1 * counts["accuracies"] and median <= MOST else 1


if __name__ == "__main__":
    sys.exit(main())

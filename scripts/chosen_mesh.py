#!/usr/bin/env python3
"""Whether meshes that `points: auto` chooses keep what numerics.accuracy asks for, and whether cheaper ones would.

    .venv/bin/python scripts/chosen_mesh.py [--scenes 10] [--seed 0] [--area 1.0]

Each scene is a steady state of a random rough surface with 12 of its shortest waves along a side: Hurst exponents of
0.5 to 1, slopes of 0.01 to 0.2, 1 to 80 % of contact, bodies of one branch and of twelve. Accuracies are 5, 1 and 0.3 %
of friction, and `--area` times as much of the area. True errors are those against 80 cells per shortest wave along the
sliding and 40 across it, of the area extrapolated from half as many and these. The cheapest mesh is looked for among
cells up to 4 : 1, multiples of 16 along each side: it keeps the accuracy, as the next finer ones do. A chosen mesh that
misses it, or has more than 1.5 times the points of the cheapest one, is a fault. Ends with 0 if at most a tenth of the
accuracies is missed, and at most a tenth of the meshes could be cheaper.
"""

import math
import statistics
import sys
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache, partial
from operator import le
from random import Random
from typing import Any

import campaign

import parcontact as pc
from parcontact.job import load

ACCURACIES = (0.05, 0.01, 0.003)
SIZE, WAVES = 1e-3, 12
FINEST = 80, 40  # cells per shortest wave of the reference, along the sliding and across it
MOST = 1.5  # times the points of the cheapest mesh
LENGTHS = (32, 48, 64, 80, 96, 128, 160, 192, 240, 288)
AREA_ORDER = 1.3

Mesh = tuple[int, int]


def scene(seed: int, number: int) -> dict[str, Any]:
    """A job without points and accuracy."""
    dice = Random(f"mesh {seed} {number}")
    slope, speed = 10.0 ** dice.uniform(-2.0, -0.7), 10.0 ** dice.uniform(-1.5, 1.0)
    rough = {"shape": "rough", "hurst": round(dice.uniform(0.5, 1.0), 2), "rms_slope": slope, "seed": number}
    tau = SIZE / 12 / speed * 10.0 ** dice.uniform(-1.0, 1.0) / (2.0 * math.pi)
    one = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 10.0 ** dice.uniform(5.5, 7.5)}]}
    one["branches"][0]["relaxation_time"] = tau  # type: ignore[index]
    body = one if dice.random() < 0.5 else {"include": "synthetic_tyre"}
    area = 10.0 ** dice.uniform(-2.0, -0.1)
    stiffness = abs(complex(pc.material(body).complex_modulus(2.0 * math.pi * speed / (SIZE / 12))))
    pressure = stiffness * slope * (2.0 * area + 8.0 * max(area - 0.5, 0.0))
    return {
        "grid": {"size": SIZE},
        "surface": {**rough, "long_wavelength": SIZE / 3, "short_wavelength": SIZE / WAVES},
        "material": body,
        "steady": {"velocities": [speed], "pressures": [pressure]},
    }


def steady(job: dict[str, Any], mesh: Mesh) -> tuple[float, float]:
    """Friction and corrected area, solved ten times as well as the smallest accuracy asks for."""
    numerics = {"tolerance": 3e-4, "branch_error": 0.0}
    found = pc.steady({**job, "grid": {"points": list(mesh), "size": SIZE}, "numerics": numerics})
    return float(found.friction[0]), float(found.contact_area_corrected[0])


def trial(seed: int, times: float, counts: Counter[str], ratios: list[float], number: int) -> Iterator[str]:
    """Yield what is missed, and where a cheaper mesh would do; add the points over those of the cheapest mesh."""
    job = scene(seed, number)
    solved = cache(partial(steady, job))
    along, across = (WAVES * cells for cells in FINEST)
    finest, half = solved((along, across)), solved((along // 2, across // 2))
    true = finest[0], finest[1] + (finest[1] - half[1]) / (2.0**AREA_ORDER - 1.0)
    print(f"{number}: friction {true[0]:.5f}, area {true[1]:.4f}", flush=True)

    def errors(mesh: Mesh) -> tuple[float, float]:
        friction, area = solved(mesh)
        return abs(friction / true[0] - 1.0), abs(area / true[1] - 1.0)

    for accuracy in ACCURACIES:
        asked = {"friction": accuracy, "area": min(times * accuracy, 0.9)}
        limits = tuple(asked.values())
        keeps: Callable[[Mesh], bool] = lambda mesh, limits=limits: all(map(le, errors(mesh), limits))  # type: ignore[misc] # noqa: E731
        chosen = load({**job, "grid": {"points": "auto", "size": SIZE}, "numerics": {"accuracy": asked}}).grid.points
        found = " and ".join(f"{100 * error:.2f} %" for error in errors(chosen))
        counts["accuracies"] += 1
        text = f"{100 * accuracy:g} %: {chosen[0]} x {chosen[1]}"
        print(f"  {text}, errors {found}", flush=True)
        if not keeps(chosen):
            counts["missed"] += 1
            yield f"{text} points miss it by {found}"
        cheapest = next((mesh for mesh in cheaper_meshes(chosen) if robust(keeps, mesh)), chosen)
        ratios.append(math.prod(chosen) / math.prod(cheapest))
        if ratios[-1] > MOST:
            counts["could be cheaper"] += 1
            yield f"{text} points, and {cheapest[0]} x {cheapest[1]} would do"


def cheaper_meshes(chosen: Mesh) -> list[Mesh]:
    """Meshes with fewer points, the fewest first; cells are at most four times as long as wide."""
    found = [(nx, ny) for nx in LENGTHS for ny in LENGTHS if ny <= nx <= 4 * ny and nx * ny < math.prod(chosen)]
    return sorted(found, key=math.prod)


def robust(keeps: Callable[[Mesh], bool], mesh: Mesh) -> bool:
    """Return whether a mesh keeps the accuracy, and those that are finer in one direction do: errors change signs."""
    finer = [LENGTHS[LENGTHS.index(n) + 1] if n < LENGTHS[-1] else n for n in mesh]
    return all(map(keeps, (mesh, (finer[0], mesh[1]), (mesh[0], finer[1]))))


def main() -> int:
    options = campaign.parser(__doc__, 10, "scenes", area=(1.0, "the accuracy of the area over that of friction"))
    asked, counts, ratios = options.parse_args(), Counter[str](), list[float]()
    warnings.simplefilter("ignore")
    campaign.go(asked, partial(trial, asked.seed, asked.area, counts, ratios), counts)
    most, median = max(ratios), statistics.median(ratios)
    print(f"points over those of the cheapest mesh: {median:.2f} in the median, {most:.2f} at most")
    allowed = 0.1 * counts["accuracies"]
    return 0 if counts["missed"] <= allowed and counts["could be cheaper"] <= allowed else 1


if __name__ == "__main__":
    sys.exit(main())

"""Compare bands with one grid that holds all waves, for random surfaces, or with --line for profiles of three decades.

Bands have four cells per shortest wave, as `bands: auto` has, and the one grid has `--cells`, by default eight. The
coarsest band has the waves of the one grid. They differ by the method, by the random surfaces of the finer bands and by
the mesh. Areas are corrected ones. A case of `--points 256` takes some ten seconds on one core, one of 1024 some five
minutes. Each line is a case. The last lines count in how many cases friction is within 5 %, the area is within 6 %, and
the stated error covers the difference.

    python scripts/band_errors.py --cases 20 --seed 7 --points 256 --samples 8
"""

import math
import sys
import time
from typing import Any

import numpy as np
from campaign import numbers, parser
from numpy.typing import NDArray

from parcontact import job as jobs
from parcontact.bands.band import Band
from parcontact.bands.choice import cut_bands
from parcontact.bands.road_sliding import SURE, RoadSliding
from parcontact.march.budget import ErrorParts
from parcontact.march.steady import Point
from parcontact.parallel.slab import Slab

COMPOUNDS: dict[str, dict[str, Any]] = {
    "tyre": {"include": "synthetic_tyre"},
    "one branch": {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 2e7, "relaxation_time": 1e-3}]},
    "broad": {
        "model": "zener",
        "modulus_inf": 2e6,
        "branches": [{"modulus": 3e6 * 1.6**k, "relaxation_time": 10.0 ** (1 - k)} for k in range(9)],
    },
}
LONG = 4e-3  # m
POINTS = (320, 512, 512, 1024)  # points along a side of one grid with CELLS
CELLS = 4  # cells per shortest wave of bands
LINE = 65536
KNOWN = (  # velocities [m/s] and pressures [Pa] of synthetic_tyre on surfaces of 1.5 and on profiles of 3 decades
    ((0.1, 1e6), (0.1, 2e5), (10.0, 2e6), (1e-3, 3e5)),
    ((0.1, 1e6), (1e-3, 1e6), (10.0, 1e6), (0.1, 2e5), (10.0, 1e7)),
)


def case_of(number: int, seed: int, line: bool, along: int) -> tuple[dict[str, Any], int, float, float]:
    """Return a job without bands, the points of one grid with CELLS (`along`, or random ones for 0), a velocity [m/s]
    and a pressure [Pa]."""
    chance = np.random.default_rng([seed, number])
    name = list(COMPOUNDS)[number % 3]
    drawn = int(chance.choice(POINTS))
    points = LINE if line else along or drawn
    slope, hurst = float(10 ** chance.uniform(-1.3, -0.3)), round(float(chance.uniform(0.5, 0.9)), 2)
    speed = float(10 ** chance.uniform(-2.5, 1.0))
    surface = {
        **{
            "shape": "rough",
            "hurst": hurst,
            "long_wavelength": LONG,
            "short_wavelength": LONG * (64 if line else 16) / points,
        },
        **{"rms_slope": round(slope, 3), "seed": int(chance.integers(1000)), "amplitudes": "fixed"},
    }
    load = float(10 ** chance.uniform(-2.0, 0.5))  # pressure over the rms pressure of full contact
    job = {
        **{"surface": surface, "material": COMPOUNDS[name], "numerics": {"tolerance": 2e-3}},
        **{"steady": {"velocities": [speed], "pressures": [1e5]}},
    }
    shape = [points, 1] if line else points
    of_all = jobs.load({**job, "bands": {"count": 1, "points": shape}})
    band = Band(of_all, cut_bands(of_all), 0, 0)
    band.slide((speed, 0.0))
    text = f"{name:10} H {hurst:4} slope {slope:5.3f} v {speed:7.3g} points {points}"
    return {**job, "title": text}, points, speed, load * band.full_contact_rms


def known_case(number: int, line: bool) -> tuple[dict[str, Any], int, float, float]:
    """Return the same for a road of Hurst exponent 0.8. It is a surface of rms slope 0.25 with waves up to 1 mm, or a
    profile with waves up to 4 mm, whose Hurst exponent is smaller by one half."""
    speed, load = KNOWN[line][number % len(KNOWN[line])]
    points, longest, hurst, slope = (LINE, LONG, 0.3, 0.177) if line else (512, 1e-3, 0.8, 0.25)
    waves = {"long_wavelength": longest, "short_wavelength": longest * (64 if line else 16) / points}
    seed = 1 + number // len(KNOWN[line])
    surface = {"shape": "rough", "hurst": hurst, "rms_slope": slope, "seed": seed, "amplitudes": "fixed", **waves}
    job = {
        **{"surface": surface, "material": COMPOUNDS["tyre"], "numerics": {"tolerance": 2e-3}},
        **{"steady": {"velocities": [speed], "pressures": [load]}},
    }
    return {**job, "title": f"tyre v {speed:g} p {load:g}"}, points, speed, load


def solve(
    job: dict[str, Any], count: int, points: int, cells: int, samples: int, line: bool, speed: float, load: float
) -> Point:
    """Return the steady state in bands with CELLS, or on one grid with `cells` per shortest wave."""
    waves = 64 if line else 16  # points of a band over the cells per shortest wave, for one band
    along = points * cells // CELLS if count == 1 else 2 * round(waves / 2 * (points / waves) ** (1 / count))
    shape = [along, 1] if line else along
    bands = {"count": count, "points": shape, "samples": samples}
    return RoadSliding(jobs.load({**job, "bands": bands}), Slab.alone(1, 1)).solve((speed, 0.0), load)


def compare(whole: Point, found: Point, text: str) -> list[float]:
    """Print how bands differ from one grid; return the differences of friction and area, the stated errors, and the
    standard errors of the means over surfaces."""
    parts = [part or ErrorParts(0.0, 0.0, 0.0, 0.0) for part in (found.errors.friction, found.errors.area)]
    areas = [point.measures.contact_area_corrected for point in (found, whole)]
    errors = [found.friction / whole.friction - 1, areas[0] / areas[1] - 1]
    stated = [
        f"{name} {100 * error:+5.1f} % (stated {100 * part.total:.1f}: method {100 * part.method:.1f}, "
        f"mesh {100 * part.mesh:.1f}, surfaces {100 * part.scatter:.1f})"
        for name, error, part in zip(("friction", "area"), errors, parts, strict=True)
    ]
    print(f"{text}: {', '.join(stated)}, {whole.seconds:.0f} s and {found.seconds:.0f} s", flush=True)
    return [*errors, *(part.total for part in parts), *(part.scatter / SURE for part in parts)]


def conclude(count: int, table: NDArray[np.float64]) -> None:
    """Print for all cases the differences, the part of them by the scatter of surfaces, and the numbers of cases with
    small differences and within the stated errors."""
    for column, (name, most) in enumerate((("friction", 0.05), ("area", 0.06))):
        error = table[:, column]
        covered = abs(error) <= table[:, 2 + column] * (1 + error)  # stated errors are relative to the values of bands
        rms, chance = (100 * math.sqrt(np.mean(table[:, place] ** 2)) for place in (column, 4 + column))
        print(
            f"{count} bands, {name}: mean {100 * error.mean():+.1f} %, rms {rms:.1f} %, of which scatter of surfaces "
            f"{chance:.1f} %, largest {100 * abs(error).max():.1f} %; within {100 * most:g} % in "
            f"{np.sum(abs(error) <= most)} of {len(error)}; within the stated error in "
            f"{np.sum(covered)}"
        )


def main() -> int:
    asked = parser(
        *(__doc__, 20, "cases"),
        bands=("2,3", "numbers of bands"),
        samples=(2, "surfaces"),
        cells=(8, "cells per shortest wave of the one grid"),
        points=(0, "points along a side of one grid with 4 cells per shortest wave; 0 draws them"),
        line=(False, "profiles of three decades along the sliding"),
        known=(False, "the cases of the manual for one road, with other seeds, instead of random cases"),
    ).parse_args()
    counts, began = [int(count) for count in asked.bands.split(",")], time.monotonic()
    rows: dict[int, list[list[float]]] = {count: [] for count in counts}
    for number in numbers(asked):
        if time.monotonic() - began > 60 * asked.minutes:
            break
        case = known_case(number, asked.line) if asked.known else case_of(number, asked.seed, asked.line, asked.points)
        job, points, speed, load = case
        place = asked.cells, asked.samples, asked.line, speed, load
        whole = solve(job, 1, points, *place)
        text = f"{number:3} {job['title']} area {whole.measures.contact_area_corrected:6.4f} mu {whole.friction:7.4f}"
        for count in counts:
            rows[count].append(compare(whole, solve(job, count, points, *place), f"{text} {count}"))
    for count, table in rows.items():
        conclude(count, np.array(table))
    return 0


if __name__ == "__main__":
    sys.exit(main())

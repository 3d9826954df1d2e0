#!/usr/bin/env python3
"""Steady sliding of random bodies at high pressures and velocities: costs, and failed solves.

    .venv/bin/python scripts/random_steady.py [--bodies 200] [--seed 1] [--only NUMBER] [--most 600] [--exact]

Rubbers have 2 to 12 branches and instantaneous moduli of 3 to 1000 times the long-term modulus. They slide on
self-affine surfaces under 1 to 100 MPa at 0.3 to 100 m/s. Each result is checked by an independent operator made with
numpy. The exit code is 1 if a solve fails, a result is wrong, or a solve takes more than `--most` operator calls.
`--exact` also solves to a tolerance of 1e-4, and prints the rms differences of friction and of the corrected area.
"""

import sys
from collections import Counter
from collections.abc import Iterator
from functools import partial
from typing import Any

import campaign
import numpy as np
from runs import ROOT

sys.path.insert(0, str(ROOT / "tests"))

from steady_scenes import certificate

from parcontact import job
from parcontact.march import scene
from parcontact.march.steady import SteadySliding
from parcontact.parallel.slab import Slab
from parcontact.physics.prony import complex_modulus


def drawn(random: np.random.Generator) -> tuple[dict[str, Any], float, float]:
    """Return a job, a speed [m/s] and a pressure [Pa]."""

    def between(least: float, most: float) -> float:
        return float(np.exp(random.uniform(np.log(least), np.log(most))))

    points, cells, size = int(random.choice([128, 192, 256])), int(random.choice([4, 8, 16])), between(2e-4, 5e-3)
    shortest = cells * size / points
    rough = {"hurst": random.uniform(0.5, 1.0), "long_wavelength": size / random.integers(2, 6)}
    branches, modulus_inf, stiffer = int(random.integers(2, 13)), between(3e5, 3e6), between(3.0, 1000.0)
    times = between(1e-9, 1e-6) * np.logspace(0.0, random.uniform(1.0, 12.0), branches)
    moduli = times ** -random.uniform(0.0, 0.7) * np.exp(random.normal(0.0, 0.5, branches))
    moduli *= modulus_inf * (stiffer - 1.0) / moduli.sum()
    speed, pressure = between(0.3, 100.0), between(1e6, 1e8)
    stiffness = abs(complex_modulus(2.0 * np.pi * speed / shortest, modulus_inf, moduli, times))
    rough |= {"short_wavelength": shortest, "rms_slope": between(0.2, 10.0) * pressure / float(stiffness)}
    pairs = zip(moduli.tolist(), times.tolist(), strict=True)
    listed = [{"modulus": modulus, "relaxation_time": time} for modulus, time in pairs]
    made = {
        "grid": {"points": points, "size": size},
        "surface": {"shape": "rough", **rough, "seed": int(random.integers(10000))},
        "material": {"model": "zener", "modulus_inf": modulus_inf, "branches": listed},
        "history": [{"pressure": 1.0}],
    }
    return made, speed, pressure


def trial(
    asked: Any, counts: Counter[str], calls: list[float], differences: list[list[float]], number: int
) -> Iterator[str]:
    made, speed, pressure = drawn(np.random.default_rng([asked.seed, number]))
    points = made["grid"]["points"]
    sliding = SteadySliding(scene.set_up(job.load(made), Slab.alone(points, points)))
    point = sliding.solve((speed, 0.0), pressure)
    counts["solved"] += 1
    calls.append(point.operator_calls)
    if point.operator_calls > asked.most:
        yield f"{point.operator_calls:.0f} operator calls, contact {point.measures.contact_area:.4f}"
    found, allowed = certificate(sliding, speed, pressure), sliding.setup.job.numerics.tolerance
    if asked.exact:
        tight = job.load(made, ["numerics.tolerance=1.0e-4"])
        exact = SteadySliding(scene.set_up(tight, Slab.alone(points, points))).solve((speed, 0.0), pressure)
        areas = point.measures.contact_area_corrected, exact.measures.contact_area_corrected
        differences.append([point.friction / exact.friction - 1.0, areas[0] / areas[1] - 1.0])
    if found > allowed * (1 + 1e-6):
        yield f"WRONG, certificate {found:.3g} instead of {allowed:g}"


def main() -> int:
    more = {"most": (600.0, "operator calls"), "exact": (False, "differences from a tolerance of 1e-4")}
    options = campaign.parser(__doc__, trials=200, what="bodies", **more)
    options.set_defaults(seed=1)
    asked, counts, calls, differences = options.parse_args(), Counter[str](), list[float](), list[list[float]]()
    faulty = campaign.go(asked, partial(trial, asked, counts, calls, differences), counts)
    print("operator calls, median, 90 %, most:", *np.percentile(calls, [50, 90, 100]).round())
    if differences:
        print("rms differences of friction and area:", *np.sqrt(np.mean(np.square(differences), axis=0)))
    return 1 if faulty else 0


if __name__ == "__main__":
    sys.exit(main())

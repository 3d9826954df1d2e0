"""Random bodies in steady sliding: each is solved or said not to be, and nothing wrong is returned.

    .venv/bin/python scripts/random_steady.py [--trials 200] [--points 128] [--seed 1] [--only NUMBER]

1 to 15 relaxation times over ten decades, tan(delta) up to 3, G0/G_inf up to 1e4; velocities over ten decades; loads
for 0.1 % to 99 % of contact, by an elastic estimate. Each result is checked by an operator of numpy's own: the complex
symbol on the whole map. Exit code 1 if a wrong state was returned, or 5 % were not solved.
"""

import sys
from collections import Counter
from collections.abc import Iterator
from functools import partial

import campaign
import numpy as np
from mpi4py import MPI
from runs import ROOT

sys.path.insert(0, str(ROOT / "tests"))

from steady_scenes import certificate

from parcontact import job, scene
from parcontact.errors import RunError
from parcontact.parallel.slab import Slab
from parcontact.physics.prony import complex_modulus
from parcontact.steady_sliding.sliding import SteadySliding

DECADES = np.geomspace(1e-12, 1e12, 500)
SLOPE = 0.05
UNSOLVED = 0.05  # share of the trials that may say that they are not solved


def material(random):
    """A relaxation function whose loss tangent is at most 3: others are thrown away."""
    while True:
        count = int(random.integers(1, 16))
        moduli, times = 10 ** random.uniform(5.0, 8.0, count), 10 ** random.uniform(-9.0, 1.0, count)
        modulus_inf = float(moduli.sum()) / (10 ** random.uniform(0.05, 4.0) - 1.0)
        modulus = complex_modulus(DECADES, modulus_inf, moduli, times)
        if np.max(modulus.imag / modulus.real) <= 3.0:
            return modulus_inf, moduli, times


def drawn(random, points):
    """One scene, a speed [m/s], and a pressure [Pa] for the area that was drawn."""
    modulus_inf, moduli, times = material(random)
    pairs = zip(moduli.tolist(), times.tolist(), strict=True)
    rough = {"hurst": 0.8, "long_wavelength": 5e-4, "short_wavelength": 1.6e-2 / points, "rms_slope": SLOPE}
    branches = [{"modulus": g, "relaxation_time": tau} for g, tau in pairs]
    wanted = {
        "grid": {"points": points, "size": 1e-3},
        "surface": {"shape": "rough", **rough, "seed": int(random.integers(10000))},
        "material": {"model": "zener", "modulus_inf": modulus_inf, "branches": branches},
        "history": [{"pressure": 1.0}],
    }
    speed, area = 10 ** random.uniform(-5.0, 5.0), 10 ** random.uniform(-3.0, np.log10(0.99))
    stiffness = abs(complex_modulus(2 * np.pi / 2.5e-4 * speed, modulus_inf, moduli, times))
    # few spots: area = 2 p/(E* slope) with E* = 4 G; much contact: some multiple of the rms of full contact, 2 G slope
    pressure = float(stiffness) * SLOPE * (2.0 * area + 8.0 * max(area - 0.5, 0.0))
    sliding = SteadySliding(scene.set_up(job.load(wanted), Slab(MPI.COMM_SELF, points, points)))
    return sliding, speed, pressure


def trial(asked, counts: Counter[str], calls: list[float], number: int) -> Iterator[str]:
    sliding, speed, pressure = drawn(np.random.default_rng([asked.seed, number]), asked.points)
    try:
        point = sliding.solve((speed, 0.0), pressure)
    except RunError as error:
        counts["not solved, as they said"] += 1
        print(f"{number}: {error}", flush=True)
        return
    counts["solved"] += 1
    counts["needed the active set"] += point.sets > 0
    calls.append(point.operator_calls)
    found, allowed = certificate(sliding, speed, pressure), sliding.setup.job.numerics.tolerance
    if found > allowed * (1 + 1e-6):
        yield f"WRONG, certificate {found:.3g} instead of {allowed:g}"


def main() -> int:
    options = campaign.parser(__doc__, trials=200, points=(128, "along x and y"))
    options.set_defaults(seed=1)
    asked, counts, calls = options.parse_args(), Counter[str](), list[float]()
    wrong = campaign.go(asked, partial(trial, asked, counts, calls), counts)
    print("operator calls, median, 90 %, most:", *np.percentile(calls, [50, 90, 100]).round())
    return 1 if wrong or counts["not solved, as they said"] > UNSOLVED * asked.trials else 0


if __name__ == "__main__":
    sys.exit(main())

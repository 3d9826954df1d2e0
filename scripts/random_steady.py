"""Random bodies in steady sliding: each is solved or said not to be, and nothing wrong is returned.

    .venv/bin/python scripts/random_steady.py [--trials 200] [--points 128] [--seed 1] [--from 0]

1 to 15 relaxation times over ten decades, tan(delta) up to 3, G0/G_inf up to 1e4; velocities over ten decades; loads
for 0.1 % to 99 % of contact, by an elastic estimate. Each result is checked by an operator of
numpy's own: the complex symbol on the whole map. Exit code 1 if a wrong state was returned, or 5 % were not solved.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
from mpi4py import MPI

from parcontact import job, scene
from parcontact.errors import RunError
from parcontact.parallel.slab import Slab
from parcontact.physics.prony import complex_modulus
from parcontact.steady_sliding.sliding import SteadySliding

TEXT = """\
grid: {{points: {points}, size: 1.0e-3}}
surface:
  {{shape: rough, hurst: 0.8, long_wavelength: 5.0e-4, short_wavelength: {short!r}, rms_slope: 0.05, seed: {seed}}}
material: {{model: zener, modulus_inf: {modulus_inf!r}, branches: [{branches}]}}
history: [{{pressure: 1.0}}]
"""
DECADES = np.geomspace(1e-12, 1e12, 500)


def material(random):
    """A relaxation function whose loss tangent is at most 3: others are thrown away."""
    while True:
        count = int(random.integers(1, 16))
        moduli, times = 10 ** random.uniform(5.0, 8.0, count), 10 ** random.uniform(-9.0, 1.0, count)
        modulus_inf = float(moduli.sum()) / (10 ** random.uniform(0.05, 4.0) - 1.0)
        modulus = complex_modulus(DECADES, modulus_inf, moduli, times)
        if np.max(modulus.imag / modulus.real) <= 3.0:
            return modulus_inf, moduli, times


def trial(random, points):
    """One scene; a body, a speed [m/s], and a pressure [Pa] for the area that was drawn."""
    modulus_inf, moduli, times = material(random)
    pairs = zip(moduli.tolist(), times.tolist(), strict=True)
    text = TEXT.format(
        points=points,
        short=1.6e-2 / points,
        seed=random.integers(10000),
        modulus_inf=modulus_inf,
        branches=", ".join(f"{{modulus: {g!r}, relaxation_time: {tau!r}}}" for g, tau in pairs),
    )
    speed, area = 10 ** random.uniform(-5.0, 5.0), 10 ** random.uniform(-3.0, np.log10(0.99))
    slope = 0.05
    stiffness = abs(complex_modulus(2 * np.pi / 2.5e-4 * speed, modulus_inf, moduli, times))
    # few spots: area = 2 p/(E* slope) with E* = 4 G; much contact: some multiple of the rms of full contact, 2 G slope
    pressure = float(stiffness) * slope * (2.0 * area + 8.0 * max(area - 0.5, 0.0))
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory, "random.yaml")
        path.write_text(text)
        sliding = SteadySliding(scene.set_up(job.load(path), Slab(MPI.COMM_SELF, points, points)))
    return sliding, (modulus_inf, moduli, times), speed, pressure


def certificate(sliding, law, speed, pressure):
    """Worst of load error, gap under pressure, penetration and negative pressure, by numpy's transform."""
    base, n = sliding.setup, sliding.setup.slab.nx
    p = sliding.contact.p * base.units.pressure
    q = 2 * np.pi / 1.0e-3 * np.fft.fftfreq(n, 1 / n)
    modulus = complex_modulus(-q * speed, *law)
    modulus[n // 2] = modulus[n // 2].real
    length = np.hypot(q[None, :], q[:, None])
    symbol = np.divide(0.5, length * modulus[None, :], out=np.zeros((n, n), complex), where=length > 0)
    u = np.fft.ifft2(symbol * np.fft.fft2(p)).real
    h = sliding.levels[0].heights * base.units.height
    gap = u - h - np.sum(p * (u - h)) / p.sum()
    errors = np.sum(p * np.abs(gap)) / p.sum(), -gap.min()
    return max(abs(p.mean() / pressure - 1.0), *(e / np.ptp(h) for e in errors), -p.min() / p.mean())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--points", type=int, default=128)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--from", dest="first", type=int, default=0)
    given = parser.parse_args()
    solved, wrong, unsolved, sets, calls, areas = 0, 0, 0, 0, [], []
    for number in range(given.first, given.first + given.trials):
        sliding, law, speed, pressure = trial(np.random.default_rng([given.seed, number]), given.points)
        try:
            point = sliding.solve((speed, 0.0), pressure)
        except RunError as error:
            unsolved += 1
            print(f"{number}: {error}", flush=True)
            continue
        solved += 1
        sets += point.sets > 0
        calls.append(point.operator_calls)
        areas.append(point.measures.contact_area)
        found, asked = certificate(sliding, law, speed, pressure), sliding.setup.job.numerics.tolerance
        if found > asked * (1 + 1e-6):
            wrong += 1
            print(f"{number}: WRONG, certificate {found:.3g} instead of {asked:g}", flush=True)
    print(f"{solved} solved, {unsolved} said that they were not, {wrong} WRONG; {sets} needed the active set")
    print("operator calls, median, 90 %, most:", *np.percentile(calls, [50, 90, 100]).round())
    print("contact area, least, median, 90 %, most:", *np.percentile(areas, [0, 50, 90, 100]).round(4))
    return 1 if wrong or unsolved > 0.05 * given.trials else 0


if __name__ == "__main__":
    sys.exit(main())

"""What steady states cost, in applications of the operator on the finest grid.

    .venv/bin/python scripts/bench_steady.py [--points 1024]

A rough surface under the twelve-branch compound that comes with the program, certified to 1e-4: from a cold start at
three velocities, then along a curve of eight velocities per decade. Operator calls are counted, so a busy machine does
not matter. Exit code 1 if a limit is not kept. Some minutes on one core.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

from mpi4py import MPI

from parcontact import job, scene
from parcontact.parallel.slab import Slab
from parcontact.steady_sliding.sliding import SteadySliding

COLD, CURVE = 400, 150  # calls at most; the goals are 200 and 60
TEXT = """\
grid: {{points: {points}, size: 1.0e-3}}
surface: {{shape: rough, hurst: 0.9, long_wavelength: 2.5e-4, short_wavelength: {short!r}, rms_slope: 0.02, seed: 1}}
material: {{include: synthetic_tyre}}
history: [{{pressure: 1.0e5}}]
numerics: {{tolerance: 5.0e-3}}
"""


def states(points):
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory, "rough.yaml")
        path.write_text(TEXT.format(points=points, short=1.6e-2 / points))
        return SteadySliding(scene.frame(job.load(path), Slab(MPI.COMM_SELF, points, points)))


def solve(sliding, speed):
    began = time.perf_counter()
    point = sliding.solve((speed, 0.0), 1.0e5)
    contact, measures = sliding.contact, point.measures
    print(
        f"{speed:10.4g} {point.operator_calls:8.0f} {contact.projections:6d} {contact.sets:5d} "
        f"{measures.contact_area:8.4f} {measures.friction:9.6f} {time.perf_counter() - began:8.1f}",
        flush=True,
    )
    return point.operator_calls


def verdict(what, calls, limit):
    kept = max(calls) <= limit
    print(
        f"{what}: {min(calls):.0f} to {max(calls):.0f} calls (at most {limit}: {'yes' if kept else 'NO'})", flush=True
    )
    return kept


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=1024)
    points = parser.parse_args().points
    print("  velocity    calls  steps  sets     area  friction  seconds")
    cold = verdict("cold", [solve(states(points), speed) for speed in (0.01, 0.3, 10.0)], COLD)
    sliding = states(points)
    calls = [solve(sliding, 0.03 * 10 ** (k / 8)) for k in range(17)]
    print(f"first {calls[0]:.0f}, mean of the others {sum(calls[1:]) / len(calls[1:]):.0f}")
    return 0 if verdict("curve", calls[1:], CURVE) and cold else 1


if __name__ == "__main__":
    sys.exit(main())

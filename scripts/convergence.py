"""Errors of jobs/hertz.yaml on finer and finer grids, and the observed order of convergence.

    .venv/bin/python scripts/convergence.py [points ...]

Errors are relative to Hertz's solution: of the approach, of the peak pressure, and of the pressure at each point (mean
of the absolute errors over the mean pressure). The order is the slope of a straight line through the logarithms. At the
edge the pressure rises like a square root, which cells of length dx can follow in the mean to the order dx^1.5.
"""

import sys
from pathlib import Path

import numpy as np
from mpi4py import MPI

from parcontact import job, scene
from parcontact.march.loop import March
from parcontact.march.loop import run as run_march
from parcontact.parallel.slab import Slab
from parcontact.theory import hertz

JOB = Path(__file__).parents[1] / "jobs" / "hertz.yaml"
NAMES = ("approach", "peak pressure", "pressure")


def errors(points: int, path: Path = JOB) -> tuple[float, float, float]:
    """Relative errors of the approach, the peak pressure and the pressures on `points x points`."""
    sphere = job.load(path, [f"grid.points={points}", "numerics.tolerance=1e-8"])
    run = March(scene.build(sphere, Slab(MPI.COMM_SELF, *sphere.grid.points)))
    run_march(run, [])
    facts = (0.15, 1e-2, 2.75e6)  # force, radius, shear modulus
    x = sphere.grid.dx * np.arange(points) - sphere.grid.lx / 2
    exact = hertz.pressure(np.hypot(x[None, :], x[:, None]), *facts)
    wrong = np.abs(run.field("pressure") - exact)
    return (
        abs(run.row.measures.approach / float(hertz.approach(*facts)) - 1),
        abs(run.row.measures.max_pressure / float(hertz.peak_pressure(*facts)) - 1),
        float(wrong.sum() / exact.sum()),
    )


def order(points: list[int], wrong: list[float]) -> float:
    """The exponent n of errors that fall as dx^n."""
    return -float(np.polyfit(np.log(points), np.log(wrong), 1)[0])


def main(points: list[int]) -> None:
    table = [errors(count) for count in points]
    print(f"{'points':>8}" + "".join(f"{name:>16}" for name in NAMES))
    for count, row in zip(points, table, strict=True):
        print(f"{count:8}" + "".join(f"{wrong:16.2e}" for wrong in row))
    print(f"{'order':>8}" + "".join(f"{order(points, list(column)):16.2f}" for column in zip(*table, strict=True)))


if __name__ == "__main__":
    main([int(text) for text in sys.argv[1:]] or [64, 128, 256])

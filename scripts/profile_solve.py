"""Where the time of an elastic solve goes: a table of FFTs, the rest of the operators, and each fused loop.

    .venv/bin/python scripts/profile_solve.py [points]

A self-affine surface on 2048 x 2048 points with about 10 % contact, on one rank; the second of two solves from scratch
is shown, when everything is compiled and planned. FFTs are the time inside FFTW's plans.
"""

import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyfftw
from mpi4py import MPI

from parcontact import job as jobs
from parcontact import scene
from parcontact.march.loop import March
from parcontact.march.loop import run as run_march
from parcontact.parallel.slab import Slab
from parcontact.physics.convolution import Convolution
from parcontact.solve import kernels

JOB = """
grid: {{points: {points}, size: 1.0e-3}}
surface: {{shape: rough, hurst: 0.8, long_wavelength: 2.5e-4, short_wavelength: {short}, rms_slope: 0.02, seed: 1}}
material: {{model: elastic, poisson: 0.5, shear_modulus: 1.0e6}}
history: [{{pressure: 4.0e3}}]
"""
LOOPS = ("weigh", "certify", "residual", "products", "turn", "dot", "total", "scale")
seconds: dict[str, float] = defaultdict(float)
calls: dict[str, int] = defaultdict(int)


def timed(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    def wrapper(*args: Any) -> Any:
        start = time.perf_counter()
        result = function(*args)
        seconds[name] += time.perf_counter() - start
        calls[name] += 1
        return result

    return wrapper


class TimedPlan:
    """A plan of FFTW that keeps the time."""

    def __init__(self, *args: Any) -> None:
        self._plan = FFTW(*args)
        self.execute = timed("FFTs", self._plan.execute)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._plan, name)


FFTW = pyfftw.FFTW
pyfftw.FFTW = TimedPlan
Convolution.apply = timed("operators", Convolution.apply)  # type: ignore[method-assign]
for name in LOOPS:
    setattr(kernels, name, timed(name, getattr(kernels, name)))


def main(points: int) -> None:
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory, "job.yaml")
        path.write_text(JOB.format(points=points, short=1.6e-2 / points))
        job = jobs.load(path)
    for _ in range(2):
        run = March(scene.build(job, Slab(MPI.COMM_SELF, points, points)))
        seconds.clear()
        calls.clear()
        run_march(run, [])
    row = run.row
    seconds["rest of the operators"] = seconds.pop("operators") - seconds["FFTs"]
    calls["rest of the operators"] = calls.pop("operators")
    seconds["everything else"] = row.seconds - sum(seconds.values())
    area = row.measures.contact_area
    print(f"{points} x {points}, {area:.1%} contact, {row.iterations} iterations, {row.seconds:.2f} s")
    for name, spent in sorted(seconds.items(), key=lambda item: -item[1]):
        each = spent / max(calls[name], 1)
        print(f"{name:22} {spent:7.3f} s {spent / row.seconds:6.1%} {calls[name]:5d} x {1e3 * each:7.2f} ms")


if __name__ == "__main__":
    np.seterr(all="raise")
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2048)

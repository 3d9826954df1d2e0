"""Other programs on the same problems, each in its own environment, with the same measured error."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .table import Line

LIMIT = 420  # CPU time of one program for all tolerances [s]
HEADERS = "cmeel-eigen"  # package with the headers for aspher
SEARCH = """\
import json, resource, sys, time
import numpy as np
resource.setrlimit(resource.RLIMIT_CPU, ({limit}, {limit} + 5))
given = np.load(sys.argv[1])
heights, load = given["heights"], float(given["load"])
{attempt}
def tried(exponent):
    print(json.dumps({{"began": time.process_time()}}), flush=True)
    seconds, error, *flips = attempt(10.0**exponent)
    print(json.dumps({{"seconds": seconds, "error": error, "flips": flips}}), flush=True)
    return error <= given["wanted"]
exponent = float(given["exponent"])
if tried(exponent):
    while exponent < 0.0 and tried(exponent := exponent + 0.25):
        pass
else:
    while not tried(exponent := exponent - 0.25) and exponent > -14.0:
        pass
"""
COLD = """
def attempt(tolerance):
    began = time.process_time()
    p = solve(tolerance)
    seconds = time.process_time() - began
    reference = given["reference"]
    return seconds, float(np.linalg.norm(p - reference) / np.linalg.norm(reference))
"""
STICKY = """
def attempt(tolerance):
    began = time.process_time()
    p, gap = solve(tolerance)
    seconds = time.process_time() - began
    reference = given["reference"]
    flips = int(np.count_nonzero((gap == 0.0) != given["touching"]))
    return seconds, float(np.linalg.norm(p - reference) / np.linalg.norm(reference)), flips
"""
TAMAAS = """\
import tamaas as tm
tm.initialize(1)
tm.set_log_level(tm.LogLevel.error)
"""
TAMAAS_COLD = f"""{TAMAAS}
def solve(tolerance):
    model = tm.Model(tm.model_type.basic_2d, [1.0, 1.0], list(heights.shape))
    model.E, model.nu = 1.0, 0.0
    solver = tm.PolonskyKeerRey(model, heights, tolerance)
    solver.max_iter = 20000
    solver.solve(load)
    return model.traction
{COLD}"""
ASPHER_COLD = f"""\
import aspher
coarsest = len(heights)
while coarsest % 2 == 0 and coarsest > 64:
    coarsest //= 2
def solve(tolerance):
    gap = heights.max() - heights
    found = aspher.solve_nested(
        heights.shape[0], gap, load, coarsest=coarsest, tol=tolerance, coarse_tol=1e-3, backend="periodic"
    )
    return np.asarray(found.pressure).reshape(heights.shape)
{COLD}"""
ASPHER_DILUTE = ASPHER_COLD.replace('backend="periodic"', 'backend="h2", active_set=True')
TAMAAS_ADHESIVE = f"""{TAMAAS}
def solve(tolerance):
    model = tm.Model(tm.model_type.basic_2d, [1.0, 1.0], list(heights.shape))
    model.E, model.nu = 1.0, 0.0
    solver = tm.PolonskyKeerRey(model, heights, tolerance, tm.PolonskyKeerRey.gap, tm.PolonskyKeerRey.gap)
    law = tm.ExponentialAdhesionFunctional(heights)
    law.parameters = {{"rho": float(given["range"]), "surface_energy": float(given["work"])}}
    solver.addFunctionalTerm(law)
    solver.max_iter = 20000
    solver.solve(float(given["gap"]))
    return model.traction, model["gap"].reshape(heights.shape)
{STICKY}"""
ADHESION_COLD = f"""\
from Adhesion.Interactions import Exponential
from Adhesion.System import BoundedSmoothContactSystem
from ContactMechanics import PeriodicFFTElasticHalfSpace
from NuMPI.Optimization.CCGWithoutRestart import constrained_conjugate_gradients
from SurfaceTopography import Topography
gap, law = float(given["gap"]), Exponential(float(given["work"]), float(given["range"]))
body = PeriodicFFTElasticHalfSpace(heights.shape, young=1.0, physical_sizes=(1.0, 1.0))
system = BoundedSmoothContactSystem(body, law, Topography(heights, physical_sizes=(1.0, 1.0)))
def solve(tolerance):
    objective, start = system.primal_objective(0.0, gradient=True), np.full(heights.size, gap)
    own = {{"mean_val": gap, "gtol": tolerance * body.area_per_pt, "maxiter": 20000}}
    found = constrained_conjugate_gradients(objective, system.primal_hessian_product, start, **own)
    gaps = found.x.reshape(heights.shape)
    p = -body.evaluate_force(gaps + heights) / body.area_per_pt
    free = gaps > 0.0  # there p is -sigma: its mean is the load
    return p - (p + law.evaluate(gaps, gradient=True)[1])[free].mean(), gaps
{STICKY}"""
TAMAAS_SLIDING = f"""{TAMAAS}
def attempt(tolerance):
    model = tm.Model(tm.model_type.basic_2d, [1.0, 1.0], list(heights.shape))
    model.nu, model.E = 0.5, 3.0  # a shear modulus of 1: with another one its long-term modulus is wrong
    times = given["relaxation_times"].tolist()
    modulus, dt = float(given["modulus"]), 1.0 / len(heights)
    solver = tm.MaxwellViscoelastic(model, heights.copy(), tolerance, dt, [modulus] * len(times), times)
    solver.max_iter = 20000
    seconds, errors, exact = [], [], given["friction"]
    for step, friction in enumerate([np.nan, *exact]):
        solver.time_step = dt if step else 1e-12  # the load is there at once
        solver.surface[...] = np.roll(heights, step, axis=1).ravel()
        began = time.process_time()
        solver.solve(load)
        seconds.append(time.process_time() - began)
        p = model.traction
        found = -float((p * np.roll(given["slope"], step, axis=1)).mean() / p.mean())
        errors.append(abs(found / friction - 1.0))
    half = len(errors) // 2 + 1
    return float(np.median(seconds[half:])), max(errors[half:])
"""


class Task(NamedTuple):
    """Problem for a program. Its `code` defines `attempt(tolerance) -> (seconds, error)` with the data in `given`. With
    adhesion `attempt` also returns the number of points that touch in the result or in the reference only. The search
    begins at the tolerance `10**exponent`."""

    program: str
    code: str
    exponent: float


class Found(NamedTuple):
    """Result of a program: its time [s] with the loosest tolerance that reached the error, else with the longest try.
    `flips`: with adhesion, the number of points that touch in the result or in the reference only."""

    reached: bool
    seconds: float
    error: float
    flips: Sequence[float] = ()


def compare_peers(directory: Path, tasks: tuple[Task, ...], given: Mapping[str, Any], ours: float) -> Iterator[Line]:
    """Yield the CPU time of each program for the error `given["wanted"]`, and its ratio to `ours`; failed programs are
    left out."""
    for task in tasks:
        try:
            found = search(installed(directory, task.program), task, given)
        except (subprocess.CalledProcessError, OSError) as failure:
            said = getattr(failure, "stderr", None) or str(failure)
            print(f"{task.program} is left out: {said.strip().splitlines()[-1:]}")
            continue
        least = "" if found.reached else ", error not reached in time: more than"
        if found.reached:
            yield Line(f"{task.program}: error", found.error)
            yield from (Line(f"{task.program}: points on another branch", flips) for flips in found.flips)
        yield Line(f"{task.program}{least}", 1e3 * found.seconds, "ms")
        yield Line(f"{task.program} over ours{least}", found.seconds / ours)


def search(python: Path, task: Task, given: Mapping[str, Any]) -> Found:
    """Try smaller and smaller tolerances until the error is reached, or larger and larger ones as long as it is
    reached."""
    with tempfile.TemporaryDirectory() as where:
        file = Path(where, "given.npz")
        np.savez(file, exponent=task.exponent, **given)
        words = [str(python), "-c", SEARCH.format(attempt=task.code, limit=LIMIT), str(file)]
        done = subprocess.run(words, capture_output=True, text=True, env={**os.environ, "OMP_NUM_THREADS": "1"})
    if done.returncode not in (0, -signal.SIGXCPU):
        raise subprocess.CalledProcessError(done.returncode, task.program, done.stdout, done.stderr)
    return judge([json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")], given["wanted"])


def judge(said: list[dict[str, Any]], wanted: float) -> Found:
    """Return the cheapest try that reached the error; else the longest one, which may be unfinished."""
    if good := [one for one in said if one.get("error", np.inf) <= wanted]:
        cheapest = min(good, key=lambda one: one["seconds"])
        return Found(True, cheapest["seconds"], cheapest["error"], cheapest.get("flips", ()))
    tries = [one["seconds"] for one in said if "seconds" in one]
    began = [one["began"] for one in said if "began" in one]
    unfinished = [LIMIT - began[-1]] if len(began) > len(tries) else []
    return Found(False, max(tries + unfinished, default=LIMIT), np.inf)


def installed(directory: Path, program: str) -> Path:
    """Return the Python of a program's own environment, which is made if missing."""
    python, done = directory / program / "bin" / "python", directory / program / "installed"
    if not done.exists():
        _call(sys.executable, "-m", "venv", "--clear", directory / program)
        with tempfile.TemporaryDirectory() as where:
            more = _eigen(python, Path(where)) if program == "aspher" else {}
            _call(python, "-m", "pip", "install", "-q", program, more=more)
        done.touch()
    return python


def _eigen(python: Path, where: Path) -> dict[str, str]:
    """Return the environment variables for building aspher from source, with headers from another package."""
    _call(python, "-m", "pip", "download", "-q", "--no-deps", "-d", where, HEADERS)
    zipfile.ZipFile(next(where.glob("*.whl"))).extractall(where)
    include = where / "cmeel.prefix" / "include" / "eigen3"
    return {"CPATH": str(include), "CMAKE_ARGS": f"-DFETCHCONTENT_SOURCE_DIR_EIGEN3_SRC={include}"}


def _call(*words: object, more: Mapping[str, str] | None = None) -> None:
    command = list(map(str, words))
    subprocess.run(command, check=True, capture_output=True, text=True, env={**os.environ, **(more or {})})

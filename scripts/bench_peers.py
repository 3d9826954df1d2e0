"""Other programs on the work of scripts/bench.py, each in an environment of its own, to the same measured error."""

import json
import os
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from bench_lines import Line, Map

LIMIT = 420.0  # seconds, all tolerances of one program together; then it took more than the last try
HEADERS = "cmeel-eigen"  # has the headers that aspher is compiled with
TAMAAS = """\
import tamaas as tm
tm.initialize(1)
tm.set_log_level(tm.LogLevel.error)
def solve(tolerance):
    model = tm.Model(tm.model_type.basic_2d, [1.0, 1.0], list(heights.shape))
    model.E, model.nu = 1.0, 0.0
    solver = tm.PolonskyKeerRey(model, heights, tolerance)
    solver.max_iter = 20000
    solver.solve(load)
    return model.traction
"""
ASPHER = """\
import aspher
def solve(tolerance):
    gap = heights.max() - heights
    found = aspher.solve_nested(
        heights.shape[0], gap, load, coarsest=64, tol=tolerance, coarse_tol=1e-3, backend="periodic"
    )
    return np.asarray(found.pressure).reshape(heights.shape)
"""
SEARCH = """\
import json, sys, time
import numpy as np
heights, reference = np.load(sys.argv[1]), np.load(sys.argv[2])
load, wanted = float(sys.argv[3]), float(sys.argv[4])
{solve}
for quarter_decades in range(18, 60, 2):
    began = time.process_time()
    p = solve(10.0 ** (-0.25 * quarter_decades))
    seconds = time.process_time() - began
    error = float(np.linalg.norm(p - reference) / np.linalg.norm(reference))
    print(json.dumps({{"seconds": seconds, "error": error}}), flush=True)
    if error <= wanted:
        break
"""


def cold_peers(directory: Path, heights: Map, reference: Map, load: float, error: float, ours: float) -> Iterator[Line]:
    """CPU seconds of each to the pressure error, over `ours`; a program that cannot be installed is left out."""
    for name, install, code in (("tamaas", _install_tamaas, TAMAAS), ("aspher", _install_aspher, ASPHER)):
        python = directory / name / "bin" / "python"
        try:
            if not python.exists():
                subprocess.run([sys.executable, "-m", "venv", directory / name], check=True)
                install(python)
            tries = _search(python, code, heights, reference, load, error)
        except subprocess.CalledProcessError as failure:
            print(f"{name} is left out: {failure}")
            continue
        yield from _told(name, tries, error, ours)


def _told(name: str, tries: list[dict[str, float]], error: float, ours: float) -> Iterator[Line]:
    if not tries:
        yield Line("solve", f"{name} over double: more than", LIMIT / ours, "")
        return
    last = tries[-1]
    reached = "" if last["error"] <= error else ", not reached in time"
    yield Line("solve", f"{name}: pressure error{reached}", last["error"], "")
    yield Line("solve", name, 1e3 * last["seconds"], "ms")
    yield Line("solve", f"{name} over double{': more than' if reached else ''}", last["seconds"] / ours, "")


def _search(python: Path, code: str, heights: Map, reference: Map, load: float, error: float) -> list[dict[str, float]]:
    """What it took at smaller and smaller tolerances, until the error is reached or the time is over."""
    with tempfile.TemporaryDirectory() as where:
        files = [Path(where, "heights.npy"), Path(where, "reference.npy")]
        for file, field in zip(files, (heights, reference), strict=True):
            np.save(file, field)
        words = list(map(str, (python, "-c", SEARCH.format(solve=code), *files, load, error)))
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        try:
            done = subprocess.run(
                words, check=True, capture_output=True, text=True, env=environment, timeout=LIMIT
            ).stdout
        except subprocess.TimeoutExpired as late:
            done = late.stdout.decode() if isinstance(late.stdout, bytes) else late.stdout or ""
    return [json.loads(line) for line in done.splitlines() if line.startswith("{")]


def _install_tamaas(python: Path) -> None:
    subprocess.run([python, "-m", "pip", "install", "-q", "tamaas"], check=True)


def _install_aspher(python: Path) -> None:
    """From source, with headers that another package has."""
    with tempfile.TemporaryDirectory() as where:
        subprocess.run([python, "-m", "pip", "download", "-q", "--no-deps", "-d", where, HEADERS], check=True)
        zipfile.ZipFile(next(Path(where).glob("*.whl"))).extractall(where)
        include = Path(where, "cmeel.prefix", "include", "eigen3")
        environment = {**os.environ, "CPATH": str(include)}
        subprocess.run([python, "-m", "pip", "install", "-q", "aspher"], check=True, env=environment)

"""What the program costs, in counts and in ratios measured within one run.

    .venv/bin/python scripts/bench.py [PART...] [--points 512] [--rounds 15] [--json FILE] [--peers DIRECTORY]

    fft      a forward and a backward transform, over FFTW alone
    solve    a cold elastic solve at 11 % contact to a pressure error of 1e-7, in double and mixed precision, and peers'
    slide    sliding over a rough surface with twelve branches, by one cell a step
    steady   steady sliding from a cold start, and along a curve of eight velocities per decade
    start    the command line, over an interpreter that only imports numpy
    scale    a transform and a cold solve on two ranks, over one
    memory   bytes of a run as they are planned and held, and in maps

Operator calls are those on the finest grid, coarser ones counted by their share of its points. Times of one process are
CPU times, those of `scale` and `start` wall times. What is compared takes turns, round by round; shown are the median,
and of the ratios of each round the median and the quartiles. The pressure error is the relative L2 distance from a
solution to 1e-11, for every program alike. `--peers DIRECTORY` installs tamaas there, in an environment of its own.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from parcontact import job as jobs
from parcontact import scene
from parcontact.march.loop import run
from parcontact.march.step import March
from parcontact.parallel.fft import FFT
from parcontact.parallel.fftw import pyfftw
from parcontact.parallel.slab import Slab
from parcontact.physics.halfspace import HalfSpace
from parcontact.physics.roughness import Roughness
from parcontact.plan import memory
from parcontact.record.row import Row
from parcontact.solve import cold
from parcontact.solve.contact import ContactSolver, MeanPressure
from parcontact.steady_sliding.sliding import SteadySliding

Map = NDArray[np.float64]
LOAD = 0.05  # mean pressure over E*, for 11 % of contact at a slope of 1
MODULUS = 4.0  # E* of shear modulus 1 and Poisson's ratio 1/2
ERROR = 1e-7  # of pressures
TOLERANCES = [10.0**-exponent for exponent in np.arange(3.0, 10.5, 0.25)]
BUSY = 0.5  # cores at work before the benchmark, above which it warns
SLIDING = """\
grid: {{points: {points}, size: 1.0e-3}}
surface: {{shape: rough, hurst: 0.9, long_wavelength: 2.5e-4, short_wavelength: {short!r}, rms_slope: 0.02, seed: 1}}
material: {{include: synthetic_tyre}}
history: [{{pressure: 1.0e5, velocity: 0.3, distance: {distance!r}, cells_per_step: 1}}]
numerics: {{tolerance: {tolerance!r}}}
"""
PEER = """\
import json, sys, time
import numpy as np
import tamaas as tm
heights, reference = np.load(sys.argv[1]), np.load(sys.argv[2])
tm.initialize(1)
tm.set_log_level(tm.LogLevel.error)
for half_decades in range(6, 30):
    model = tm.Model(tm.model_type.basic_2d, [1.0, 1.0], list(heights.shape))
    model.E, model.nu = 1.0, 0.0
    solver = tm.PolonskyKeerRey(model, heights, 10.0 ** (-0.5 * half_decades))
    solver.max_iter = 20000
    began = time.process_time()
    solver.solve(float(sys.argv[3]))
    seconds = time.process_time() - began
    error = float(np.linalg.norm(model.traction - reference) / np.linalg.norm(reference))
    if error <= float(sys.argv[4]):
        break
print(json.dumps({"seconds": seconds, "error": error}))
"""


@dataclass(frozen=True)
class Line:
    """One measured number; a ratio has the quartiles of its rounds."""

    part: str
    what: str
    value: float
    unit: str
    low: float | None = None
    high: float | None = None


def interleave(
    ways: Mapping[str, Callable[[], object]], rounds: int, clock: Callable[[], float] = time.process_time
) -> dict[str, list[float]]:
    """Seconds of each way in every round, in turns; all are done once before."""
    times: dict[str, list[float]] = {name: [] for name in ways}
    for count in range(rounds + 1):
        for name, way in ways.items():
            began = clock()
            way()
            if count:
                times[name].append(clock() - began)
    return times


def compare(part: str, times: dict[str, list[float]], base: str) -> Iterator[Line]:
    """The median of each way, and the ratio of the others to the base."""
    for name, seconds in times.items():
        yield Line(part, name, 1e3 * statistics.median(seconds), "ms")
        if name != base:
            ratios = [a / b for a, b in zip(seconds, times[base], strict=True)]
            low, middle, high = np.quantile(ratios, (0.25, 0.5, 0.75)).tolist()
            yield Line(part, f"{name} over {base}", middle, "", low, high)


# -- the parts ---------------------------------------------------------------------------------------------------------


def fft(points: int, rounds: int, _: argparse.Namespace) -> Iterator[Line]:
    heights, out = (pyfftw.zeros_aligned((points, points), "float64", n=64) for _ in range(2))
    waves = pyfftw.zeros_aligned((points, points // 2 + 1), "complex128", n=64)
    forward = pyfftw.FFTW(heights, waves, (0, 1), "FFTW_FORWARD", ("FFTW_MEASURE",))
    backward = pyfftw.FFTW(waves, out, (0, 1), "FFTW_BACKWARD", ("FFTW_MEASURE", "FFTW_DESTROY_INPUT"))
    heights[...] = np.random.default_rng(1).random(heights.shape)
    bare = {"FFTW alone": lambda: (forward.execute(), backward.execute())}
    ours = {name: pair(Slab(MPI.COMM_SELF, points, points), name) for name in ("float64", "float32")}
    yield from compare("fft", interleave({**bare, **ours}, rounds), "FFTW alone")


def pair(slab: Slab, dtype: str) -> Callable[[], object]:
    """A forward and a backward transform of a random map."""
    transform, heights, out = FFT(slab, dtype=dtype), slab.empty(dtype), slab.zeros(dtype)
    heights[...] = np.random.default_rng(1).random(slab.shape)
    return lambda: transform.backward(transform.forward(heights), out)


class Cold:
    """Cold elastic solves of one surface: Hurst 0.8, from a quarter of the box to eight cells, rms slope 1."""

    def __init__(self, points: int, comm: MPI.Intracomm = MPI.COMM_SELF) -> None:
        self.slab = Slab(comm, points, points)
        fft = FFT(self.slab)
        waves = Roughness(0.8, 0.25, 0.25, 8 / points, 1, rms_slope=1.0).spectrum(fft, (1.0, 1.0))
        self.heights: Map = np.asarray(fft.backward(waves, self.slab.zeros()), dtype=np.float64)
        low, high = self.slab.reduce((), [-float(self.heights.min()), float(self.heights.max())])
        self.height, self.fft = low + high, fft

    def solver(self, tolerance: float, single: bool = False, slab: Slab | None = None) -> ContactSolver:
        """With K in single precision, or for a coarser grid."""
        fft = self.fft if slab is None else FFT(slab, measured=False)
        other = FFT(fft.slab, dtype=np.float32, measured=fft.measured) if single else fft
        half = HalfSpace((1.0, 1.0))
        return ContactSolver(fft.slab, half.operator(fft), half.inverse(other), self.height, tolerance, 500)

    def solve(self, solver: ContactSolver) -> Map:
        start, load = np.zeros_like(self.heights), MeanPressure(LOAD * MODULUS)
        cold.prepare(solver, self.heights, load, start, lambda slab, tolerance: self.solver(tolerance, slab=slab))
        return np.asarray(solver.solve(self.heights, load, start).p)


def solve(points: int, rounds: int, asked: argparse.Namespace) -> Iterator[Line]:
    surface = Cold(points)
    reference = surface.solve(surface.solver(1e-11))
    ways: dict[str, Callable[[], object]] = {}
    for name, single in (("double", False), ("mixed", True)):
        for tolerance in TOLERANCES:
            solver = surface.solver(tolerance, single)
            calls = surface.slab.tally["operator"]
            error = distance(surface.solve(solver), reference)
            if error <= ERROR:
                break
        yield Line("solve", f"{name}: operator calls", surface.slab.tally["operator"] - calls, "")
        yield Line("solve", f"{name}: pressure error", error, "")
        ways[name] = partial(surface.solve, solver)
    times = interleave(ways, rounds)
    yield from compare("solve", times, "double")
    if asked.peers is not None:
        found = peer(asked.peers, surface.heights, reference / MODULUS)
        yield Line("solve", "tamaas: pressure error", found["error"], "")
        yield Line("solve", "tamaas", 1e3 * found["seconds"], "ms")
        yield Line("solve", "tamaas over double", found["seconds"] / statistics.median(times["double"]), "")


def distance(p: Map, reference: Map) -> float:
    return float(np.linalg.norm(p - reference) / np.linalg.norm(reference))


def peer(directory: Path, heights: Map, reference: Map) -> dict[str, float]:
    """Seconds and error of tamaas, which is installed where it is not yet."""
    python = directory / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", directory], check=True)
        subprocess.run([python, "-m", "pip", "install", "-q", "tamaas"], check=True)
    with tempfile.TemporaryDirectory() as where:
        files = [Path(where, "heights.npy"), Path(where, "reference.npy")]
        for file, field in zip(files, (heights, reference), strict=True):
            np.save(file, field)
        words = list(map(str, (python, "-c", PEER, *files, LOAD, ERROR)))
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        done = subprocess.run(words, check=True, capture_output=True, text=True, env=environment)
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def sliding_job(points: int, steps: int, tolerance: float = 5e-3) -> jobs.Job:
    with tempfile.TemporaryDirectory() as directory:
        path, distance = Path(directory, "job.yaml"), steps * 1e-3 / points
        chosen = {"points": points, "short": min(1.6e-2 / points, 1e-4), "distance": distance, "tolerance": tolerance}
        path.write_text(SLIDING.format(**chosen))
        return jobs.load(path)


def slide(points: int, rounds: int, _: argparse.Namespace) -> Iterator[Line]:
    """Means over the second half of the steps; friction beside that of a run to a hundredth of the tolerance."""
    march, seen, clock = slid(sliding_job(points, 4 * rounds))
    exact = slid(sliding_job(points, 4 * rounds, 5e-5))[1]
    half = len(seen) // 2
    friction, wanted = (np.array([row.measures.friction for row in rows[half:]]) for rows in (seen, exact))
    yield Line("slide", "operator calls per step", statistics.fmean(row.operator_calls for row in seen[half:]), "")
    yield Line("slide", "iterations per step", statistics.fmean(row.iterations for row in seen[half:]), "")
    yield Line("slide", "largest error of friction", float(np.abs(friction / wanted - 1.0).max()), "")
    step = statistics.median(np.diff(clock)[half:].tolist())
    bare = statistics.median(interleave({"pair": pair(march.scene.slab, "float64")}, 10)["pair"])
    yield Line("slide", "a step", 1e3 * step, "ms")
    yield Line("slide", "a step over a transform and its inverse", step / bare, "")


def slid(planned: jobs.Job) -> tuple[March, list[Row], list[float]]:
    """A run, its rows, and when each was done."""
    march = March(scene.build(planned, Slab(MPI.COMM_SELF, *planned.grid.points)))
    seen, clock = list[Row](), list[float]()

    def note(now: March) -> None:
        seen.append(now.row)
        clock.append(time.process_time())

    run(march, [note])
    return march, seen, clock


def steady(points: int, rounds: int, _: argparse.Namespace) -> Iterator[Line]:
    base = scene.frame(sliding_job(points, 1), Slab(MPI.COMM_SELF, points, points))
    for speed in (0.01, 0.3, 10.0):
        calls = SteadySliding(base).solve((speed, 0.0), 1e5).operator_calls
        yield Line("steady", f"cold at {speed:g} m/s: operator calls", calls, "")
    sliding = SteadySliding(base)
    curve = [sliding.solve((0.03 * 10 ** (k / 8), 0.0), 1e5).operator_calls for k in range(min(17, rounds + 2))]
    yield Line("steady", "curve: operator calls per further point", statistics.fmean(curve[1:]), "")
    yield Line("steady", "curve: the most of them", max(curve[1:]), "")


def start(_: int, rounds: int, __: argparse.Namespace) -> Iterator[Line]:
    program = Path(sys.executable).with_name("parcontact")
    ways = {
        "import numpy": [sys.executable, "-c", "import numpy"],
        "parcontact --help": [program, "--help"],
        "parcontact --version": [program, "--version"],
    }
    calls = {
        name: lambda words=words: subprocess.run(words, check=True, capture_output=True) for name, words in ways.items()
    }
    yield from compare("start", interleave(calls, rounds, time.perf_counter), "import numpy")


def held(points: int, _: int, __: argparse.Namespace) -> Iterator[Line]:
    planned = sliding_job(points, 2)
    slab = Slab(MPI.COMM_SELF, points, points)
    march = March(scene.build(planned, slab))
    begun = slab.tally["map bytes"]
    run(march, [])
    yield Line("memory", "planned", memory.total(planned) / 1e6, "MB")
    yield Line("memory", "held", begun / 1e6, "MB")
    yield Line("memory", "held at most, the first solve included", slab.tally["map bytes at most"] / 1e6, "MB")
    yield Line("memory", "held at most, in maps", slab.tally["map bytes at most"] / (8 * points * points), "")


def scale(points: int, rounds: int, asked: argparse.Namespace) -> Iterator[Line]:
    """Starts itself on two ranks."""
    words = [Path(sys.executable).with_name("mpirun"), "-n", "2", sys.executable, __file__, "--inside"]
    words += ["--points", str(points), "--rounds", str(rounds)]
    outside = {name: value for name, value in os.environ.items() if not name.startswith(("OMPI_", "PMIX_", "PRTE_"))}
    done = subprocess.run(list(map(str, words)), check=True, capture_output=True, text=True, env=outside)
    for line in json.loads(done.stdout.splitlines()[-1]):
        yield Line(**line)


def scale_inside(points: int, rounds: int) -> None:
    """On two ranks of the same node: rank 0 alone, then both; the other waits without keeping a core busy."""
    world = MPI.COMM_WORLD
    lines = list[Line]()
    for what, make in (
        ("transform", lambda comm: pair(Slab(comm, points, points), "float64")),
        ("solve", cold_solve(points)),
    ):
        alone = make(MPI.COMM_SELF) if world.rank == 0 else None
        together = make(world)
        times: dict[str, list[float]] = {f"{what} on 1 rank": [], f"{what} on 2 ranks": []}
        for _ in range(rounds):
            if alone is not None:
                times[f"{what} on 1 rank"].append(seconds(alone))
            arrival = world.Ibarrier()
            while not arrival.Test():
                time.sleep(1e-3)
            times[f"{what} on 2 ranks"].append(seconds(together))
        if world.rank == 0:
            lines += compare("scale", times, f"{what} on 1 rank")
    if world.rank == 0:
        print(json.dumps([asdict(line) for line in lines]))


def cold_solve(points: int) -> Callable[[MPI.Intracomm], Callable[[], object]]:
    def make(comm: MPI.Intracomm) -> Callable[[], object]:
        surface = Cold(points, comm)
        solver = surface.solver(1e-6)
        return lambda: surface.solve(solver)

    return make


def seconds(way: Callable[[], object]) -> float:
    began = time.perf_counter()
    way()
    return time.perf_counter() - began


# -- the command -------------------------------------------------------------------------------------------------------

PARTS = {"fft": fft, "solve": solve, "slide": slide, "steady": steady, "start": start, "scale": scale, "memory": held}


def show(line: Line) -> str:
    spread = "" if line.low is None else f"   ({line.low:.3g} to {line.high:.3g})"
    return f"{line.part:<8}{line.what:<48}{line.value:>12.4g} {line.unit}{spread}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; all of them by default")
    parser.add_argument("--points", type=int, default=512, help="along x and y")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--json", type=Path, help="write the lines into this file, too")
    parser.add_argument("--peers", type=Path, help="compare with tamaas, installed into this directory")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.inside:
        scale_inside(asked.points, asked.rounds)
        return 0
    if unknown := set(asked.parts) - set(PARTS):
        parser.error(f"there is no part {', '.join(sorted(unknown))}; there are {', '.join(PARTS)}")
    if os.getloadavg()[0] > BUSY:
        print(f"WARNING: others keep {os.getloadavg()[0]:.1f} of {os.cpu_count()} cores busy: trust counts, not times")
    lines = list[Line]()
    for part in asked.parts or PARTS:
        for line in PARTS[part](asked.points, asked.rounds, asked):
            print(show(line), flush=True)
            lines.append(line)
    if asked.json is not None:
        asked.json.write_text(json.dumps([asdict(line) for line in lines], indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

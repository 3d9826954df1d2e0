"""Parts `traffic` and `scale` of scripts/bench.py: what passes through memory, and one rank beside two."""

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import outside
from bench_cold import Cold, pair
from bench_lines import Line
from bench_meter import OTHER, TRANSFORM, Meter
from bench_sliding import sliding_job
from mpi4py import MPI

from parcontact import scene
from parcontact.compiled import loop
from parcontact.march.loop import March
from parcontact.parallel.fftw import pyfftw
from parcontact.parallel.slab import Slab

WARM = 12  # first steps of a slide, which are not like the others
ENDLESS = 1_000_000  # steps: more than anybody asks for; the surface comes round again and again
SMALL = 0.05  # maps an iteration: loops that pass over less are told together
MAPS = 12  # that the bandwidth is measured over: about as many as a solve has
TOLERANCE = 1e-6  # of cold solves
WORLD = MPI.COMM_WORLD


def on_two_ranks(parts: list[str], points: int, rounds: int) -> Iterator[Line]:
    """Lines of parts that this script, started on two ranks, measures there. Raises RuntimeError if it cannot."""
    words = [Path(sys.executable).with_name("mpirun"), "-n", "2", sys.executable, sys.argv[0], *parts, "--inside"]
    words += ["--points", str(points), "--rounds", str(rounds)]
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, env=outside.environment())
    if done.returncode:
        raise RuntimeError(f"{', '.join(parts)} on two ranks: {done.stderr.strip()}")
    yield from (Line(**line) for line in json.loads(done.stdout.splitlines()[-1]))


def show_inside(lines: Iterator[Line]) -> None:
    """On root, for `on_two_ranks`; collective."""
    seen = list(lines)
    if WORLD.rank == 0:
        print(json.dumps([asdict(line) for line in seen]))


# -- traffic -----------------------------------------------------------------------------------------------------------


def traffic(points: int, rounds: int, _: argparse.Namespace) -> Iterator[Line]:
    """Counts, on one rank: maps of 8 bytes a point that pass through memory, in each loop."""
    with Meter().in_place() as meter:
        surface = Cold(points)
        solver = surface.solver(TOLERANCE)
        start = surface.start(solver)
        meter.clear()
        iterations = surface.go_on(solver, start).iterations
        yield from _passes("a cold iteration", meter, iterations, points)
        slide = Slide(points, MPI.COMM_SELF)
        for _ in range(WARM):
            slide.step()
        meter.clear()
        for _ in range(rounds):
            slide.step()
        yield from _passes("a sliding step", meter, rounds, points)


def _passes(what: str, meter: Meter, count: int, points: int) -> Iterator[Line]:
    maps = {name: passed / (8 * points**2 * count) for name, passed in meter.bytes.items()}
    large = {name: passed for name, passed in maps.items() if passed >= SMALL}
    for name, passed in sorted(large.items(), key=lambda item: -item[1]):
        yield Line("traffic", f"{what}: {name}", passed, "maps")
    yield Line("traffic", f"{what}: smaller loops", sum(maps.values()) - sum(large.values()), "maps")
    yield Line("traffic", f"{what}: in all", sum(maps.values()), "maps")
    yield Line("traffic", f"{what}: flops of transforms", meter.flops / (points**2 * count), "a point")


class Slide:
    """Sliding with twelve branches, by one cell a step."""

    def __init__(self, points: int, comm: MPI.Intracomm) -> None:
        self.march = March(scene.build(sliding_job(points, ENDLESS), Slab(comm, points, points)))
        self._steps = self.march.steps()

    def step(self) -> None:
        """Collective."""
        self.march.advance(next(self._steps))


# -- scale -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Run:
    """What a call took [s], its parts, and what it passed through memory [bytes] by part, on all ranks together."""

    whole: float
    parts: dict[str, float]
    transformed: float
    looped: float
    sent: float


def scale(points: int, rounds: int) -> Iterator[Line]:
    """On two ranks of the same node: rank 0 alone, then both; the other waits and keeps no core busy; collective."""
    rates = bandwidth(points, rounds)
    for ranks, rate in rates.items():
        yield Line("scale", f"memory, read and written by {ranks} of 2 ranks", rate / 1e9, "GB/s")
    with Meter().in_place() as meter:
        for what, alone, together, work in (
            ("transform", pair_on, pair_on, 1.0),
            ("cold solve", cold_solve, cold_solve, 1.0),
            ("cold solve, each rank as many points", cold_solve, twice_the_points, 2.0),
            ("sliding step", sliding_step, sliding_step, 1.0),
        ):
            one, two = in_turns(alone, together, points, rounds, meter)
            if WORLD.rank == 0:
                yield from told(what, one, two, work, rates[2])


def told(what: str, one: list[Run], two: list[Run], work: float, rate: float) -> Iterator[Line]:
    """Times on one rank and, with `work` times as much of it, on two, by part; how many times more is done in a second,
    and what memory at this rate [byte/s] lets."""
    for name, runs in ((f"{what} on 1 rank", one), (f"{what} on 2 ranks", two)):
        yield Line("scale", name, 1e3 * float(np.median([run.whole for run in runs])), "ms")
        for part in runs[0].parts:
            yield Line("scale", f"{name}: {part}", 1e3 * float(np.median([run.parts[part] for run in runs])), "ms")
    yield from _rates(f"{what} on 1 rank", one)
    pairs = list(zip(one, two, strict=True))
    low, middle, high = np.quantile([work * a.whole / b.whole for a, b in pairs], (0.25, 0.5, 0.75)).tolist()
    yield Line("scale", f"{what}: speed of 2 ranks over 1", middle, "", low, high)
    limit = float(np.median([best_ratio(a, b, work, rate) for a, b in pairs]))
    yield Line("scale", f"{what}: by the roofline at most", limit, "")
    yield Line("scale", f"{what}: share of that", middle / limit, "")


def _rates(name: str, runs: list[Run]) -> Iterator[Line]:
    """How fast parts pass their bytes through memory, to see beside the rate of memory."""
    transforms = float(np.median([run.transformed / run.parts[TRANSFORM] for run in runs]))
    yield Line("scale", f"{name}: bytes of transforms over their time", transforms / 1e9, "GB/s")
    if any(run.looped for run in runs):
        loops = float(np.median([run.looped / run.parts[OTHER] for run in runs]))
        yield Line("scale", f"{name}: bytes of loops over the time of everything else", loops / 1e9, "GB/s")


def best_ratio(one: Run, two: Run, work: float, rate: float) -> float:
    """The speed of two ranks over that of one, at most: no part of the work takes less than half of its time on one,
    nor than its bytes at the rate of memory; what is sent is read and written once more."""
    bounds = [(one.parts[TRANSFORM], two.transformed), (one.whole - one.parts[TRANSFORM], two.looped)]
    least = sum(max(0.5 * work * seconds, passed / rate) for seconds, passed in bounds) + 2.0 * two.sent / rate
    return work * one.whole / least


Make = Callable[[int, MPI.Intracomm], tuple[Slab, Callable[[], object]]]


def in_turns(alone: Make, together: Make, points: int, rounds: int, meter: Meter) -> tuple[list[Run], list[Run]]:
    """Runs on rank 0 alone and on both; collective."""
    single = alone(points, MPI.COMM_SELF) if WORLD.rank == 0 else None
    double = together(points, WORLD)
    one, two = list[Run](), list[Run]()
    for _ in range(rounds):
        if single is not None:
            one.append(metered(*single, meter))
        arrival = WORLD.Ibarrier()
        while not arrival.Test():
            time.sleep(1e-3)
        two.append(metered(*double, meter))
    return one, two


def metered(slab: Slab, call: Callable[[], object], meter: Meter) -> Run:
    """A call with its parts; collective. Seconds are those of this rank, bytes those of all."""
    meter.clear()
    before = slab.tally["bytes sent"]
    began = time.perf_counter()
    call()
    whole = time.perf_counter() - began
    transformed = meter.bytes[TRANSFORM]
    passed = slab.comm.allreduce(
        np.array([transformed, sum(meter.bytes.values()) - transformed, slab.tally["bytes sent"] - before])
    )
    return Run(whole, meter.parts(whole), *map(float, passed))


def pair_on(points: int, comm: MPI.Intracomm) -> tuple[Slab, Callable[[], object]]:
    slab = Slab(comm, points, points)
    return slab, pair(slab, "float64")


def cold_solve(points: int, comm: MPI.Intracomm) -> tuple[Slab, Callable[[], object]]:
    return _cold_solve(Cold(points, comm))


def twice_the_points(points: int, comm: MPI.Intracomm) -> tuple[Slab, Callable[[], object]]:
    """A box twice as long."""
    return _cold_solve(Cold(points, comm, boxes=2))


def _cold_solve(surface: Cold) -> tuple[Slab, Callable[[], object]]:
    solver = surface.solver(TOLERANCE)
    surface.solve(solver)
    return surface.slab, lambda: surface.solve(solver)


def sliding_step(points: int, comm: MPI.Intracomm) -> tuple[Slab, Callable[[], object]]:
    slide = Slide(points, comm)
    for _ in range(WARM):
        slide.step()
    return slide.march.scene.slab, slide.step


# -- the machine -------------------------------------------------------------------------------------------------------


@loop
def triad(a, b, c):
    """`a = b + 3 c`."""
    for j in range(a.shape[0]):
        for i in range(a.shape[1]):
            a[j, i] = b[j, i] + 3.0 * c[j, i]


def bandwidth(points: int, rounds: int) -> dict[int, float]:
    """Bytes per second that rank 0 alone, and both ranks together, read and write at the best, in maps of so many
    points; collective."""
    rates = {}
    for ranks in (1, 2):
        WORLD.Barrier()
        best = max(_rate(points // ranks, points, ranks) for _ in range(rounds)) if WORLD.rank < ranks else 0.0
        rates[ranks] = float(WORLD.allreduce(best))
    return rates


def _rate(rows: int, points: int, ranks: int) -> float:
    maps = [pyfftw.zeros_aligned((rows, points), "float64", n=64) for _ in range(MAPS)]
    triad(*maps[:3])
    began = time.perf_counter()
    for k in range(MAPS):
        triad(maps[k], maps[k - 1], maps[k - 2])
    return 3 * maps[0].nbytes * MAPS / (time.perf_counter() - began)

"""Parts `traffic`, `scale` and `march`: what passes through memory, one rank beside two, and a run on two ranks."""

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np
from mpi4py import MPI
from runs import ROOT, begun

from parcontact.compiled import loop
from parcontact.parallel.fft import transform_name
from parcontact.parallel.fftw import pyfftw
from parcontact.parallel.slab import Slab

from .meter import OTHER, TRANSFORM, Meter
from .table import Line, quartiles
from .work import Cold, Slide, pair

SMALL = 0.05  # maps an iteration: loops that pass over less are told together
MAPS = 12  # that the bandwidth is measured over: about as many as a solve has
TOLERANCE = 1e-6  # of cold solves
JOB = ROOT / "jobs" / "paper" / "fig08_velocity_step.yaml"  # of `march`
CELLS = 16  # of its shortest wave
LONGEST = 1.25e-4  # [m], half of its longest wave: for small grids
WORLD = MPI.COMM_WORLD


def traffic(points: int, rounds: int, _: argparse.Namespace) -> Iterator[Line]:
    """Counts, on one rank: maps of 8 bytes a point that pass through memory, in each loop."""
    with Meter().in_place() as meter:
        surface = Cold(points)
        solver = surface.solver(TOLERANCE)
        start = surface.start(solver)
        meter.clear()
        iterations = surface.go_on(solver, start).iterations
        yield from _passes("a cold iteration", meter, iterations, points)
        slide = Slide(points)
        slide.warm_up()
        meter.clear()
        for _ in range(rounds):
            slide.step()
        yield from _passes("a sliding step", meter, rounds, points)


def _passes(what: str, meter: Meter, count: int, points: int) -> Iterator[Line]:
    maps = {name: passed / (8 * points**2 * count) for name, passed in meter.bytes.items()}
    large = {name: passed for name, passed in maps.items() if passed >= SMALL}
    for name, passed in sorted(large.items(), key=lambda item: -item[1]):
        yield Line(f"{what}: {name}", passed, "maps")
    yield Line(f"{what}: smaller loops", sum(maps.values()) - sum(large.values()), "maps")
    yield Line(f"{what}: in all", sum(maps.values()), "maps")
    yield Line(f"{what}: flops of transforms", meter.flops / (points**2 * count), "a point")


# -- one rank beside two -----------------------------------------------------------------------------------------------

Work = tuple[Slab, Callable[[], object]]


@dataclass(frozen=True)
class Run:
    """Seconds of a call and of its parts, and bytes that it passed through memory by part, on all ranks together."""

    whole: float
    parts: dict[str, float]
    transformed: float
    looped: float
    sent: float


def scale(points: int, rounds: int, _: argparse.Namespace) -> Iterator[Line]:
    """On two ranks of the same node: rank 0 alone, then both; the other waits and keeps no core busy; collective."""
    rates = [_bandwidth(points, rounds, ranks) for ranks in (1, 2)]
    for ranks, rate in enumerate(rates, start=1):
        yield Line(f"memory, read and written by {ranks} of 2 ranks", rate / 1e9, "GB/s")
    with Meter().in_place() as meter:
        for what, make, boxes in (
            ("transform", _transforms, 1),
            ("cold solve", _cold_solve, 1),
            ("cold solve, each rank as many points", _cold_solve, 2),
            ("sliding step", _sliding_step, 1),
        ):
            one, two = _in_turns(make, points, boxes, rounds, meter)
            if WORLD.rank == 0:
                yield from _told(what, one, two, float(boxes), rates[1])


def _transforms(points: int, comm: MPI.Intracomm, boxes: int) -> Work:
    slab = Slab(comm, points, boxes * points)
    return slab, pair(slab, "float64")


def _cold_solve(points: int, comm: MPI.Intracomm, boxes: int) -> Work:
    surface = Cold(points, comm, boxes)
    solver = surface.solver(TOLERANCE)
    surface.solve(solver)
    return surface.slab, lambda: surface.solve(solver)


def _sliding_step(points: int, comm: MPI.Intracomm, boxes: int) -> Work:
    slide = Slide(points, comm)
    slide.warm_up()
    return slide.march.scene.slab, slide.step


def _in_turns(
    make: Callable[[int, MPI.Intracomm, int], Work], points: int, boxes: int, rounds: int, meter: Meter
) -> tuple[list[Run], list[Run]]:
    """Runs of one box on rank 0 alone, and of so many boxes on both ranks; collective."""
    single = make(points, MPI.COMM_SELF, 1) if WORLD.rank == 0 else None
    double = make(points, WORLD, boxes)
    one, two = list[Run](), list[Run]()
    for _ in range(rounds):
        if single is not None:
            one.append(_metered(*single, meter))
        arrival = WORLD.Ibarrier()
        while not arrival.Test():
            time.sleep(1e-3)
        two.append(_metered(*double, meter))
    return one, two


def _metered(slab: Slab, call: Callable[[], object], meter: Meter) -> Run:
    """A call with its parts; collective. Seconds are those of this rank, bytes those of all."""
    meter.clear()
    before = slab.tally["bytes sent"]
    began = time.perf_counter()
    call()
    whole = time.perf_counter() - began
    transformed, sent = meter.bytes[TRANSFORM], slab.tally["bytes sent"] - before
    passed = slab.comm.allreduce(np.array([transformed, sum(meter.bytes.values()) - transformed, sent]))
    return Run(whole, meter.parts(whole), *map(float, passed))


def _told(what: str, one: list[Run], two: list[Run], work: float, rate: float) -> Iterator[Line]:
    """Times on one rank and, with `work` times as much of it, on two, by part; how many times more is done in a second,
    and what memory at this rate [byte/s] lets."""
    for name, runs in ((f"{what} on 1 rank", one), (f"{what} on 2 ranks", two)):
        yield Line(name, 1e3 * float(np.median([run.whole for run in runs])), "ms")
        for part in runs[0].parts:
            yield Line(f"{name}: {part}", 1e3 * float(np.median([run.parts[part] for run in runs])), "ms")
    for part, passed in ((TRANSFORM, "transformed"), (OTHER, "looped")):  # to see beside the rate of memory
        if any(getattr(run, passed) for run in one):
            found = float(np.median([getattr(run, passed) / run.parts[part] for run in one]))
            yield Line(f"{what} on 1 rank: bytes {passed} over the time of {part}", found / 1e9, "GB/s")
    pairs = list(zip(one, two, strict=True))
    ratio = quartiles(f"{what}: speed of 2 ranks over 1", [work * a.whole / b.whole for a, b in pairs])
    limit = float(np.median([best_ratio(a, b, work, rate) for a, b in pairs]))
    yield from (ratio, Line(f"{what}: by the roofline at most", limit), Line(f"{what}: share", ratio.value / limit))


def best_ratio(one: Run, two: Run, work: float, rate: float) -> float:
    """The speed of two ranks over that of one, at most: no part of the work takes less than half of its time on one,
    nor than its bytes at the rate of memory; what is sent is read and written once more."""
    bounds = [(one.parts[TRANSFORM], two.transformed), (one.whole - one.parts[TRANSFORM], two.looped)]
    least = sum(max(0.5 * work * seconds, passed / rate) for seconds, passed in bounds) + 2.0 * two.sent / rate
    return work * one.whole / least


@loop
def triad(a, b, c):
    """`a = b + 3 c`."""
    for j in range(a.shape[0]):
        for i in range(a.shape[1]):
            a[j, i] = b[j, i] + 3.0 * c[j, i]


def _bandwidth(points: int, rounds: int, ranks: int) -> float:
    """Bytes per second that the first ranks together read and write at the best, in maps of so many points;
    collective."""
    WORLD.Barrier()
    best = 0.0
    for _ in range(rounds if WORLD.rank < ranks else 0):
        maps = [pyfftw.zeros_aligned((points // ranks, points), "float64", n=64) for _ in range(MAPS)]
        triad(*maps[:3])
        began = time.perf_counter()
        for k in range(MAPS):
            triad(maps[k], maps[k - 1], maps[k - 2])
        best = max(best, 3 * maps[0].nbytes * MAPS / (time.perf_counter() - began))
    return float(WORLD.allreduce(best))


# -- a run on two ranks ------------------------------------------------------------------------------------------------


def march(points: int, rounds: int, _: argparse.Namespace) -> Iterator[Line]:
    """From the steady start through the climb, then rounds of a step of one cell and bare transforms; collective.

    Bare transforms have the exchange between ranks; in double precision for all transforms of a step, whatever theirs
    is, and each in its own precision.
    """
    sets = {"grid.points": points, "surface.0.short_wavelength": min(CELLS * 1e-3 / points, LONGEST)}
    run = begun(JOB, sets, WORLD)
    slab, steps = run.scene.slab, run.steps()
    for step in steps:
        run.advance(step)
        if step.number > run.timeline().spans[0].last:
            break
    held = slab.sum(slab.tally["map bytes at most"])[0] / (8 * points**2)
    double, single = pair(slab, "float64"), pair(slab, "float32")
    names = [transform_name((points, points), dtype) for dtype in ("float64", "float32")]
    calls = slab.tally["operator"]
    ratios: dict[str, list[float]] = {"all in double precision": [], "each in its own precision": []}
    for step in islice(steps, rounds):
        before = slab.tally.copy()
        seconds = _seconds(partial(run.advance, step))
        made = slab.tally.since(before)
        took, (in_double, in_single) = (_seconds(double), _seconds(single)), (0.5 * made.get(name, 0) for name in names)
        both = (in_double + in_single) * took[0], in_double * took[0] + in_single * took[1]
        for values, bare in zip(ratios.values(), both, strict=True):
            values.append(seconds / bare)
    yield Line("operator calls per step", (slab.tally["operator"] - calls) / rounds)
    for name, values in ratios.items():
        yield quartiles(f"a step over its transforms, {name}", values)
    yield Line("held at most, the steady start included", held, "maps")
    yield Line("the same without one for each branch", held - len(run.state.body.branches), "maps")


def _seconds(call: Callable[[], object]) -> float:
    """Wall time of the slowest rank; collective."""
    WORLD.Barrier()
    began = time.perf_counter()
    call()
    return float(WORLD.allreduce(time.perf_counter() - began, MPI.MAX))

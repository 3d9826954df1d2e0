"""Parts `scale` and `march`: one rank compared with two, and a run on two ranks."""

import argparse
import time
from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice

import numpy as np
from mpi4py import MPI
from runs import ROOT, begun

from parcontact.parallel.fft import transform_name
from parcontact.parallel.slab import Slab

from .table import Line, quartiles
from .work import Cold, Slide, pair

TOLERANCE = 1e-6  # tolerance of cold solves
JOB = ROOT / "jobs" / "paper" / "fig08_velocity_step.yaml"  # job of `march`
CELLS = 16  # cells per shortest wave
LONGEST = 1.25e-4  # limit on the shortest wave on small grids, half of the longest wave [m]
WORLD = MPI.COMM_WORLD
Work = Callable[[], object]


def scale(points: int, rounds: int, _: argparse.Namespace) -> Iterator[Line]:
    """Measure rank 0 alone, then both ranks of a node; a waiting rank keeps no core busy; collective."""
    for what, make, boxes in (
        ("transform", _transforms, 1),
        ("cold solve", _cold_solve, 1),
        ("cold solve, as many points per rank", _cold_solve, 2),
        ("sliding step", _sliding_step, 1),
    ):
        one, two = _in_turns(make, points, boxes, rounds)
        if WORLD.rank == 0:
            for ranks, times in ((1, one), (2, two)):
                yield Line(f"{what} on {ranks} rank{'s' * (ranks > 1)}", 1e3 * float(np.median(times)), "ms")
            ratios = [boxes * alone / both for alone, both in zip(one, two, strict=True)]
            yield quartiles(f"{what}: speed of 2 ranks over 1", ratios)


def _transforms(points: int, comm: MPI.Intracomm, boxes: int) -> Work:
    return pair(Slab(comm, points, boxes * points), "float64")


def _cold_solve(points: int, comm: MPI.Intracomm, boxes: int) -> Work:
    surface = Cold(points, comm, boxes)
    solver = surface.solver(TOLERANCE)
    surface.solve(solver)
    return lambda: surface.solve(solver)


def _sliding_step(points: int, comm: MPI.Intracomm, boxes: int) -> Work:
    slide = Slide(points, comm)
    slide.warm_up()
    return slide.step


def _in_turns(
    make: Callable[[int, MPI.Intracomm, int], Work], points: int, boxes: int, rounds: int
) -> tuple[list[float], list[float]]:
    """Return the times [s] of one box on rank 0 alone, and of the given number of boxes on both ranks; collective."""
    single = make(points, MPI.COMM_SELF, 1) if WORLD.rank == 0 else None
    double = make(points, WORLD, boxes)
    one, two = list[float](), list[float]()
    for _ in range(rounds):
        if single is not None:
            began = time.perf_counter()
            single()
            one.append(time.perf_counter() - began)
        arrival = WORLD.Ibarrier()
        while not arrival.Test():
            time.sleep(1e-3)
        began = time.perf_counter()
        double()
        two.append(time.perf_counter() - began)
    return one, two


# -- a run on two ranks ------------------------------------------------------------------------------------------------


def march(points: int, rounds: int, _: argparse.Namespace) -> Iterator[Line]:
    """March from the steady start to the end of the first stage; then compare steps of one cell with bare transforms;
    collective.

    Bare transforms include the exchange between ranks. They are timed once in double precision for all transforms of a
    step, and once in the precision of each.
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
    yield Line("largest memory, with the steady start", held, "maps")
    yield Line("the same without one map per branch", held - len(run.state.body.branches), "maps")


def _seconds(call: Callable[[], object]) -> float:
    """Return the wall time [s] of the slowest rank; collective."""
    WORLD.Barrier()
    began = time.perf_counter()
    call()
    return float(WORLD.allreduce(time.perf_counter() - began, MPI.MAX))

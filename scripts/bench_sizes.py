"""Parts `sizes` and `large` of scripts/bench.py: how cost grows with the grid, and one solve on a large one."""

import argparse
import math
import resource
import statistics
import time
from collections.abc import Callable, Iterator

import numpy as np
from bench_cold import Cold, distance
from bench_lines import Line, interleave
from bench_scale import WARM, Slide
from mpi4py import MPI

SMALLEST = 256  # points along a side, where `sizes` begins
TOLERANCE = 1e-6  # of its cold solves
LIGHT = 0.036  # mean pressure over E*, for 8 % of contact at a slope of 1
ERROR = 1e-5  # of pressures on the large grid
COARSER = 4  # times fewer points, where the tolerance for that is looked for
MARGIN = 4.0  # times less than the error it is looked for, as grids differ
FURTHER = 100.0  # times smaller a tolerance, to see the error


def sizes(points: int, rounds: int, _: argparse.Namespace) -> Iterator[Line]:
    """Up to so many points, twice as many along each side every time; times are also told over N^2 log2 N."""
    side = min(SMALLEST, points)
    while side <= points:
        yield from _cost(side, "a cold solve", *_cold(side), rounds=min(rounds, 3))
        yield from _cost(side, "a sliding step", *_slide(side), rounds=rounds)
        side *= 2


def _cost(side: int, what: str, call: Callable[[], object], calls: Callable[[], int], rounds: int) -> Iterator[Line]:
    call()  # plans and compiles
    before = calls()
    seconds = statistics.median(interleave({what: call}, rounds, before=0)[what])
    name = f"{side} x {side}: {what}"
    yield Line("sizes", f"{name}: operator calls", (calls() - before) / rounds, "")
    yield Line("sizes", name, 1e3 * seconds, "ms")
    yield Line("sizes", f"{name} over N^2 log2 N", 1e9 * seconds / (side**2 * math.log2(side)), "ns")


def _cold(side: int) -> tuple[Callable[[], object], Callable[[], int]]:
    surface = Cold(side)
    solver = surface.solver(TOLERANCE)
    return lambda: surface.solve(solver), lambda: surface.slab.tally["operator"]


def _slide(side: int) -> tuple[Callable[[], object], Callable[[], int]]:
    slide = Slide(side, MPI.COMM_SELF)
    for _ in range(WARM):
        slide.step()
    return slide.step, lambda: slide.march.scene.slab.tally["operator"]


def large(points: int, _: int, __: argparse.Namespace) -> Iterator[Line]:
    """A cold solve at 8 % of contact by a tolerance that is good enough on a coarser grid; its error is the distance
    from where it gets with a hundredth of that."""
    tolerance = Cold(max(points // COARSER, 64), load=LIGHT).loosest(ERROR / MARGIN)[0].tolerance
    began = time.process_time()
    surface = Cold(points, load=LIGHT)
    solver, tally = surface.solver(tolerance), surface.slab.tally
    yield Line("large", "surface, transforms and operators", time.process_time() - began, "s")
    before, began = tally["operator"], time.process_time()
    found = surface.go_on(solver, surface.start(solver))
    yield Line("large", f"a cold solve to {tolerance:.2g}", time.process_time() - began, "s")
    yield Line("large", "operator calls", tally["operator"] - before, "")
    yield Line("large", "iterations on the finest grid", found.iterations, "")
    yield Line("large", "certificate", found.certificate.worst, "")
    yield Line("large", "contact area", float(np.count_nonzero(found.p)) / found.p.size, "")
    yield Line("large", "held at most", tally["map bytes at most"] / 1e9, "GB")
    yield Line("large", "resident at most", resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6, "GB")
    closer = np.array(found.p, dtype=np.float64)
    solver.tolerance /= FURTHER
    surface.go_on(solver, closer)
    yield Line("large", "pressure error", distance(found.p, closer), "")

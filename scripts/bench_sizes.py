"""Parts `sizes` and `large` of scripts/bench.py: how cost grows with the grid, and one solve on a large one."""

import argparse
import math
import resource
import statistics
import time
from collections.abc import Callable, Iterator

import numpy as np
from bench_cold import Cold, Solver, distance
from bench_lines import Line, Map, interleave
from bench_scale import WARM, Slide
from mpi4py import MPI

SMALLEST = 256  # points along a side, where `sizes` begins
TOLERANCE = 1e-6  # of its cold solves
LIGHT = 0.036  # mean pressure over E*, for 8 % of contact at a slope of 1
ERROR = 1e-5  # of pressures on the large grid
COARSER = 4  # times fewer points, where the tolerance for that is looked for
FURTHER = 1e3  # times smaller a tolerance, to see the error


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
    """A cold solve at 8 % of contact: to a tolerance that is good enough on a coarser grid, then on from there until
    the pressure is good enough, seen from where it gets with a thousandth of that tolerance."""
    tolerance = Cold(max(points // COARSER, 64), load=LIGHT).loosest(ERROR)[0].tolerance
    began = time.process_time()
    surface = Cold(points, load=LIGHT)
    solver, tally = surface.solver(tolerance), surface.slab.tally
    yield Line("large", "surface, transforms and operators", time.process_time() - began, "s")
    calls, began = tally["operator"], time.process_time()
    found = surface.go_on(solver, surface.start(solver))
    seconds, calls = time.process_time() - began, tally["operator"] - calls
    yield Line("large", "held at most", tally["map bytes at most"] / 1e9, "GB")
    yield Line("large", "resident at most", resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6, "GB")
    exact = _exact(surface, solver, found.p)
    while (error := distance(found.p, exact)) > ERROR:
        solver[0].tolerance /= 2.0
        before, began = tally["operator"], time.process_time()
        found = surface.go_on(solver, found.p)
        seconds, calls = seconds + time.process_time() - began, calls + tally["operator"] - before
    yield Line("large", f"a cold solve to {solver[0].tolerance:.2g}", seconds, "s")
    yield Line("large", "operator calls", calls, "")
    yield Line("large", "certificate", found.certificate.worst, "")
    yield Line("large", "contact area", float(np.count_nonzero(found.p)) / found.p.size, "")
    yield Line("large", "pressure error", error, "")


def _exact(surface: Cold, solver: Solver, p: Map) -> Map:
    """Where a solver gets from a pressure with a thousandth of its tolerance, which it keeps."""
    own = solver[0]
    exact, tolerance = p.copy(), own.tolerance
    own.tolerance /= FURTHER
    surface.go_on(solver, exact)
    own.tolerance = tolerance
    return exact

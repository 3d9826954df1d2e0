"""Parts `solve`, `sizes` and `large`: cold elastic solves, and how costs grow with the grid."""

import argparse
import math
import resource
import statistics
import time
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from parcontact.parallel.slab import Slab

from .peers import ASPHER_COLD, TAMAAS_COLD, Task, compare_peers
from .table import Line, compare, interleave
from .work import LOAD, MODULUS, Cold, Slide, distance

ERROR = 1e-7  # allowed error of pressures
PEERS = (Task("tamaas", TAMAAS_COLD, -6.5), Task("aspher", ASPHER_COLD, -6.5))
SMALLEST = 256  # points along a side of the first grid of `sizes`
TOLERANCE = 1e-6  # tolerance of its cold solves
LIGHT = 0.036  # mean pressure over E* of `large`, for 8 % of contact at a slope of 1
LARGE_ERROR = 1e-5  # allowed error of its pressures
COARSER = 4  # points over the points of the grid on which the tolerance is found
FURTHER = 1e3  # tolerance over the tolerance of the reference


def solve(points: int, rounds: int, asked: argparse.Namespace) -> Iterator[Line]:
    surface = Cold(points)
    solves: dict[str, Callable[[], object]] = {}
    for name, single in (("double", False), ("mixed", True)):
        solver, error = surface.loosest(ERROR, single)
        calls = surface.slab.tally["operator"]
        surface.solve(solver)
        yield Line(f"{name}: operator calls", surface.slab.tally["operator"] - calls)
        yield Line(f"{name}: pressure error", error)
        solves[name] = partial(surface.solve, solver)
    times = interleave(solves, rounds)
    yield from compare(times, "double")
    if asked.peers is not None and surface.reference is not None:
        given = {"heights": surface.heights, "reference": surface.reference / MODULUS, "load": LOAD, "wanted": ERROR}
        yield from compare_peers(asked.peers, PEERS, given, statistics.median(times["double"]))


def sizes(points: int, rounds: int, _: argparse.Namespace) -> Iterator[Line]:
    """Measure grids with twice as many points along each side every time, up to `points`; times are also stated over
    N^2 log2 N."""
    side = min(SMALLEST, points)
    while side <= points:
        surface, slide = Cold(side), Slide(side)
        solver = surface.solver(TOLERANCE)
        yield from _cost(side, "a cold solve", partial(surface.solve, solver), surface.slab, min(rounds, 3))
        slide.warm_up()
        yield from _cost(side, "a sliding step", slide.step, slide.march.scene.slab, rounds)
        side *= 2


def _cost(side: int, what: str, call: Callable[[], object], slab: Slab, rounds: int) -> Iterator[Line]:
    call()  # plans and compiles
    before = slab.tally["operator"]
    seconds = statistics.median(interleave({what: call}, rounds, before=0)[what])
    name = f"{side} x {side}: {what}"
    yield Line(f"{name}: operator calls", (slab.tally["operator"] - before) / rounds)
    yield Line(name, 1e3 * seconds, "ms")
    yield Line(f"{name} over N^2 log2 N", 1e9 * seconds / (side**2 * math.log2(side)), "ns")


def large(points: int, *_: object) -> Iterator[Line]:
    """Measure a cold solve at 8 % of contact. Its tolerance is one that suffices on a coarser grid, and is halved until
    the error of the pressure is at most LARGE_ERROR. The reference is solved to a tolerance FURTHER times smaller, and
    kept in single precision to save memory."""
    tolerance = Cold(max(points // COARSER, 64), load=LIGHT).loosest(LARGE_ERROR)[0][0].tolerance
    began = time.process_time()
    surface = Cold(points, load=LIGHT)
    solver, tally = surface.solver(tolerance), surface.slab.tally
    yield Line("surface, transforms and operators", time.process_time() - began, "s")
    calls, began = tally["operator"], time.process_time()
    found = surface.solve_from(solver, surface.start(solver))
    seconds, calls = time.process_time() - began, tally["operator"] - calls
    yield Line("largest memory in maps", tally["map bytes at most"] / 1e9, "GB")
    yield Line("largest resident memory", _resident(), "GB")
    own, reached, certificate = solver[0], found.p.astype(np.float32), found.certificate.worst
    own.tolerance = tolerance / FURTHER
    exact = surface.solve_from(solver, found.p).p
    own.tolerance = tolerance
    if (error := distance(reached, exact)) > LARGE_ERROR:
        exact = exact.astype(np.float32)
    while error > LARGE_ERROR:
        own.tolerance /= 2.0
        found.p[...] = reached
        before, began = tally["operator"], time.process_time()
        certificate = surface.solve_from(solver, found.p).certificate.worst
        seconds, calls = seconds + time.process_time() - began, calls + tally["operator"] - before
        reached[...] = found.p
        error = distance(reached, exact)
    yield Line(f"a cold solve to {own.tolerance:.2g}", seconds, "s")
    yield Line("operator calls", calls)
    yield Line("certificate", certificate)
    yield Line("contact area", float(np.count_nonzero(reached)) / reached.size)
    yield Line("pressure error", error)
    yield Line("largest resident memory, with the reference", _resident(), "GB")


def _resident() -> float:
    """Return the largest resident memory of this process [GB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6

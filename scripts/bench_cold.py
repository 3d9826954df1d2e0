"""Parts `fft` and `solve` of scripts/bench.py: a transform, and cold elastic solves, ours and those of others."""

import argparse
import statistics
import time
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from bench_lines import Line, Map, compare, interleave
from bench_peers import ASPHER_COLD, TAMAAS_COLD, Task, compare_peers
from mpi4py import MPI

from parcontact.parallel.fft import FFT, export_wisdom, import_wisdom
from parcontact.parallel.fftw import pyfftw
from parcontact.parallel.slab import Slab
from parcontact.physics.halfspace import HalfSpace
from parcontact.physics.roughness import Roughness
from parcontact.solve.constraint import NonNegative
from parcontact.solve.contact import Contact, ContactSolver
from parcontact.solve.fallback import cold_start
from parcontact.solve.problem import MeanPressure, Operators, Problem
from parcontact.solve.workspace import Workspace

LOAD = 0.05  # mean pressure over E*, for 11 % of contact at a slope of 1
MODULUS = 4.0  # E* of shear modulus 1 and Poisson's ratio 1/2
ERROR = 1e-7  # of pressures
Solver = tuple[ContactSolver, Operators]  # of a contact
EXACT = 1e-11  # a tolerance whose pressures others are compared with
PEERS = (Task("tamaas", TAMAAS_COLD, -6.5), Task("aspher", ASPHER_COLD, -6.5))
TOLERANCES = [10.0**-exponent for exponent in np.arange(3.0, 10.5, 0.25)]


def fft(points: int, rounds: int, _: argparse.Namespace) -> Iterator[Line]:
    heights, out = (pyfftw.zeros_aligned((points, points), "float64", n=64) for _ in range(2))
    waves = pyfftw.zeros_aligned((points, points // 2 + 1), "complex128", n=64)
    forward = pyfftw.FFTW(heights, waves, (0, 1), "FFTW_FORWARD", ("FFTW_MEASURE",))
    backward = pyfftw.FFTW(waves, out, (0, 1), "FFTW_BACKWARD", ("FFTW_MEASURE", "FFTW_DESTROY_INPUT"))
    heights[...] = np.random.default_rng(1).random(heights.shape)
    bare = {"FFTW alone": lambda: (forward.execute(), backward.execute())}
    ours = {name: pair(Slab(MPI.COMM_SELF, points, points), name) for name in ("float64", "float32")}
    yield from compare("fft", interleave({**bare, **ours}, rounds), "FFTW alone")
    yield from planning(points)


def planning(points: int) -> Iterator[Line]:
    """Of both transforms: the first time on a machine, and with FFTW's wisdom of that time, which runs keep."""
    before = export_wisdom()
    pyfftw.forget_wisdom()
    for name in ("the first time", "again"):
        began = time.process_time()
        FFT(Slab(MPI.COMM_SELF, points, points))
        yield Line("fft", f"planning, {name}", 1e3 * (time.process_time() - began), "ms")
        import_wisdom(export_wisdom())  # forgets plans, too: those of the next run are made from what is kept
    import_wisdom(before)


def pair(slab: Slab, dtype: str) -> Callable[[], object]:
    """A forward and a backward transform of a random map."""
    transform, heights, out = FFT(slab, dtype=dtype), slab.empty(dtype), slab.zeros(dtype)
    heights[...] = np.random.default_rng(1).random(slab.shape)
    return lambda: transform.backward(transform.forward(heights), out)


class Cold:
    """Cold elastic solves of one surface: Hurst 0.8, from a quarter of the box to eight cells, rms slope 1.

    The box has the length 1 along x, and that of so many `boxes` along y; `load` is the mean pressure over E*.
    """

    def __init__(self, points: int, comm: MPI.Intracomm = MPI.COMM_SELF, boxes: int = 1, load: float = LOAD) -> None:
        self.slab, self.size, self.load = Slab(comm, points, boxes * points), (1.0, float(boxes)), load
        fft = FFT(self.slab)
        waves = Roughness(0.8, 0.25, 0.25, 8 / points, 1, rms_slope=1.0).spectrum(fft, self.size)
        self.heights: Map = np.asarray(fft.backward(waves, self.slab.zeros()), dtype=np.float64)
        low, high = self.slab.reduce((), [-float(self.heights.min()), float(self.heights.max())])
        self.height, self.fft = low + high, fft
        self.reference: Map | None = None  # the solution to EXACT, when it has been asked for

    def solver(self, tolerance: float, single: bool = False, slab: Slab | None = None) -> Solver:
        """With K in single precision, or for a coarser grid; and the operators."""
        fft = self.fft if slab is None else FFT(slab, measured=False)
        other = FFT(fft.slab, dtype=np.float32, measured=fft.measured) if single else fft
        half = HalfSpace(self.size)
        solver = ContactSolver(Workspace(fft.slab, tolerance), self.height, tolerance, 500)
        return solver, Operators(half.operator(fft), half.inverse(other))

    def problem(self, operators: Operators) -> Problem:
        return Problem(*operators, self.heights, NonNegative(), MeanPressure(self.load * MODULUS))

    def start(self, solver: Solver) -> Map:
        """From nested grids."""
        start, (own, operators) = np.zeros_like(self.heights), solver
        cold_start.prepare(own, self.problem(operators), start, lambda slab, tol: self.solver(tol, slab=slab))
        return start

    def go_on(self, solver: Solver, start: Map) -> Contact:
        """From a start that becomes the solution."""
        own, operators = solver
        return own.solve(self.problem(operators), start)

    def solve(self, solver: Solver) -> Map:
        return np.asarray(self.go_on(solver, self.start(solver)).p)

    def loosest(self, error: float, single: bool = False) -> tuple[Solver, float]:
        """With the loosest tolerance by which the pressure is wrong by so much or less, and how wrong it is."""
        if self.reference is None:
            self.reference = self.solve(self.solver(EXACT))
        for tolerance in TOLERANCES:
            solver = self.solver(tolerance, single)
            if (found := distance(self.solve(solver), self.reference)) <= error:
                break
        return solver, found


def solve(points: int, rounds: int, asked: argparse.Namespace) -> Iterator[Line]:
    surface = Cold(points)
    ways: dict[str, Callable[[], object]] = {}
    for name, single in (("double", False), ("mixed", True)):
        solver, error = surface.loosest(ERROR, single)
        calls = surface.slab.tally["operator"]
        surface.solve(solver)
        yield Line("solve", f"{name}: operator calls", surface.slab.tally["operator"] - calls, "")
        yield Line("solve", f"{name}: pressure error", error, "")
        ways[name] = partial(surface.solve, solver)
    times = interleave(ways, rounds)
    yield from compare("solve", times, "double")
    if asked.peers is not None and surface.reference is not None:
        given = {"heights": surface.heights, "reference": surface.reference / MODULUS, "load": LOAD, "wanted": ERROR}
        yield from compare_peers(asked.peers, "solve", PEERS, given, statistics.median(times["double"]))


def distance(p: Map, reference: Map) -> float:
    return float(np.linalg.norm(p - reference) / np.linalg.norm(reference))

"""Problems for the benchmarks: transforms, cold elastic solves of one surface, and slides over another."""

import math
from collections.abc import Callable

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from runs import Json, begun

from parcontact.contact import starts
from parcontact.contact.problem import Box, Contact, MeanPressure, Operators, Problem, Workspace
from parcontact.contact.solver import ContactSolver
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.halfspace import HalfSpace
from parcontact.physics.roughness import Roughness

from .table import Map

LOAD = 0.05  # mean pressure over E*, for 11 % of contact at a slope of 1
MODULUS = 4.0  # E* of shear modulus 1 and Poisson's ratio 1/2
Solver = tuple[ContactSolver, Operators]
EXACT = 1e-11  # tolerance of the reference
TOLERANCES = [10.0**-exponent for exponent in np.arange(3.0, 10.5, 0.25)]
WARM = 12  # first steps of a slide, which differ from the others
ENDLESS = 1_000_000  # more steps than needed; the surface is periodic


def pair(slab: Slab, dtype: str) -> Callable[[], object]:
    """Return a function that makes a forward and a backward transform of a random map."""
    transform, heights, out = FFT(slab, dtype=dtype), slab.empty(dtype), slab.zeros(dtype)
    heights[...] = np.random.default_rng(1).random(slab.shape)
    return lambda: transform.backward(transform.forward(heights), out)


def distance(p: NDArray[np.floating], reference: NDArray[np.floating]) -> float:
    """Return the relative L2 distance of two maps, row by row to save memory."""
    rows = zip(p, reference, strict=True)
    apart = math.hypot(*(float(np.linalg.norm(one - np.float64(other))) for one, other in rows))
    return apart / math.hypot(*(float(np.linalg.norm(np.float64(row))) for row in reference))


class Cold:
    """Cold elastic solves of one surface: Hurst exponent 0.8, wavelengths from a quarter of the box to eight cells, rms
    slope 1.

    The box has the length 1 along x and `boxes` along y; `load` is the mean pressure over E*.
    """

    def __init__(self, points: int, comm: MPI.Intracomm = MPI.COMM_SELF, boxes: int = 1, load: float = LOAD) -> None:
        self.slab, self.size, self.load = Slab(comm, points, boxes * points), (1.0, float(boxes)), load
        fft = FFT(self.slab)
        waves = Roughness(0.8, 0.25, 0.25, 8 / points, 1, rms_slope=1.0).spectrum(fft, self.size)
        self.heights: Map = np.asarray(fft.backward(waves, self.slab.zeros()), dtype=np.float64)
        low, high = self.slab.reduce((), [-float(self.heights.min()), float(self.heights.max())])
        self.height, self.fft = low + high, fft
        self.reference: Map | None = None  # the solution to EXACT, made when needed

    def solver(self, tolerance: float, single: bool = False, slab: Slab | None = None) -> Solver:
        """Return a solver, with its preconditioner in single precision if `single`, or for a coarser grid."""
        fft = self.fft if slab is None else FFT(slab, measured=False)
        other = FFT(fft.slab, dtype=np.float32, measured=fft.measured) if single else fft
        half = HalfSpace(self.size)
        solver = ContactSolver(Workspace(fft.slab, tolerance), self.height, tolerance, 500)
        return solver, Operators(half.operator(fft), half.inverse(other))

    def problem(self, operators: Operators) -> Problem:
        return Problem(*operators, self.heights, Box(), MeanPressure(self.load * MODULUS))

    def start(self, solver: Solver) -> Map:
        """Return the first guess of the pressure, from nested grids."""
        start, (own, operators) = np.zeros_like(self.heights), solver
        starts.prepare_start(own, self.problem(operators), start, lambda slab, tol: self.solver(tol, slab=slab))
        return start

    def solve_from(self, solver: Solver, start: Map) -> Contact:
        """Solve from `start`, which is overwritten by the solution."""
        own, operators = solver
        return own.solve(self.problem(operators), start)

    def solve(self, solver: Solver) -> Map:
        return np.asarray(self.solve_from(solver, self.start(solver)).p)

    def loosest(self, error: float, single: bool = False) -> tuple[Solver, float]:
        """Return the solver with the loosest tolerance for an error of the pressure of at most `error`, and its
        error."""
        if self.reference is None:
            self.reference = self.solve(self.solver(EXACT))
        for tolerance in TOLERANCES:
            solver = self.solver(tolerance, single)
            if (found := distance(self.solve(solver), self.reference)) <= error:
                break
        return solver, found


def sliding_job(points: int, steps: int, tolerance: float = 5e-3) -> Json:
    """Return a job that slides with twelve branches, by one cell a step."""
    rough = {"hurst": 0.9, "long_wavelength": 2.5e-4, "short_wavelength": min(1.6e-2 / points, 1e-4)}
    return {
        "grid": {"points": points, "size": 1e-3},
        "surface": {"shape": "rough", **rough, "rms_slope": 0.02, "seed": 1},
        "material": {"include": "synthetic_tyre"},
        "history": [{"pressure": 1e5, "velocity": 0.3, "distance": steps * 1e-3 / points, "cells_per_step": 1}],
        "numerics": {"tolerance": tolerance},
    }


class Slide:
    """An endless slide, step by step."""

    def __init__(self, points: int, comm: MPI.Intracomm = MPI.COMM_SELF) -> None:
        self.march = begun(sliding_job(points, ENDLESS), comm=comm)
        self._steps = self.march.steps()

    def step(self) -> None:
        """Make a step; collective."""
        self.march.advance(next(self._steps))

    def warm_up(self) -> None:
        """Make the first steps; collective."""
        for _ in range(WARM):
            self.step()

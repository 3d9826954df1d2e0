"""Iterations of cold contact solves over all loads, from one point to all but one in ten thousand, and the last gap.

Rough surfaces down to sixteen and to two cells per wave, and a sphere. For Westergaard's and Johnson's waves at 0.99, 1
and 1.01 of the load of full contact: how many points are open after each iteration.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.halfspace import HalfSpace
from parcontact.physics.roughness import Roughness
from parcontact.solve.constraint import NonNegative
from parcontact.solve.contact import Contact, ContactSolver
from parcontact.solve.problem import MeanPressure, Operators, Problem
from parcontact.solve.workspace import Workspace

Map = NDArray[np.float64]
MODULUS = 4.0  # E* of shear modulus 1 and Poisson's ratio 1/2
ALMOST = 0.9999  # of all points: there the sweep ends


def solver(heights: Map, tolerance: float, max_iterations: int = 500) -> tuple[ContactSolver, Operators]:
    """For a box of length 1."""
    ny, nx = heights.shape
    slab = Slab(MPI.COMM_SELF, nx, ny)
    fft = FFT(slab)
    half_space = HalfSpace((1.0, 1.0))
    operators = Operators(half_space.operator(fft), half_space.inverse(fft))
    return ContactSolver(Workspace(slab, tolerance), float(np.ptp(heights)), tolerance, max_iterations), operators


def cold(solving: tuple[ContactSolver, Operators], heights: Map, mean: float) -> Contact:
    """A solve from nothing."""
    solver, operators = solving
    return solver.solve(Problem(*operators, heights, NonNegative(), MeanPressure(mean)), np.zeros_like(heights))


def rough(points: int, cells: int) -> Map:
    """Hurst 0.9, four longest waves in the box, the shortest of so many cells, rms slope 1."""
    fft = FFT(Slab(MPI.COMM_SELF, points, points))
    waves = Roughness(0.9, 0.25, 0.25, cells / points, 1, rms_slope=1.0).spectrum(fft, (1.0, 1.0))
    return np.asarray(fft.backward(waves, np.empty((points, points))), dtype=np.float64)


def paraboloid(points: int) -> Map:
    """Its mean slope is of the order of 1."""
    x = np.arange(points) / points - 0.5
    return -(x[None, :] ** 2) - x[:, None] ** 2


def sweep(heights: Map, tolerance: float, per_decade: int = 4) -> Iterator[tuple[float, float, Contact]]:
    """Load over E*, contact area, and the solve; from one point until almost all are in contact."""
    solving = solver(heights, tolerance)
    load, area = 1e-3 / heights.size / heights.shape[0], 0.0
    while area < ALMOST:
        found = cold(solving, heights, load * MODULUS)
        area = np.count_nonzero(found.p) / heights.size
        yield load, area, found
        load *= 10.0 ** ((1.0 if area < 0.5 else 0.25) / per_decade)


def last_gap(points: int, two_ways: bool, share: float, tolerance: float) -> list[int]:
    """How many points are open after each iteration at a share of the load that closes the last gap."""
    x = np.cos(2 * np.pi * (np.arange(points) + 0.3) / points)
    heights = x[:, None] * x[None, :] if two_ways else np.tile(x, (points, 1))
    full = np.pi * MODULUS * (np.sqrt(2.0) if two_ways else 1.0)
    count = []
    for limit in range(1, 100):
        found = cold(solver(heights, tolerance, limit), heights, share * full)
        count.append(heights.size - int(np.count_nonzero(found.p)))
        if found.converged:
            return count
    raise RuntimeError("did not converge")


def reversals(count: list[int]) -> int:
    """How often a count that has fallen rises, or the other way round."""
    steps = [after - before for before, after in pairwise(count) if after != before]
    return sum(first * second < 0 for first, second in pairwise(steps))

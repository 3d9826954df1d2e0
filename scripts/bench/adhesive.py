"""Part `adhesion`: a cold adhesive contact of a rough surface, and peers' on the same surface and branch."""

import argparse
import statistics
import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from mpi4py import MPI

import parcontact as pc

from .peers import ADHESION_COLD, TAMAAS_ADHESIVE, Task, compare_peers
from .table import Line, Map
from .work import Cold, distance

ERROR = 1e-5  # of pressures
SIZE, SLOPE, MODULUS = 1e-3, 0.1, 4e6  # of the box [m], rms, E* [Pa]
STRENGTH = 0.05  # work of adhesion over E* slope^2 and the shortest wave: about a quarter is in contact, without load
EXACT = 1e-8  # a tolerance whose pressures others are compared with
TOLERANCES = [10.0**-exponent for exponent in np.arange(1.5, 9.0, 0.25)]
PEERS = (Task("tamaas", TAMAAS_ADHESIVE, -4.0), Task("Adhesion", ADHESION_COLD, -4.0))


class Found(NamedTuple):
    """A solve: pressures [Pa], share of points in contact, operator calls, CPU time [s]."""

    p: Map
    area: float
    calls: int
    seconds: float


class Sticky:
    """Cold adhesive solves of the surface of `Cold` under a given mean gap, the standard deviation of the heights."""

    def __init__(self, points: int) -> None:
        self.heights = Cold(points).heights * SIZE * SLOPE
        self.heights -= self.heights.mean()
        self.work = STRENGTH * MODULUS * SLOPE**2 * SIZE * 8 / points
        self.range = float(np.sqrt(2 * SIZE / points * self.work / MODULUS))  # a cell is half a process zone
        self.gap = float(self.heights.std())

    def solve(self, tolerance: float) -> Found:
        job = {
            "grid": {"points": len(self.heights), "size": SIZE},
            "surface": {"shape": "array", "heights": self.heights},
            "material": {"model": "elastic", "shear_modulus": MODULUS / 4},
            "adhesion": {"work": self.work, "range": self.range},
            "history": [{"approach": -self.gap}],
            "numerics": {"tolerance": tolerance},
        }
        run = pc.Simulation(job, comm=MPI.COMM_SELF)
        steps = run.steps()
        next(steps)  # the surfaces apart
        began = time.process_time()
        row = next(steps)
        seconds = time.process_time() - began
        return Found(run.field("pressure").copy(), row.contact_area, row.operator_calls, seconds)


def adhesion(points: int, rounds: int, asked: argparse.Namespace) -> Iterator[Line]:
    """A solve to the loosest tolerance by which the pressure is wrong by at most ERROR; its peers to the same error."""
    surface = Sticky(points)
    exact = surface.solve(EXACT)
    tolerance = next(one for one in TOLERANCES if distance(surface.solve(one).p, exact.p) <= ERROR)
    solves = [surface.solve(tolerance) for _ in range(rounds)]
    seconds = statistics.median(one.seconds for one in solves)
    yield Line("contact area", solves[0].area)
    yield Line("operator calls", solves[0].calls)
    yield Line("pressure error", distance(solves[0].p, exact.p))
    yield Line("a cold solve", 1e3 * seconds, "ms")
    if asked.peers is not None:
        given = {"heights": surface.heights / SIZE, "reference": exact.p / MODULUS, "load": 0.0, "wanted": ERROR}
        law = {"work": surface.work / (MODULUS * SIZE), "range": surface.range / SIZE, "gap": surface.gap / SIZE}
        yield from compare_peers(asked.peers, PEERS, given | law, seconds)

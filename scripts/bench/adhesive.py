"""Part `adhesion`: a cold adhesive solve of a rough surface, by this program and by others on the same branch."""

import argparse
import statistics
import time
from collections.abc import Iterator

import numpy as np

from parcontact.contact.problem import Approach
from parcontact.effects.adhesion.gap_solver import EXPONENTIAL, GapOperators, GapProblem, GapSolution, GapSolver, Law
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.halfspace import HalfSpace

from .peers import ADHESION_COLD, TAMAAS_ADHESIVE, Task, compare_peers
from .table import Line
from .work import MODULUS, Cold, distance

ERROR = 1e-5  # allowed error of pressures
STRENGTH = 0.012  # work of adhesion over E*, slope^2 and the shortest wave: larger values have several branches
EXACT = 1e-8  # tolerance of the reference
TOLERANCES = [10.0**-exponent for exponent in np.arange(1.5, 9.0, 0.25)]
PEERS = (Task("tamaas", TAMAAS_ADHESIVE, -4.0), Task("Adhesion", ADHESION_COLD, -4.0))


class Sticky:
    """Cold solves of the surface of `Cold`. They start from an even gap, equal to the standard deviation of the
    heights, which is also the given mean gap."""

    def __init__(self, points: int) -> None:
        self.slab = Slab.alone(points, points)
        self.heights = Cold(points).heights
        self.heights -= self.heights.mean()
        work = STRENGTH * MODULUS * 8 / points
        reach = float(np.sqrt(2 / points * work / MODULUS))  # a cell is half a process zone
        self.law = Law(EXPONENTIAL, work / reach, reach)
        self.mean_gap = float(self.heights.std())
        operators = GapOperators(*HalfSpace((1.0, 1.0)).gap_operators(FFT(self.slab)))
        self.solver = GapSolver(self.slab, operators, 1000)

    def solve(self, tolerance: float) -> GapSolution:
        start = np.full(self.slab.shape, self.mean_gap)
        problem = GapProblem(self.law, self.heights, Approach(-self.mean_gap))
        return self.solver.solve(problem, start, tolerance)


def adhesion(points: int, rounds: int, asked: argparse.Namespace) -> Iterator[Line]:
    """Measure a solve with the loosest tolerance for which the error of the pressure is at most ERROR, and other
    programs with the same error."""
    surface = Sticky(points)
    solved = surface.solve(EXACT)
    exact, touching = solved.p.copy(), solved.gap == 0.0
    tolerance = next(one for one in TOLERANCES if distance(surface.solve(one).p, exact) <= ERROR)
    before, seconds = surface.slab.tally["operator"], []
    for _ in range(rounds):
        began = time.process_time()
        found = surface.solve(tolerance)
        seconds.append(time.process_time() - began)
    yield Line("contact area", float(touching.mean()))
    yield Line("mean pressure over largest pressure", float(exact.mean() / exact.max()))
    yield Line("operator calls", (surface.slab.tally["operator"] - before) / rounds)
    yield Line("pressure error", distance(found.p, exact))
    yield Line("points on another branch", int(np.count_nonzero((found.gap == 0.0) != touching)))
    yield Line("a cold solve", 1e3 * statistics.median(seconds), "ms")
    if asked.peers is not None:
        given = {"heights": surface.heights, "reference": exact / MODULUS, "load": 0.0, "wanted": ERROR}
        given |= {"work": surface.law.strength * surface.law.range / MODULUS, "range": surface.law.range}
        given |= {"gap": surface.mean_gap, "touching": touching}
        yield from compare_peers(asked.peers, PEERS, given, statistics.median(seconds))

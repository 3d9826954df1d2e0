"""Parts `dilute` and `free`: cold solves in free boxes, with few points in contact (compared with aspher) and with any
area."""

import argparse
import statistics
from collections.abc import Iterator
from functools import partial

import numpy as np

from parcontact.contact import starts
from parcontact.contact.problem import Operators, Workspace
from parcontact.contact.solver import ContactSolver
from parcontact.contact.starts import LARGER_CELLS
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.convolution import SIDE, TileConvolution, TileOperator, Tiles
from parcontact.physics.halfspace import HalfSpace

from .peers import ASPHER_DILUTE, Task, compare_peers
from .table import Line, Map, interleave
from .work import EXACT, MODULUS, Cold, Solver

ERROR = 5e-5  # allowed error of pressures
CASES = ((2, 0.00105), (2, 0.0094), (4, 0.00038), (4, 0.003))  # points over `--points`, mean pressure over E*
SMALLEST, LOADS = 512, (0.001, 0.01, 0.05, 0.2)  # for `free`: points of the first grid, mean pressures over E*
FREE_ERROR, TIGHT = 1e-5, 1e-8  # errors of its pressures, and tolerance of the reference
PEERS = (Task("aspher", ASPHER_DILUTE, -4.0),)


class Dilute(Cold):
    """The same surface in a free box, solved on tiles first where that costs less."""

    def __init__(self, points: int, load: float) -> None:
        super().__init__(points, load=load)
        self.body = HalfSpace(self.size, free=True)
        self.operators = Operators(self.body.operator(self.fft), self.body.inverse(self.fft))

    def solve_from_scratch(self, tolerance: float) -> None:
        """Make transforms, operators and solver anew, without measuring which transforms are the fastest, and solve."""
        kept = self.fft, self.operators
        self.fft = FFT(self.slab, measured=False)
        self.operators = Operators(self.body.operator(self.fft), self.body.inverse(self.fft))
        self.solve(self.solver(tolerance))
        self.fft, self.operators = kept

    def solver(self, tolerance: float, single: bool = False, slab: Slab | None = None) -> Solver:
        own = self.slab if slab is None else slab
        solver = ContactSolver(Workspace(own, tolerance), self.height, tolerance, 500, free=True)
        if slab is None:
            return solver, self.operators
        fft = FFT(slab, measured=False)
        return solver, Operators(self.body.operator(fft), self.body.inverse(fft))

    def on_tiles(self, tiles: Tiles, tolerance: float) -> tuple[ContactSolver, TileOperator, TileConvolution]:
        work = Workspace(Slab.alone(SIDE, tiles.count * SIDE, self.slab.tally), tolerance)
        solver = ContactSolver(work, self.height, tolerance, 500, LARGER_CELLS, self.body.free)
        return solver, *self.body.on_tiles(tiles, self.slab.tally)

    def solve(self, solver: Solver) -> Map:
        start, (own, operators) = np.zeros_like(self.heights), solver
        coarse = lambda slab, tolerance: self.solver(tolerance, slab=slab)  # noqa: E731
        contact = starts.prepare_start(own, self.problem(operators), start, coarse, self.on_tiles)
        contact = contact or own.solve(self.problem(operators), start, cold=True)
        return np.asarray(contact.p)

    def counted(self, solver: Solver, error: float) -> Iterator[Line]:
        """Yield the operator calls of a solve, and its error."""
        name, before = f"{len(self.heights)}^2, {np.mean(self.reference > 0.0):.2%}", self.slab.tally["operator"]
        self.solve(solver)
        yield Line(f"{name}: operator calls", self.slab.tally["operator"] - before)
        yield Line(f"{name}: pressure error", error)


def dilute(points: int, rounds: int, asked: argparse.Namespace) -> Iterator[Line]:
    """Measure grids of two and four times as many points along a side, at two loads each."""
    for times, load in CASES:
        surface = Dilute(times * points, load)
        surface.reference = surface.solve(surface.solver(EXACT))
        solver, error = surface.loosest(ERROR)
        yield from surface.counted(solver, error)
        ours = {"a cold solve": partial(surface.solve, solver)}
        ours["all made for it"] = partial(surface.solve_from_scratch, solver[0].tolerance)
        seconds = {what: statistics.median(each) for what, each in interleave(ours, min(rounds, 5), before=0).items()}
        yield from (Line(what, 1e3 * each, "ms") for what, each in seconds.items())
        if asked.peers is not None:
            given = {"heights": surface.heights, "reference": surface.reference / MODULUS, "load": load}
            given["wanted"] = max(error, 1e-5)
            yield from compare_peers(asked.peers, PEERS, given, seconds["a cold solve"])


def free(points: int, *_: object) -> Iterator[Line]:
    """Yield operator calls on 512 x 512 points and on finer and finer grids, from dilute contacts to high loads."""
    side = min(SMALLEST, points)
    while side <= points:
        for load in LOADS:
            surface = Dilute(side, load)
            surface.reference = surface.solve(surface.solver(TIGHT))
            yield from surface.counted(*surface.loosest(FREE_ERROR))
        side *= 2

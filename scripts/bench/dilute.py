"""Parts `dilute` and `free`: cold solves of few points in contact, in free boxes beside aspher on the same surfaces in
turns; and cold solves in free boxes of any contact."""

import argparse
import json
import os
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.halfspace import HalfSpace
from parcontact.physics.tile_operator import TileOperator
from parcontact.physics.tiles import SIDE, TileConvolution, Tiles
from parcontact.solve.contact import ContactSolver
from parcontact.solve.fallback import cold_start
from parcontact.solve.problem import Operators
from parcontact.solve.tiles import LARGER_CELLS
from parcontact.solve.workspace import Workspace

from .peers import installed
from .table import Line, Map, quartiles
from .work import EXACT, MODULUS, TOLERANCES, Cold, Solver

ERROR = 5e-5  # of pressures, of the other program; ours is never larger than its own
CASES = ((2, 0.00105), (2, 0.0094), (4, 0.00038), (4, 0.003))  # times `--points`; mean pressure over E*
SMALLEST, LOADS = 512, (0.001, 0.01, 0.05, 0.2)  # of `free`: points along a side, mean pressures over E*
FREE_ERROR, TIGHT = 1e-5, 1e-8  # of its pressures, and the tolerance of what they are compared with
ASPHER = """\
import aspher
coarsest = len(heights)
while coarsest % 2 == 0 and coarsest > 64:
    coarsest //= 2
gap, reference = heights.max() - heights, given["reference"]
def attempt(tolerance):
    began = time.process_time()
    found = aspher.solve_nested(
        len(heights), gap, load, coarsest=coarsest, tol=tolerance, coarse_tol=1e-3, backend="h2", active_set=True
    )
    seconds = time.process_time() - began
    p = np.asarray(found.pressure).reshape(heights.shape)
    return seconds, float(np.linalg.norm(p - reference) / np.linalg.norm(reference))
"""
TURN = """\
import json, sys, time
import numpy as np
given = np.load(sys.argv[1])
heights, load = given["heights"], float(given["load"])
{attempt}
for line in sys.stdin:
    print(json.dumps(attempt(float(line))), flush=True)
"""


class Dilute(Cold):
    """The same surface in a box with nothing around, on tiles where that costs less."""

    def __init__(self, points: int, load: float) -> None:
        super().__init__(points, load=load)
        self.body = HalfSpace(self.size, free=True)
        self.operators = Operators(self.body.operator(self.fft), self.body.inverse(self.fft))

    def solve_anew(self, tolerance: float) -> None:
        """Make transforms, operators and solver as for the first time, without measuring which are the fastest, and
        solve."""
        kept = self.fft, self.operators
        self.fft = FFT(self.slab, measured=False)
        self.operators = Operators(self.body.operator(self.fft), self.body.inverse(self.fft))
        self.solve(self.solver(tolerance))
        self.fft, self.operators = kept

    def solver(self, tolerance: float, single: bool = False, slab: Slab | None = None) -> Solver:
        own = self.slab if slab is None else slab
        solver = ContactSolver(Workspace(own, tolerance), self.height, tolerance, 500, free=self.body.free)
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
        contact = cold_start.prepare(own, self.problem(operators), start, coarse, self.on_tiles)
        return np.asarray((self.go_on(solver, start) if contact is None else contact).p)

    def calls(self, solver: Solver) -> int:
        """Operator calls of a solve."""
        before = self.slab.tally["operator"]
        self.solve(solver)
        return self.slab.tally["operator"] - before


def dilute(points: int, rounds: int, asked: argparse.Namespace) -> Iterator[Line]:
    """Two grids of two and four times as many points along a side, at two loads each."""
    for times, load in CASES:
        yield from _case(times * points, load, min(rounds, 5), asked.peers)


def free(points: int, *_: object) -> Iterator[Line]:
    """Operator calls on 512 x 512 points and on ever finer grids, at loads from dilute contacts on."""
    side = min(SMALLEST, points)
    while side <= points:
        for load in LOADS:
            surface = Dilute(side, load)
            surface.reference = surface.solve(surface.solver(TIGHT))
            solver, error = surface.loosest(FREE_ERROR)
            name = f"{side} x {side}, {np.mean(surface.reference > 0.0):.2%}"
            yield Line(f"{name}: operator calls", surface.calls(solver))
            yield Line(f"{name}: pressure error", error)
        side *= 2


def _case(points: int, load: float, rounds: int, peers: Path | None) -> Iterator[Line]:
    surface = Dilute(points, load)
    surface.reference = surface.solve(surface.solver(EXACT))
    name = f"{points} x {points}, {np.mean(surface.reference > 0.0):.2%}"
    with tempfile.TemporaryDirectory() as where:
        given = {"heights": surface.heights, "reference": surface.reference / MODULUS, "load": load, "wanted": ERROR}
        other = None if peers is None else _Other(installed(peers, "aspher"), given, Path(where, "given.npz"))
        solver, error = surface.loosest(ERROR if other is None else min(other.error, ERROR))
        calls = surface.calls(solver)
        ours: dict[str, Callable[[], object]] = {"a cold solve": partial(surface.solve, solver)}
        ours["all made for it"] = partial(surface.solve_anew, solver[0].tolerance)
        seconds, theirs = {name: list[float]() for name in ours}, list[float]()
        for _ in range(rounds):
            for what, call in ours.items():
                began = time.process_time()
                call()
                seconds[what].append(time.process_time() - began)
            if other is not None:
                theirs.append(other.turn())
    yield Line(f"{name}: operator calls", calls)
    yield Line(f"{name}: pressure error", error)
    for what, times in seconds.items():
        yield Line(f"{name}: {what}", 1e3 * statistics.median(times), "ms")
    if other is not None:
        other.end()
        yield Line(f"{name}: aspher: error", other.error)
        yield Line(f"{name}: aspher", 1e3 * statistics.median(theirs), "ms")
        for what, times in seconds.items():
            yield quartiles(f"{name}: aspher over {what}", [a / b for a, b in zip(theirs, times, strict=True)])


class _Other:
    """aspher in a process of its own, which solves when it is its turn, by the loosest tolerance that is enough."""

    def __init__(self, python: Path, given: dict[str, object], file: Path) -> None:
        self.tolerance, self.error = np.nan, np.inf
        np.savez(file, **given)  # type: ignore[arg-type]
        words = [str(python), "-c", TURN.format(attempt=ASPHER), str(file)]
        alone = {**os.environ, "OMP_NUM_THREADS": "1"}
        self._process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=alone)
        for tolerance in TOLERANCES:
            self.tolerance = tolerance
            self.turn()
            if self.error <= ERROR:
                return

    def turn(self) -> float:
        """Seconds of a solve."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(self.tolerance, file=self._process.stdin, flush=True)
        seconds, self.error = json.loads(self._process.stdout.readline())
        return float(seconds)

    def end(self) -> None:
        self._process.communicate()

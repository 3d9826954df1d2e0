"""Parts `start` and `scale` of scripts/bench.py: the command line, and one rank beside two."""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path

from bench_cold import Cold, pair
from bench_lines import Line, compare, interleave
from mpi4py import MPI

from parcontact.parallel.slab import Slab


def start(_: int, rounds: int, __: argparse.Namespace) -> Iterator[Line]:
    program = Path(sys.executable).with_name("parcontact")
    ways = {
        "import numpy": [sys.executable, "-c", "import numpy"],
        "parcontact --help": [program, "--help"],
        "parcontact --version": [program, "--version"],
    }
    calls = {
        name: lambda words=words: subprocess.run(words, check=True, capture_output=True) for name, words in ways.items()
    }
    yield from compare("start", interleave(calls, rounds, time.perf_counter), "import numpy")


def scale(points: int, rounds: int, asked: argparse.Namespace) -> Iterator[Line]:
    """Starts itself on two ranks."""
    words = [Path(sys.executable).with_name("mpirun"), "-n", "2", sys.executable, sys.argv[0], "--inside"]
    words += ["--points", str(points), "--rounds", str(rounds)]
    outside = {name: value for name, value in os.environ.items() if not name.startswith(("OMPI_", "PMIX_", "PRTE_"))}
    done = subprocess.run(list(map(str, words)), check=True, capture_output=True, text=True, env=outside)
    for line in json.loads(done.stdout.splitlines()[-1]):
        yield Line(**line)


def scale_inside(points: int, rounds: int) -> None:
    """On two ranks of the same node: rank 0 alone, then both; the other waits without keeping a core busy."""
    world = MPI.COMM_WORLD
    lines = list[Line]()
    for what, make in (
        ("transform", lambda comm: pair(Slab(comm, points, points), "float64")),
        ("solve", cold_solve(points)),
    ):
        alone = make(MPI.COMM_SELF) if world.rank == 0 else None
        together = make(world)
        times: dict[str, list[float]] = {f"{what} on 1 rank": [], f"{what} on 2 ranks": []}
        for _ in range(rounds):
            if alone is not None:
                times[f"{what} on 1 rank"].append(seconds(alone))
            arrival = world.Ibarrier()
            while not arrival.Test():
                time.sleep(1e-3)
            times[f"{what} on 2 ranks"].append(seconds(together))
        if world.rank == 0:
            lines += compare("scale", times, f"{what} on 1 rank")
    if world.rank == 0:
        print(json.dumps([asdict(line) for line in lines]))


def cold_solve(points: int) -> Callable[[MPI.Intracomm], Callable[[], object]]:
    def make(comm: MPI.Intracomm) -> Callable[[], object]:
        surface = Cold(points, comm)
        solver = surface.solver(1e-6)
        return lambda: surface.solve(solver)

    return make


def seconds(way: Callable[[], object]) -> float:
    began = time.perf_counter()
    way()
    return time.perf_counter() - began

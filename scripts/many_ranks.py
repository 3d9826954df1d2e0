"""A sliding run on many ranks of one machine: results as on one rank; bytes, messages and collectives counted.

    .venv/bin/python scripts/many_ranks.py [--ranks 8,16,33,64] [--points 128] [--boundary periodic]

More ranks than cores, on a small grid, tell nothing of time, but all of traffic. The bytes that transforms send have to
be those of the model, `parallel.fft.footprint`, to the byte over all ranks, and their exchanges those of its legs; all
bytes are those that runs count. A line for each number of ranks: the largest difference of friction, area and pressure
from one rank, relative; of a step, the operator calls and iterations, the bytes that all ranks send in transforms and
in rows of neighbours, and the largest part of one rank; of an iteration, its collectives. Rows are exchanged six times
in an iteration for each grid of cells that is dealt out, and as often beside these on any number of ranks. The last
line is what follows for TOLD ranks on a grid that is not run: counts of the model, and rows by their length. Ends with
1 if results differ by more than SAME, or counts from the model.

A rank that waits leaves its core to others. So the run is slow where other programs are busy: all four numbers take
some five minutes of CPU time, 64 ranks three minutes on two quiet cores, and ten beside other work.
"""

import argparse
import json
import math
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import runs
from mpi4py import MPI

from parcontact.job import Job
from parcontact.march.loop import March
from parcontact.parallel.fft import footprint, transform_name
from parcontact.parallel.pyramid import FEW
from parcontact.parallel.slab import Slab
from parcontact.parallel.transpose import count_legs
from parcontact.physics.convolution import padded_lengths
from parcontact.steady_sliding import start

SAME = 1e-7  # relative: solves to a tolerance of 1e-9, whose pressures agree to some 1e-8
OTHERS = ("Allgather", "bcast", "allgather", "alltoall")  # that a step may call
MINUTES = 20  # for one number of ranks
ROWS = 6  # exchanges of rows in an iteration for each grid of cells that is dealt out
TOLD = 1024, 16384  # ranks, and points along a side
Json = dict[str, Any]
Transforms = list[tuple[bool, str, int]]  # whether they are padded, their type and how many of them


class Counting(MPI.Intracomm):
    """A communicator that counts its collectives by name, and the bytes that exchanges send to other ranks: waves of
    transforms, and rows, which are sent as bytes."""

    made: Counter[str]

    def Alltoallv(self, sent: Any, received: Any) -> None:
        _, counts, kind = sent
        counts = list(counts[0] if isinstance(counts, tuple) else counts)
        what, size = ("rows", 1) if kind == "B" else ("transforms", kind.Get_size())
        self.made[f"exchanges of {what}"] += 1
        self.made[f"bytes of {what}"] += size * (sum(counts) - counts[self.rank])
        super().Alltoallv(sent, received)


def _counted(name: str) -> Any:
    def call(comm: Counting, *given: Any, **named: Any) -> Any:
        comm.made[name] += 1
        return getattr(MPI.Intracomm, name)(comm, *given, **named)

    return call


for each in OTHERS:
    setattr(Counting, each, _counted(each))


def job(points: int, boundary: str) -> Json:
    """Rubber that is pressed on a rough surface and slides by four cells."""
    branches = [{"modulus": 1e6, "relaxation_time": 10.0**power} for power in (-5, -4, -3)]
    slide = {"pressure": 2e4, "velocity": 1.0, "distance": 4e-2 / points, "cells_per_step": 1}
    waves = {"hurst": 0.8, "long_wavelength": 2.5e-3, "short_wavelength": 8e-2 / points, "rms_slope": 0.05, "seed": 1}
    return {
        "grid": {"points": points, "size": 1e-2, "boundary": boundary},
        "surface": {"shape": "rough", **waves},
        "material": {"model": "zener", "modulus_inf": 1e6, "branches": branches},
        "history": [{"pressure": 2e4}, slide],
        "numerics": {"tolerance": 1e-9},
    }


def march(asked: argparse.Namespace) -> Json:
    """What all ranks together find and count in the slide; the march is the same on any of them."""
    comm = Counting(MPI.COMM_WORLD)
    comm.made = Counter()
    read = Job.model_validate(job(asked.points, asked.boundary))
    slab = Slab(comm, *read.grid.points)
    made: March = start.first(read, slab)
    steps = made.steps()
    made.advance(next(steps))  # from nothing, on nested grids of their own
    before, called = slab.tally.copy(), comm.made.copy()
    rows = [made.advance(step) for step in steps]
    spent, called = slab.tally.since(before), comm.made - called
    pressure = slab.to_root(made.field("pressure"))
    made_transforms = [
        (padded, dtype, spent.get(transform_name(lengths, dtype), 0))
        for padded, lengths in enumerate((read.grid.points, padded_lengths(*read.grid.points)))
        for dtype in ("float64", "float32")
    ]
    sent = spent.get("bytes sent", 0)
    everyone = MPI.COMM_WORLD.gather((dict(called), sent, *model(asked.points, made_transforms, comm.size, comm.rank)))
    found = {"steps": len(rows), "calls": sum(row.operator_calls for row in rows), "transforms": made_transforms}
    found |= {"points": asked.points, "iterations": sum(row.iterations for row in rows)}
    found |= {"friction": [row.measures.friction for row in rows], "area": [row.measures.contact_area for row in rows]}
    if pressure is None or everyone is None:
        return {}
    return found | {"pressure": pressure[:: asked.points // 32].ravel().tolist(), "counts": everyone}


def model(points: int, transforms: Transforms, ranks: int, rank: int) -> tuple[int, int]:
    """Bytes that a rank sends in so many transforms of so many points along a side, and their exchanges, as planned."""
    total, legs, grid = 0, 0, (points, points)
    for padded, dtype, count in transforms:
        lengths = padded_lengths(*grid) if padded else grid
        total += count * footprint(grid, lengths, dtype, ranks, rank)[2]
        whole = lengths[1] * (lengths[0] // 2 + 1) * 2 * np.dtype(dtype).itemsize
        legs += count * count_legs(whole, ranks) if ranks > 1 else 0
    return total, legs


def dealt_grids(ranks: int) -> int:
    """Return how many grids of cells are dealt out to ranks: those with more cells than a FEW of a rank's points."""
    return math.ceil(math.log(FEW * ranks, 4))


def rows_beside(found: Json) -> int:
    """Exchanges of rows beside those of the grids of cells, which are as many on any number of ranks."""
    made: int = found["counts"][0][0]["exchanges of rows"]
    return made - ROWS * dealt_grids(len(found["counts"])) * found["iterations"]


def tell(found: Json) -> str:
    """Tell what follows for TOLD ranks from what fewer have found: counts of the model, and rows by their length."""
    (ranks, points), iterations, few = TOLD, found["iterations"], found["counts"]
    sent, legs = (count / iterations for count in model(points, found["transforms"], ranks, 0))
    exchanged = ROWS * dealt_grids(ranks) + rows_beside(found) / iterations
    rows = max(called["bytes of rows"] for called, *_ in few) / iterations * points / found["points"]
    sums, kilobytes = few[0][0]["Allgather"] / iterations, sent / legs / (ranks - 1) / 1e3
    return (
        f"{ranks} ranks on {points} x {points} points: an iteration {sums:.1f} Allgather, {exchanged:.1f} exchanges of "
        f"rows with {rows / 1e6:.2f} MB of one rank, {legs:.1f} exchanges of transforms with {sent / 1e6:.2f} MB "
        f"of one rank, in messages of {kilobytes:.2f} kB"
    )


def on_ranks(ranks: int, asked: argparse.Namespace) -> Json:
    """What so many ranks find. Raises RuntimeError if they do not end well."""
    words = [Path(sys.executable).with_name("mpirun"), "-n", ranks, sys.executable, __file__, "--inside"]
    words += ["--points", asked.points, "--boundary", asked.boundary]
    done = subprocess.run(
        list(map(str, words)), capture_output=True, text=True, env=runs.environment(), timeout=60 * MINUTES
    )
    if done.returncode:
        raise RuntimeError(f"{ranks} ranks: {done.stderr.strip()[-500:]}")
    found: Json = json.loads(done.stdout.splitlines()[-1])
    return found


def compare(found: Json, alone: Json) -> tuple[str, bool]:
    """A line of what ranks have found, and whether it is as it should be."""
    apart = max(
        float(np.abs(np.subtract(found[name], alone[name])).max() / np.abs(alone[name]).max())
        for name in ("friction", "area", "pressure")
    )
    steps, iterations, ranks = found["steps"], max(found["iterations"], 1), found["counts"]
    waves, rows = ([called.get(f"bytes of {what}", 0) for called, *_ in ranks] for what in ("transforms", "rows"))
    counted, modelled = (sum(rank[place] for rank in ranks) for place in (1, 2))  # of one rank as if all went from rows
    right = apart <= SAME and sum(waves) == modelled and sum(waves) + sum(rows) == counted
    right &= all(called.get("exchanges of transforms", 0) == legs for called, *_, legs in ranks)
    most = max(map(sum, zip(waves, rows, strict=True))) / steps
    made = {name: count for name, count in sorted(ranks[0][0].items()) if not name.startswith("bytes")}
    told = ", ".join(f"{count / iterations:.1f} {name}" for name, count in made.items())
    line = (
        f"{len(ranks):3} ranks: apart {apart:.1e}; a step {found['calls'] / steps:.1f} calls, "
        f"{found['iterations'] / steps:.1f} iterations, {sum(waves) / steps / 1e6:.3f} MB in transforms and "
        f"{sum(rows) / steps / 1e6:.3f} MB in rows, {most / 1e6:.4f} MB of one rank at most; an iteration {told}"
    )
    return line, right


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ranks", default="8,16,33,64", help="numbers of ranks, with commas")
    parser.add_argument("--points", type=int, default=128, help="along x and y, a multiple of 32")
    parser.add_argument("--boundary", choices=("periodic", "free"), default="periodic")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.inside:
        found = march(asked)
        if found:
            print(json.dumps(found))
        return 0
    alone, all_right, beside = on_ranks(1, asked), True, set[int]()
    for ranks in map(int, asked.ranks.split(",")):
        found = on_ranks(ranks, asked)
        line, right = compare(found, alone)
        beside.add(rows_beside(found))
        right &= len(beside) == 1
        print(line + "; WRONG" * (not right), flush=True)
        all_right &= right
    print(tell(found))
    return 0 if all_right else 1


if __name__ == "__main__":
    sys.exit(main())

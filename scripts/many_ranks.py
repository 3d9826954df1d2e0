"""A sliding run on many ranks of one machine: results as on one rank; bytes, messages and collectives counted.

    .venv/bin/python scripts/many_ranks.py [--ranks 8,16,33,64] [--points 128] [--boundary periodic]

More ranks than cores, on a small grid, tell nothing of time, but all of traffic. The bytes that transforms send have to
be those of the model, `parallel.fft.footprint`, to the byte over all ranks, and their exchanges those of its legs; all
bytes are those that runs count. A line for each number of ranks: the largest difference of friction, area and pressure
from one rank, relative; of a step, the operator calls and iterations, the bytes that all ranks send in transforms and
in rows of neighbours, and the largest part of one rank; of an iteration, its collectives. Ends with 1 if results differ
by more than SAME, or counts from the model.
"""

import argparse
import json
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
from parcontact.parallel import tally
from parcontact.parallel.fft import footprint, transform_name
from parcontact.parallel.slab import Slab
from parcontact.parallel.transpose import count_legs
from parcontact.physics.convolution import padded_lengths
from parcontact.steady_sliding import start

SAME = 1e-7  # relative: solves to a tolerance of 1e-9, whose pressures agree to some 1e-8
OTHERS = ("Allgather", "bcast", "allgather", "alltoall")  # that a step may call
MINUTES = 10  # for one number of ranks
Json = dict[str, Any]


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
    """Rubber that is pressed on a rough surface and slides by eight cells."""
    branches = [{"modulus": 1e6, "relaxation_time": 10.0**power} for power in (-5, -4, -3)]
    slide = {"pressure": 2e4, "velocity": 1.0, "distance": 8e-2 / points, "cells_per_step": 1}
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
    everyone = MPI.COMM_WORLD.gather((dict(called), spent.get("bytes sent", 0), *model(read, comm, spent)))
    found = {"steps": len(rows), "calls": sum(row.operator_calls for row in rows)}
    found |= {"iterations": sum(row.iterations for row in rows)}
    found |= {"friction": [row.measures.friction for row in rows], "area": [row.measures.contact_area for row in rows]}
    if pressure is None or everyone is None:
        return {}
    return found | {"pressure": pressure[:: asked.points // 32].ravel().tolist(), "counts": everyone}


def model(read: Job, comm: MPI.Intracomm, spent: tally.Tally | dict[str, int]) -> tuple[int, int]:
    """Bytes that this rank sends in the transforms that were counted, and their exchanges, as planned."""
    points, total, legs = read.grid.points, 0, 0
    for lengths in (points, padded_lengths(*points)):
        for dtype in (np.float64, np.float32):
            count = spent.get(transform_name(lengths, dtype), 0)
            total += count * footprint(points, lengths, dtype, comm.size, comm.rank)[2]
            whole = lengths[1] * (lengths[0] // 2 + 1) * 2 * np.dtype(dtype).itemsize
            legs += count * count_legs(whole, comm.size) if comm.size > 1 else 0
    return total, legs


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
    alone, all_right = on_ranks(1, asked), True
    for ranks in map(int, asked.ranks.split(",")):
        line, right = compare(on_ranks(ranks, asked), alone)
        print(line + "; WRONG" * (not right), flush=True)
        all_right &= right
    return 0 if all_right else 1


if __name__ == "__main__":
    sys.exit(main())

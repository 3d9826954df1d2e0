"""Costs of the program, in counts and in ratios measured within one run.

    .venv/bin/python scripts/bench.py [PART...] [--points 512] [--rounds 15] [--json FILE] [--peers DIRECTORY]

    solve    a cold elastic solve at 11 % contact to a pressure error of 1e-7, in double and mixed precision;
             peers: tamaas and aspher
    dilute   cold elastic solves in free boxes at 0.07 to 2 % contact on two and four times as many points;
             peers: aspher
    free     operator calls of cold solves in free boxes at 0.2 to 35 % contact to a pressure error of 1e-5: on
             512 x 512 points, and on finer and finer grids
    adhesion a cold adhesive elastic solve at 24 % contact to a pressure error of 1e-5; peers: tamaas and Adhesion
    slide    sliding over a rough surface with twelve branches, by one cell a step; peers: tamaas, with eight
    march    the velocity step of the paper's Fig. 8 on two ranks: a step over its transforms, and memory
    steady   steady sliding from a cold start, and along a curve of eight velocities per decade
    flow     leakage through the gap of a contact of 30 %, along x and along y: for --points 2048
    scale    a transform, a cold solve and a sliding step: times on two ranks over times on one
    stick    runs of jobs/stick with stick over the same runs without
    sizes    a cold solve and a sliding step on 256 x 256 points and on finer and finer grids, over N^2 log2 N
    large    a cold elastic solve at 8 % contact to a pressure error of 1e-5: for --points 8192

Operator calls on coarser grids count by their share of the points of the finest one. Times of one process are CPU
times; `march` and `scale` have wall times. Functions that are compared take turns in each round. Printed are the median
time, and the median and the quartiles of the ratios of each round. The error of pressures is the relative L2 distance
to a solution with a tolerance of 1e-11, the same for every program. The error of friction is the difference to steps
with a tolerance of 5e-5 (1e-7 for the comparison with other programs).

`--peers DIRECTORY` compares with these programs, and installs each there in its own environment. In
`solve`, `adhesion` and `slide` each has 7 minutes of CPU time to find the loosest tolerance with which it reaches the
error. The ratio of a program that does not reach it is "more than".
"""

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import runs
from bench.adhesive import adhesion
from bench.dilute import dilute, free
from bench.leakage import flow
from bench.scaling import WORLD, march, scale
from bench.slides import slide, steady
from bench.solves import large, sizes, solve
from bench.sticking import stick
from bench.table import Line

FEWEST = 64  # points along a side
BUSY = 0.5  # busy cores before the benchmark above which it warns
PARTS = {"solve": solve, "slide": slide, "steady": steady, "sizes": sizes, "large": large, "adhesion": adhesion}
PARTS |= {"dilute": dilute, "free": free, "flow": flow, "stick": stick}
ON_TWO_RANKS = {"march": march, "scale": scale}


def measure(parts: list[str], asked: argparse.Namespace) -> Iterator[tuple[str, Line]]:
    """Measure the parts of this process first, then the parts on two ranks."""
    for part in parts:
        if part in PARTS:
            yield from ((part, line) for line in PARTS[part](asked.points, asked.rounds, asked))
    if together := [part for part in parts if part in ON_TWO_RANKS]:
        yield from on_two_ranks(together, asked)


def on_two_ranks(parts: list[str], asked: argparse.Namespace) -> Iterator[tuple[str, Line]]:
    """Yield the lines of the parts that this script measures in a process of two ranks. Raises RuntimeError if that
    process fails."""
    words = [Path(sys.executable).with_name("mpirun"), "-n", 2, sys.executable, __file__, *parts, "--inside"]
    words += ["--points", asked.points, "--rounds", asked.rounds]
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, env=runs.environment())
    if done.returncode:
        raise RuntimeError(f"{', '.join(parts)} on two ranks: {done.stderr.strip()}")
    yield from ((line.pop("part"), Line(**line)) for line in json.loads(done.stdout.splitlines()[-1]))


def as_json(lines: list[tuple[str, Line]]) -> str:
    return json.dumps([{"part": part, **asdict(line)} for part, line in lines])


def arguments() -> argparse.Namespace:
    names = [*PARTS, *ON_TWO_RANKS]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "parts", nargs="*", metavar="PART", help=f"parts to measure, of {', '.join(names)} (default: all)"
    )
    parser.add_argument("--points", type=int, default=512, help="points along x and y")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--json", type=Path, help="write the lines into this file, too")
    parser.add_argument("--peers", type=Path, help="compare with other programs, installed into this directory")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if unknown := set(asked.parts) - set(names):
        parser.error(f"there is no part {', '.join(sorted(unknown))}; there are {', '.join(names)}")
    if asked.points < FEWEST:
        parser.error(
            f"--points must be {FEWEST} or more: the shortest wave has 16 points, the longest is a quarter of the box"
        )
    asked.parts = asked.parts or names
    return asked


def main() -> int:
    asked = arguments()
    if asked.inside:  # on two ranks
        seen = [(name, line) for name in asked.parts for line in ON_TWO_RANKS[name](asked.points, asked.rounds, asked)]
        if WORLD.rank == 0:
            print(as_json(seen))
        return 0
    if os.getloadavg()[0] > BUSY:
        print(f"WARNING: others keep {os.getloadavg()[0]:.1f} of {os.cpu_count()} cores busy: trust counts, not times")
    lines = list[tuple[str, Line]]()
    for part, line in measure(asked.parts, asked):
        print(f"{part:<9}{line}", flush=True)
        lines.append((part, line))
    if asked.json is not None:
        asked.json.write_text(as_json(lines) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""What the program costs, in counts and in ratios measured within one run.

    .venv/bin/python scripts/bench.py [PART...] [--points 512] [--rounds 15] [--json FILE] [--peers DIRECTORY]

    fft      a forward and a backward transform, over FFTW alone; planning them, the first time and again
    solve    a cold elastic solve at 11 % contact to a pressure error of 1e-7, in double and mixed precision, and peers'
    slide    sliding over a rough surface with twelve branches, by one cell a step; with peers, beside them with eight
    march    the velocity step of the paper's Fig. 8 on two ranks: a step over its transforms, and what it holds
    steady   steady sliding from a cold start, and along a curve of eight velocities per decade
    start    the command line, over an interpreter that only imports numpy
    traffic  what passes through memory in a cold iteration and in a sliding step, loop by loop, counted on one rank
    scale    a transform, a cold solve and a sliding step on two ranks, over one, by part; and what memory lets at most
    memory   bytes of a run as they are planned and held, and in maps
    sizes    a cold solve and a sliding step on 256 x 256 points and on ever finer grids, over N^2 log2 N
    large    a cold elastic solve at 8 % contact to a pressure error of 1e-5: for --points 8192

Operator calls are those on the finest grid, coarser ones counted by their share of its points. Times of one process are
CPU times, those of `march`, `scale` and `start` wall times. What is compared takes turns, round by round; shown are the
median, and of the ratios of each round the median and the quartiles. The pressure error is the relative L2 distance
from a solution to 1e-11, for every program alike, that of friction from steps to a tolerance of 5e-5, beside peers
1e-7. `--peers DIRECTORY` installs tamaas and aspher there, each in an environment of its own, and gives each 7 minutes
of CPU time for `solve` and for `slide` to find the loosest tolerance by which it reaches the error; one that does not
has a ratio of "more than".
"""

import argparse
import json
import os
import sys
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

from bench_cold import fft, solve
from bench_lines import Line
from bench_march import march
from bench_program import start
from bench_scale import on_two_ranks, scale, show_inside, traffic
from bench_sizes import large, sizes
from bench_sliding import held, slide, steady

FEWEST = 64  # points along a side
BUSY = 0.5  # cores at work before the benchmark, above which it warns
PARTS = {
    "fft": fft,
    "solve": solve,
    "slide": slide,
    "steady": steady,
    "start": start,
    "traffic": traffic,
    "memory": held,
    "sizes": sizes,
    "large": large,
}
ON_TWO_RANKS = {"march": march, "scale": scale}


def show(line: Line) -> str:
    spread = "" if line.low is None else f"   ({line.low:.3g} to {line.high:.3g})"
    return f"{line.part:<8}{line.what:<48}{line.value:>12.4g} {line.unit}{spread}"


def measure(parts: list[str], asked: argparse.Namespace) -> Iterator[Line]:
    """What this process can measure first, then what two ranks can."""
    for part in parts:
        if part in PARTS:
            yield from PARTS[part](asked.points, asked.rounds, asked)
    if together := [part for part in parts if part in ON_TWO_RANKS]:
        yield from on_two_ranks(together, asked.points, asked.rounds)


def main() -> int:
    names = [*PARTS, *ON_TWO_RANKS]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(names)}; all of them by default")
    parser.add_argument("--points", type=int, default=512, help="along x and y")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--json", type=Path, help="write the lines into this file, too")
    parser.add_argument("--peers", type=Path, help="compare with tamaas and aspher, installed into this directory")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.inside:
        show_inside(line for part in asked.parts for line in ON_TWO_RANKS[part](asked.points, asked.rounds))
        return 0
    if unknown := set(asked.parts) - set(names):
        parser.error(f"there is no part {', '.join(sorted(unknown))}; there are {', '.join(names)}")
    if asked.points < FEWEST:
        parser.error(f"--points must be {FEWEST} or more: the shortest wave has 16 of them, the longest a quarter")
    if os.getloadavg()[0] > BUSY:
        print(f"WARNING: others keep {os.getloadavg()[0]:.1f} of {os.cpu_count()} cores busy: trust counts, not times")
    lines = list[Line]()
    for line in measure(asked.parts or names, asked):
        print(show(line), flush=True)
        lines.append(line)
    if asked.json is not None:
        asked.json.write_text(json.dumps([asdict(line) for line in lines], indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""What the program costs, in counts and in ratios measured within one run.

    .venv/bin/python scripts/bench.py [PART...] [--points 512] [--rounds 15] [--json FILE] [--peers DIRECTORY]

    fft      a forward and a backward transform, over FFTW alone
    solve    a cold elastic solve at 11 % contact to a pressure error of 1e-7, in double and mixed precision, and peers'
    slide    sliding over a rough surface with twelve branches, by one cell a step
    steady   steady sliding from a cold start, and along a curve of eight velocities per decade
    start    the command line, over an interpreter that only imports numpy
    scale    a transform and a cold solve on two ranks, over one
    memory   bytes of a run as they are planned and held, and in maps

Operator calls are those on the finest grid, coarser ones counted by their share of its points. Times of one process are
CPU times, those of `scale` and `start` wall times. What is compared takes turns, round by round; shown are the median,
and of the ratios of each round the median and the quartiles. The pressure error is the relative L2 distance from a
solution to 1e-11, for every program alike, that of friction from steps to a tolerance of 5e-5. `--peers DIRECTORY`
installs tamaas and aspher there, each in an environment of its own, and gives each 7 minutes to reach the error.
"""

import argparse
import json
import os
import sys
from dataclasses import asdict
from pathlib import Path

from bench_cold import fft, solve
from bench_lines import Line
from bench_program import scale, scale_inside, start
from bench_sliding import held, slide, steady

BUSY = 0.5  # cores at work before the benchmark, above which it warns
PARTS = {"fft": fft, "solve": solve, "slide": slide, "steady": steady, "start": start, "scale": scale, "memory": held}


def show(line: Line) -> str:
    spread = "" if line.low is None else f"   ({line.low:.3g} to {line.high:.3g})"
    return f"{line.part:<8}{line.what:<48}{line.value:>12.4g} {line.unit}{spread}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; all of them by default")
    parser.add_argument("--points", type=int, default=512, help="along x and y")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--json", type=Path, help="write the lines into this file, too")
    parser.add_argument("--peers", type=Path, help="compare with tamaas and aspher, installed into this directory")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.inside:
        scale_inside(asked.points, asked.rounds)
        return 0
    if unknown := set(asked.parts) - set(PARTS):
        parser.error(f"there is no part {', '.join(sorted(unknown))}; there are {', '.join(PARTS)}")
    if os.getloadavg()[0] > BUSY:
        print(f"WARNING: others keep {os.getloadavg()[0]:.1f} of {os.cpu_count()} cores busy: trust counts, not times")
    lines = list[Line]()
    for part in asked.parts or PARTS:
        for line in PARTS[part](asked.points, asked.rounds, asked):
            print(show(line), flush=True)
            lines.append(line)
    if asked.json is not None:
        asked.json.write_text(json.dumps([asdict(line) for line in lines], indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Coverage of the error estimates: random scenes against references four times as fine at a tenth of the accuracy.

    .venv/bin/python scripts/coverage.py [--scenes 400] [--from 0] [--to out/coverage] [--processes 1] [--anew]
    .venv/bin/python scripts/coverage.py --figures [--to out/coverage]
    .venv/bin/python scripts/coverage.py --job NUMBER [--to out/coverage]

Elastic and viscoelastic bodies, five kinds of surfaces, periodic and free boxes, loads from 0.1 % of contact to all of
it, histories of nine kinds, 2 to 16 cells per shortest wave; numerics.accuracy from 0.3 to 10 %. Each scene becomes a
line of scenes.csv at once: run again, it goes on with those that lack. `coverage.md` has the figures and each miss by
name, `coverage.png` estimates over true errors, and `misses/` the jobs of the misses, with their maps, to run them.
References are kept in `references/`: `--anew` makes all runs again, but only the references that lack.

Scenes below 200 served to find the constants of the estimates; the others were not looked at before these were final.
Ends with 1 if less than 95 % of the scenes are as wrong as asked for at most, or said that they are not.
"""

import argparse
import csv
import json
import multiprocessing
import os
import sys
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"  # one process, one core

from coverage_figures import PARTS, Line, figures, misses, picture, read
from coverage_runs import QUANTITIES, compare
from coverage_scenes import Json, sketch

KEYS = ("", "_true", "_error", "_estimate", "_printed", "_resolution", *(f"_{part}" for part in PARTS))
COLUMNS = (
    *("scene", "body", "surface", "boundary", "history", "cells", "asked", "points", "steps", "seconds"),
    *("reference_seconds", *(f"{name}{key}" for name in QUANTITIES for key in KEYS), "failure"),
)


def go(numbers: Iterable[int], to: Path, processes: int, anew: bool) -> None:
    """Add the lines that lack to the table."""
    table = to / "scenes.csv"
    if anew:
        table.unlink(missing_ok=True)
    to.mkdir(parents=True, exist_ok=True)
    known = {int(line["scene"]) for line in read(table)}
    lacking = [number for number in numbers if number not in known]
    if known:
        print(f"{len(known)} scenes are there already")
    else:
        table.write_text(",".join(COLUMNS) + "\n")
    began = time.monotonic()
    with table.open("a", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        for count, line in enumerate(_made(lacking, to / "references", processes), start=1):
            writer.writerow({key: line.get(key, "") for key in COLUMNS})
            file.flush()
            if count % 20 == 0 or count == len(lacking):
                print(f"{count} of {len(lacking)} scenes, {time.monotonic() - began:.0f} s", flush=True)


def _made(numbers: list[int], references: Path, processes: int) -> Iterator[Json]:
    """Lines as they are ready."""
    if processes == 1:
        yield from (compare(number, references) for number in numbers)
        return
    with ProcessPoolExecutor(processes, multiprocessing.get_context("spawn")) as pool:
        for done in as_completed([pool.submit(compare, number, references) for number in numbers]):
            yield done.result()


def write_job(number: int, to: Path) -> Path:
    """A job file, which `parcontact` runs, and its map if it has one."""
    to.mkdir(parents=True, exist_ok=True)
    path = to / f"scene_{number}.yaml"
    path.write_text(json.dumps(sketch(number).job(to.resolve()), indent=1) + "\n")
    return path


def conclude(to: Path) -> bool:
    """Figures, picture, jobs of the misses; whether as many as promised are covered."""
    lines: list[Line] = read(to / "scenes.csv")
    text, kept = figures(lines)
    (to / "coverage.md").write_text(text)
    print(text)
    picture(lines, to / "coverage.png")
    for number in misses(lines):
        write_job(number, to / "misses")
    print(f"written: {to / 'coverage.md'}, {to / 'coverage.png'}")
    return kept


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=400)
    parser.add_argument("--from", dest="first", type=int, default=0)
    parser.add_argument("--to", type=Path, default=Path("out/coverage"))
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--anew", action="store_true", help="make all runs again; references are kept")
    parser.add_argument("--figures", action="store_true", help="only the figures of the scenes that are there")
    parser.add_argument("--job", type=int, help="only write the job of this scene")
    given = parser.parse_args()
    if given.job is not None:
        print(write_job(given.job, given.to))
        return 0
    if not given.figures:
        go(range(given.first, given.first + given.scenes), given.to, given.processes, given.anew)
    return 0 if conclude(given.to) else 1


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Random scenes by the hundred: bodies, surfaces, histories and grids as hard as they come; nothing may break.

    .venv/bin/python scripts/random_scenes.py [--scenes 500] [--steps 20000] [--seed 0] [--from 0]
    .venv/bin/python scripts/random_scenes.py --long [--steps 100000]
    .venv/bin/python scripts/random_scenes.py --mixed [--scenes 250] [--seed 77]

Each scene is marched twice, the second time told in another way (raised, in other units, mirrored, transposed), until
there are at least so many scenes and steps. Every step is checked as in tests/robustness/witness.py. A solve that asks
for more digits than double precision has may fail, and is counted; no other may. `--long` marches one small scene back
and forth for so many steps and looks for drift, as tests/robustness/test_long.py does for fewer. Ends with 0 if all
held; a scene that did not is made again by `--from ITS_NUMBER --scenes 1 --steps 0` with the same seed.
`--mixed` counts in how many scenes mixed precision fails, or gives a contact area off by more than 1 %, where double
precision solves them, all at the default tolerance.
"""

import argparse
import sys
import tempfile
import time
import warnings
from collections import Counter
from dataclasses import replace
from pathlib import Path
from random import Random

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from robustness import histories
from robustness.scenes import Sketch, sketch
from robustness.trial import Trial, trial

from parcontact.errors import RunError
from parcontact.job import Numerics
from parcontact.parallel.slab import Slab
from parcontact.steady_sliding import start

Map = NDArray[np.float64]
WRONG = 0.01  # of the largest contact area

TOLD = 50  # scenes between two lines of progress


def campaign(scenes: int, steps: int, seed: int, first: int) -> bool:
    """March scenes numbered from `first`; whether all is well."""
    counts: Counter[str] = Counter()
    worst: dict[str, tuple[float, int]] = {"iterations": (0.0, first), "distance": (0.0, first)}
    began, number = time.monotonic(), first
    with tempfile.TemporaryDirectory() as directory:
        while number - first < scenes or counts["steps"] < steps:
            found = made(seed, number, Path(directory))
            if found is None:
                counts["violations"] += 1
            else:
                counts += found.counts
                worst["iterations"] = max(worst["iterations"], (found.iterations, number))
                worst["distance"] = max(worst["distance"], (found.distance, number))
            number += 1
            if (number - first) % TOLD == 0:
                print(f"{number - first:6} scenes  {verdict(counts)}  {time.monotonic() - began:.0f} s", flush=True)
    print(f"{number - first} scenes: {verdict(counts)}")
    iterations, distance = worst["iterations"], worst["distance"]
    print(f"most iterations {iterations[0]:g} (scene {iterations[1]}), largest distance of twins {distance[0]:.2g} of")
    print(f"what their certificates allow (scene {distance[1]})")
    return counts["violations"] == 0 and counts["failed"] == 0


def made(seed: int, number: int, directory: Path) -> Trial | None:
    """One trial, its faults printed; None if it ended with an exception."""
    try:
        found = trial(Random(f"{seed} {number}"), directory)
    except Exception as error:
        print(f"scene {number}: {type(error).__name__}: {error}")
        return None
    for sentence in [*found.failures, *found.violations[:3]]:
        print(f"scene {number} ({found.about}): {sentence}")
    return found


def beside_double(scenes: int, seed: int, first: int) -> None:
    """How many scenes mixed precision does not solve that double precision does, or solves otherwise."""
    counts: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as directory:
        for number in range(first, first + scenes):
            scene = sketch(Random(f"{seed} {number}"))
            (double, failed), (other, fails) = (areas(scene, Path(directory), name) for name in ("double", "mixed"))
            count = min(len(double), len(other))
            counts["fails"] += fails and not failed
            counts["wrong"] += bool(
                np.any(np.abs(double[:count] - other[:count]) > WRONG * np.max(double, initial=0.0))
            )
    print(f"mixed precision, {scenes} scenes: {counts['fails']} fail, the area of {counts['wrong']} is wrong")


def areas(made: Sketch, directory: Path, precision: str) -> tuple[Map, bool]:
    """The contact area after each step, and whether a step failed."""
    numerics = {**made.numerics, "precision": precision, "tolerance": Numerics().tolerance}
    planned = replace(made, numerics=numerics, energy=False).job(directory)
    march = start.first(planned, Slab(MPI.COMM_SELF, *planned.grid.points))
    found = []
    try:
        for step in march.steps():
            found.append(march.advance(step).measures.contact_area)
    except RunError:
        return np.array(found), True
    return np.array(found), False


def verdict(counts: Counter[str]) -> str:
    return (
        f"{counts['steps']} steps, {counts['violations']} violations, {counts['failed']} failed solves, "
        f"{counts['beyond']} beyond double precision, {counts['retries']} retries"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=500)
    parser.add_argument("--steps", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--from", type=int, default=0, dest="first")
    parser.add_argument("--long", action="store_true")
    parser.add_argument("--mixed", action="store_true")
    asked = parser.parse_args()
    if asked.mixed:
        warnings.simplefilter("ignore")
        beside_double(asked.scenes, asked.seed, asked.first)
        return 0
    warnings.simplefilter("error")
    if asked.long:
        return 0 if histories.campaign(asked.steps or 100_000) else 1
    steps = 20_000 if asked.steps is None else asked.steps
    return 0 if campaign(asked.scenes, steps, asked.seed, asked.first) else 1


if __name__ == "__main__":
    sys.exit(main())

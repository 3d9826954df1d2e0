#!/usr/bin/env python3
"""Hundreds of random scenes with difficult bodies, surfaces, histories and grids; no run may fail.

    .venv/bin/python scripts/random_scenes.py [--scenes 500] [--steps 20000] [--seed 0] [--only NUMBER --steps 0]
    .venv/bin/python scripts/random_scenes.py --long [--steps 100000]
    .venv/bin/python scripts/random_scenes.py --mixed [--scenes 250] [--seed 77]

Each scene is marched twice, the second time in another description (raised, in other units, mirrored, transposed),
until the given numbers of scenes and steps are reached. Every step is checked as in tests/robustness/witness.py. Only a
solve that needs more digits than double precision has may fail; such failures are counted. `--long` marches one small
scene back and forth for a given number of steps and looks for drift, as tests/robustness/test_long.py does for fewer.
The exit code is 0 without faults. `--mixed` counts the scenes, at the default tolerance, that double precision solves
and mixed precision does not, or with a contact area that differs by more than 1 %.
"""

import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from random import Random

import campaign
import numpy as np
from numpy.typing import NDArray
from runs import ROOT, begun, marched

sys.path.insert(0, str(ROOT / "tests"))

from robustness import histories
from robustness.scenes import Sketch, sketch
from robustness.witness import trial

from parcontact.errors import RunError
from parcontact.job import Numerics

WRONG = 0.01  # difference of areas over the largest contact area


def twins(directory: Path, counts: Counter[str], seed: int, number: int) -> Iterator[str]:
    """March a scene and its twin."""
    found = trial(Random(f"{seed} {number}"), directory)
    counts.update(found.counts)
    counts["most iterations"] = max(counts["most iterations"], found.iterations)
    apart = "% of the difference that certificates allow, at most"
    counts[apart] = max(counts[apart], round(100 * found.distance))
    failures = found.failures if found.counts["failed"] else []  # without failures beyond double precision
    wrong = found.violations[:3] + failures
    yield from (f"({found.about}): {sentence}" for sentence in wrong)


def compare_with_double(directory: Path, counts: Counter[str], seed: int, number: int) -> Iterator[str]:
    """Count a scene that double precision solves, if mixed precision fails or gives another contact area."""
    scene = sketch(Random(f"{seed} {number}"))
    (double, failed), (other, fails) = (areas(scene, directory, name) for name in ("double", "mixed"))
    both = min(len(double), len(other))
    off = np.abs(double[:both] - other[:both]) > WRONG * np.max(double, initial=0.0)
    counts["fail in mixed precision"] += fails and not failed
    counts["have another area"] += bool(np.any(off))
    yield from ()


def areas(made: Sketch, directory: Path, precision: str) -> tuple[NDArray[np.float64], bool]:
    """Return the contact area after each step, and True if a step failed."""
    numerics = {**made.numerics, "precision": precision, "tolerance": Numerics().tolerance}
    found = list[float]()
    try:
        march = begun(replace(made, numerics=numerics, energy=False).job(directory))
        marched(march, lambda now: found.append(now.row.measures.contact_area))
    except RunError:
        return np.array(found), True
    return np.array(found), False


def main() -> int:
    options = campaign.parser(
        __doc__,
        trials=500,
        what="scenes",
        steps=(-1, "least number of steps (20000; 100000 with --long)"),
        long=(False, "march one scene back and forth"),
        mixed=(False, "mixed precision compared with double"),
    )
    asked, counts = options.parse_args(), Counter[str]()
    warnings.simplefilter("ignore" if asked.mixed else "error")
    if asked.long:
        return 0 if histories.campaign(asked.steps if asked.steps >= 0 else 100_000) else 1
    steps = asked.steps if asked.steps >= 0 else 20_000
    with tempfile.TemporaryDirectory() as directory:
        made = partial(compare_with_double if asked.mixed else twins, Path(directory), counts, asked.seed)
        faulty = campaign.go(asked, made, counts, lambda: not asked.mixed and counts["steps"] < steps)
    return 1 if faulty else 0


if __name__ == "__main__":
    sys.exit(main())

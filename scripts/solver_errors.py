#!/usr/bin/env python3
"""Errors of friction and area by the tolerance of the solver in random marches, against a tolerance of EXACT.

    .venv/bin/python scripts/solver_errors.py [--marches 20] [--seed 0] [--from 0] [--only NUMBER]

The marches are those of `march_errors`, with steps of one cell on one mesh, so that all other errors are the same. For
each tolerance the table has the median of true errors, and of the part `solver` of the error budget over them with the
range of 90 % of the steps, and the share of the steps in which it is at least the true error. Rows `lossless` have
friction of the same marches if the body loses FAINT times as much. SOLVER, SOLVER_AREA, PENETRATING and NOISE
(`lossless`) of `march.budget` are judged by it; an estimate grows in proportion to its constant.
"""

import sys
import warnings
from collections import Counter
from collections.abc import Iterator
from typing import Any

import campaign
import numpy as np
from march_errors import march_of
from numpy.typing import NDArray
from runs import begun, marched

EXACT, TOLERANCES = 1e-8, (3e-2, 1e-2, 1e-3, 1e-4)
FAINT = 1e-4  # moduli of the branches of a body that loses hardly anything, over those of the march
ROUNDING = 1e-9  # least true error that counts
Table = dict[tuple[str, float], list[tuple[float, float]]]  # estimates and true errors, by quantity and tolerance


def run(job: dict[str, Any], tolerance: float) -> dict[str, NDArray[np.float64]]:
    """Return values and estimates of friction and area in all steps that slide."""
    history = [{**stage, "cells_per_step": 1} for stage in job["history"]]
    rows, _ = marched(begun({**job, "history": history, "numerics": {"tolerance": tolerance, "branch_error": 0.0}}))
    kept = [
        (row.step, row.measures.friction, row.measures.contact_area_corrected, friction.solver, errors.area.solver)
        for row in rows
        if (errors := row.errors) and (friction := errors.friction)
    ]
    names = "step", "friction", "area", "friction estimate", "area estimate"
    return dict(zip(names, np.array(kept, float).T, strict=True))


def compare(seed: int, found: Table, number: int) -> Iterator[str]:
    """Add the estimates and errors of a march to a table."""
    job = march_of(seed, number)
    branches = [{**branch, "modulus": FAINT * branch["modulus"]} for branch in job["material"]["branches"]]
    faint = {**job, "material": {**job["material"], "branches": branches}}
    for name, scene in (("friction", job), ("area", job), ("lossless", faint)):
        column, exact = "friction" if name == "lossless" else name, run(scene, EXACT)
        for tolerance in TOLERANCES:
            mine = run(scene, tolerance)
            _, here, there = np.intersect1d(mine["step"], exact["step"], return_indices=True)
            errors = np.abs(mine[column][here] / exact[column][there] - 1.0)
            pairs = zip(mine[f"{column} estimate"][here].tolist(), errors.tolist(), strict=True)
            found.setdefault((name, tolerance), []).extend(pair for pair in pairs if pair[1] > ROUNDING)
    yield from ()


def table(found: Table) -> Iterator[str]:
    yield f"{'':10} {'tolerance':>9} {'steps':>6} {'error':>8} {'estimate over error':>24} {'at least':>9}"
    for (name, tolerance), pairs in sorted((key, pairs) for key, pairs in found.items() if pairs):
        estimates, errors = np.array(pairs).T
        low, middle, high = np.quantile(estimates / errors, (0.05, 0.5, 0.95))
        share = np.mean(estimates >= errors)
        ratio = f"{middle:.3g}, {low:.2g} to {high:.3g}"
        yield f"{name:10} {tolerance:9g} {len(errors):6} {np.median(errors):8.2g} {ratio:>24} {share:9.2f}"


def main() -> int:
    asked = campaign.parser(__doc__, trials=20, what="marches").parse_args()
    warnings.simplefilter("ignore")
    found: Table = {}
    faulty = campaign.go(asked, lambda number: compare(asked.seed, found, number), Counter())
    print(*table(found), sep="\n")
    return 1 if faulty else 0


if __name__ == "__main__":
    sys.exit(main())

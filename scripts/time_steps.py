"""Whether steps that choose themselves keep what numerics.accuracy asks for, and what that costs.

    .venv/bin/python scripts/time_steps.py [points] [scene ...] [--accuracies 0.05 ...] [--ladder 4 2 1 ...]

Each scene is marched with `time_step: auto` at an accuracy of 5, 1 and 0.3 %, and with a ladder of steps made by hand:
a cell of sliding per step, or a factor of 1.2 at rest, and finer and coarser ones. The reference has the finest steps,
a half of the finest of the ladder, and a hundredth of the tolerance. The mesh is the same throughout. Printed are the
errors of the highest friction, of its mean over the last three quarters of the slide (dynamic), and of the mean contact
area there, each over the accuracy asked for; and the operator calls, over those of the cheapest rung of the ladder that
keeps all three within the accuracy.
"""

import argparse
from typing import NamedTuple

import numpy as np
from runs import Json, begun, marched
from sample_scenes import SOLID, cylinder, rough, slide, sphere

from parcontact.job import Grid
from parcontact.summary.slide import mean_over_end

ACCURACIES = (0.05, 0.01, 0.003)
LADDER = (4.0, 2.0, 1.0, 0.5, 0.25, 0.125, 0.0625)  # cells per step, the finest one last
REST = {"first": 1e-3, "growth": 1.2}  # of the duration
JUMPING = ("velocity step", "dwell, then slide", "sphere", "cylinder")


class Found(NamedTuple):
    """Of one run: highest and dynamic friction, mean corrected area of the last slide; operator calls and steps."""

    highest: float
    dynamic: float
    area: float
    calls: int
    steps: int


def scenes(points: int) -> dict[str, Json]:
    cell, rest = 1e-3 / points, {"duration": 1e-2}
    steady = {"state": "steady", "velocity": 0.1, "pressure": 2e4}
    on = slide(1.0, 48 * cell)
    return {
        "sphere": sphere(points, rest, slide(0.046765, 24 * 6e-3 / points)),
        "cylinder": {**cylinder(points, slide(0.2, 96 * cell)), "initial": steady},
        "rough, 0.4 %": rough(points, 1e2, on, steady_at=1.0),
        "rough, 8 %": rough(points, 2e3, on, steady_at=1.0),
        "rough, 60 %": rough(points, 2e4, on, steady_at=1.0),
        "rough, 99 %": rough(points, 1e5, on, steady_at=1.0),
        "velocity step": rough(
            points, 1e5, slide(3.0, 64 * cell), material={"include": "synthetic_tyre"}, steady_at=0.01
        ),
        "dwell, then slide": rough(points, 1e4, rest, slide(0.1, 32 * cell)),
        "one branch": rough(points, 2e4, slide(0.1, 48 * cell), material=SOLID, steady_at=0.1),
    }


def by_hand(history: list[Json], cells: float, cell: float, jumps: bool) -> list[Json]:
    """The stages of a history in steps of so many cells; sliding begins with short ones if the velocity jumps."""
    made = list[Json]()
    for stage in history:
        if "velocity" not in stage:
            first, growth = stage["duration"] * REST["first"] * cells, REST["growth"] ** cells
            made.append({**stage, "time_step": {"first": first, "growth": growth}})
            continue
        if jumps:
            first = {"first": 1e-3 * cells * cell / stage["velocity"], "growth": 1.2**cells}
            made.append({**stage, "distance": 8.0 * cell, "time_step": first})
            stage = {**stage, "distance": stage["distance"] - 8.0 * cell}
        made.append({**stage, "cells_per_step": cells})
    return made


def march(data: Json, history: list[Json], **numerics: float) -> Found:
    rows, _ = marched(begun({**data, "history": history, "numerics": numerics}))
    x = np.array([row.distance for row in rows])
    friction = np.array([row.measures.friction for row in rows])
    area = np.array([row.measures.contact_area_corrected for row in rows])
    during = x >= 1e-9 * x[-1] if x[-1] > 0.0 else x >= 0.0
    during[int(np.argmax(during)) - 1] |= not during[0]
    x, friction, area = x[during], friction[during], area[during]
    calls = sum(row.operator_calls for row in rows[1:])
    highest = float(friction[1:].max())
    return Found(highest, mean_over_end(x, friction), mean_over_end(x, area), calls, len(rows) - 1)


def errors(found: Found, exact: Found) -> list[float]:
    """Relative errors of highest and dynamic friction and of area."""
    return [abs(a / b - 1.0) for a, b in zip(found[:3], exact[:3], strict=True)]


def compare(data: Json, name: str, accuracies: tuple[float, ...], ladder: tuple[float, ...]) -> list[float]:
    """Print the lines of a scene; error over accuracy and cost over the best by hand, of each accuracy."""
    cell = Grid.model_validate(data["grid"]).dx

    def hand(cells: float, **numerics: float) -> Found:
        return march(data, by_hand(data["history"], cells, cell, name in JUMPING), **numerics)

    exact = hand(ladder[-1] / 2.0, tolerance=5e-3 * 1e-2, branch_error=1e-4)
    ratios = list[float]()
    for accuracy in accuracies:
        rungs = [hand(cells, accuracy=accuracy) for cells in ladder]
        good = [rung.calls for rung in rungs if max(errors(rung, exact)) <= accuracy]
        found = march(data, data["history"], accuracy=accuracy)
        wrong = [error / accuracy for error in errors(found, exact)]
        cost = found.calls / min(good) if good else float("nan")
        ratios += [max(wrong), cost]
        shares = "".join(f"{share:9.2f}" for share in wrong)
        print(f"{name:20}{accuracy:8.3g}{shares}{found.steps:8d}{found.calls:8d}{cost:8.2f}", flush=True)
    return ratios


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("points", type=int, nargs="?", default=128)
    parser.add_argument("scenes", nargs="*", help=f"of {', '.join(scenes(128))}")
    parser.add_argument("--accuracies", type=float, nargs="+", default=ACCURACIES)
    parser.add_argument("--ladder", type=float, nargs="+", default=LADDER)
    asked = parser.parse_args()
    heads = ("error over accuracy", "accuracy", "highest", "dynamic", "area", "steps", "calls", "cost")
    print("{:20}{:>8}{:>9}{:>9}{:>9}{:>8}{:>8}{:>8}".format(*heads))
    ratios = list[float]()
    for name, data in scenes(asked.points).items():
        if not asked.scenes or name in asked.scenes:
            ratios += compare(data, name, asked.accuracies, asked.ladder)
    shares, costs = np.array(ratios[::2]), np.array(ratios[1::2])
    known = costs[np.isfinite(costs)]
    print(f"error over accuracy: {shares.max():.2f} at most, {np.median(shares):.2f} in the median; ", end="")
    print(f"cost over the best by hand: {known.max():.2f} at most, {np.median(known):.2f} in the median")


if __name__ == "__main__":
    main()

"""Part `stick`: runs whose contact sticks and slips, over the same runs without stick."""

import argparse
from collections.abc import Iterator
from typing import Any

import yaml
from runs import ROOT, Json, begun, marched

from .table import Line, quartiles

HIGH = {"history.0.pressure": 1e6, "history.1.pressure": 1e6}
SLOW = {"history.1.velocity": 1e-3}
CASES: dict[str, tuple[str, float, Json]] = {  # job, way of a step in cells, replaced keys
    "block, steps of 1/100 cell": ("block", 0.01, SLOW),
    "block, steps of 1/20 cell": ("block", 0.05, SLOW),
    "block, accuracy 1 %": ("block", 0.05, {**SLOW, "numerics.accuracy": 0.01}),
    "block, nearly full contact": ("block", 0.01, {**HIGH, **SLOW}),
    "tyre": ("tyre", 0.1, {}),
}


def stick(points: int, rounds: int, _: argparse.Namespace) -> Iterator[Line]:
    """Yield operator calls of runs of `jobs/stick`, with stick over without, and ratios of their CPU times."""
    for name, (job, way, sets) in CASES.items():
        calls, ratios = [0.0, 0.0], list[float]()
        for _round in range(max(rounds // 5, 1)):
            seconds = [0.0, 0.0]
            for sticks in (True, False):
                rows, clock = marched(begun(_job(job, sticks, way), {**sets, "grid.points": points}))
                calls[sticks] = sum(row.operator_calls for row in rows)
                seconds[sticks] = clock[-1] - clock[0]
            ratios.append(seconds[True] / seconds[False])
        yield Line(f"{name}: operator calls per step", calls[True] / len(rows))
        yield Line(f"{name}: calls over those without stick", calls[True] / calls[False])
        yield quartiles(f"{name}: time over that without stick", ratios)


def _job(name: str, sticks: bool, way: float) -> dict[str, Any]:
    """Return a job of `jobs/stick` without its sweep and outputs, with equal steps where it chooses them."""
    job = yaml.safe_load((ROOT / "jobs" / "stick" / f"{name}.yaml").read_text())
    job["interface"]["stick"] = sticks
    for stage in job["history"]:
        if stage.get("time_step") == "auto":
            del stage["time_step"]
            stage["cells_per_step"] = way
    return {key: value for key, value in job.items() if key not in ("sweep", "output")}

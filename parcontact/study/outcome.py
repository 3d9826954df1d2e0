"""Outcomes of the cases of a study, and their table study.csv: a row per finished case, with errors once all are
finished."""

import contextlib
import csv
import math
import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from itertools import pairwise
from pathlib import Path
from typing import Any

from ..columns import STUDY, names_of, to_csv
from ..errors import InputError
from ..job import AUTO, Job
from ..march import loop
from ..march.loop import March
from ..parallel.slab import Slab
from ..parallel.tally import Tally
from ..steady_sliding import start
from ..storage import files
from ..storage.step_row import StepRow
from .ladders import Settings

LAST_SHARE = 0.25  # accuracy: last share of the last sliding (or lasting) stage, over which means are taken


@dataclass(frozen=True)
class Outcome:
    """Outcome of a run: the largest friction, means of friction and contact area over the last quarter of the last
    sliding stage, and its costs on all ranks.

    `transform_work` is the sum of `N log2 N` over all transforms of N points, which does not depend on the machine.
    """

    mu_max: float
    mu_end: float
    area: float
    area_corrected: float
    steps: int
    operator_calls: int
    transform_work: float
    cpu_seconds: float


QUANTITIES = ("mu_max", "mu_end", "area", "area_corrected")
SETTINGS, RESULTS = (tuple(field.name for field in fields(kind)) for kind in (Settings, Outcome))
COLUMNS = names_of(STUDY)  # the fingerprint, settings, results and errors
COUNTS = ("mesh", "steps", "operator_calls")


def march_through(job: Job, slab: Slab, stopped: Callable[[], bool]) -> Outcome | None:
    """March through a job without writing files; None if `stopped()` after a step; collective."""
    marching = start.first(job, slab)
    rows: list[StepRow] = []

    def note(state: March) -> bool:
        rows.append(state.row)
        return slab.reduce((), [float(stopped())])[0] > 0.0

    began, tally = time.process_time(), slab.tally.copy()
    if loop.run_steps(marching, [note]):
        return None
    counted = Tally(slab.tally.since(tally))
    seconds = slab.sum(time.process_time() - began)[0]
    return Outcome(*settled(job, rows), len(rows) - 1, counted["operator"], transform_work(counted), seconds)


def settled(job: Job, rows: Sequence[StepRow]) -> tuple[float, float, float, float]:
    """Return mu_max, mu_end, area and corrected area of a run from its rows."""
    end = rows[-1].time
    lasting = [stage for stage in job.history if stage.seconds > 0.0]
    sliding = [stage for stage in lasting if stage.speed > 0.0]
    last = (sliding or lasting or job.history)[-1]
    for stage in reversed(job.history):  # later stages are ignored
        if stage is last:
            break
        end -= stage.seconds
    start = end - LAST_SHARE * last.seconds
    inside = [(row, row.time - before.time) for before, row in pairwise(rows) if start <= row.time]
    inside = [(row, dt) for row, dt in inside if row.time <= end * (1.0 + 1e-9)] or [(rows[-1], 1.0)]
    weights = [dt or 1e-300 for _, dt in inside]

    def mean(name: str) -> float:
        values = [getattr(row.measures, name) for row, _ in inside]
        return math.fsum(w * v for w, v in zip(weights, values, strict=True)) / math.fsum(weights)

    largest = max(row.measures.friction for row in rows)
    return largest, mean("friction"), mean("contact_area"), mean("contact_area_corrected")


def transform_work(counted: Tally) -> float:
    """Return the sum of `N log2 N` over transforms, from counts like `fft 2048x2048 float64`."""
    total = 0.0
    for name, count in counted.items():
        if match := re.match(r"fft (\d+)x(\d+) ", name):
            points = int(match[1]) * int(match[2])
            total += count * points * math.log2(max(points, 2))
    return total


# -- study.csv --------------------------------------------------------------------------------------------------------


def read_outcomes(path: Path, wanted: Mapping[Settings, str]) -> dict[Settings, Outcome]:
    """Return the outcomes of wanted cases from an existing table, if the fingerprints of their jobs agree. Raises
    InputError for a file that is no table."""
    found = {}
    try:
        with contextlib.suppress(FileNotFoundError), path.open(newline="", encoding="utf-8") as file:
            for row in csv.DictReader(line for line in file if line.endswith("\n")):
                if set(row) == set(COLUMNS) and None not in row.values():
                    settings = Settings(**{name: _value(name, row[name]) for name in SETTINGS})
                    if wanted.get(settings) == row["fingerprint"]:
                        found[settings] = Outcome(**{name: _value(name, row[name]) for name in RESULTS})
    except (ValueError, csv.Error) as error:
        raise InputError(f"{path} cannot be read: {error}; correct it, or move it away") from error
    return found


def write_outcomes(
    path: Path,
    fingerprints: Mapping[Settings, str],
    outcomes: Mapping[Settings, Outcome],
    errors: Mapping[Settings, Mapping[str, float]] | None = None,
) -> None:
    """Write the table of all outcomes."""
    rows = []
    for settings, outcome in outcomes.items():
        given = (AUTO if value is None else value for value in astuple(settings))
        missed = [errors[settings].get(name) if errors else None for name in QUANTITIES]
        rows.append([fingerprints[settings], *given, *astuple(outcome), *missed])
    files.replace_file(path, to_csv(COLUMNS, rows))


def _value(name: str, text: str) -> Any:
    if name == "integrator":
        return text
    return None if text == AUTO else int(text) if name in COUNTS else float(text)

"""What an output directory holds: what ran there, how far it came, and what came out."""

import math
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

from ..errors import InputError
from ..job.resolved import RESOLVED, shown_job
from ..storage import checkpoint, curve_points, hdf5, marker, measures
from ..storage.console import warnings_of
from ..storage.marker import Claim
from . import slide, sweep_table, theory_settings

MEAN_OF = ("friction", "contact_area")


def describe(directory: Path) -> tuple[str, bool]:
    """Text about a directory, and whether all that was looked at can be read; raises InputError where nothing is."""
    try:
        claims = marker.read(directory)
    except (OSError, ValueError) as error:
        return f"{directory}: {hdf5.reason(error)}", False
    if not claims and not any((directory / name).exists() for name in ("measures.csv", sweep_table.TABLE)):
        raise InputError(f"{directory} holds no run: it has no marker, no measures.csv and no {sweep_table.TABLE}")
    lines, problems = [f"{directory}: {_title(directory)}"], list[str]()
    for part in (_run, _theory, _curve, _checkpoints, _fields, _sweep, _study):
        try:
            lines += part(directory, claims)
        except InputError as error:
            problems.append(f"  {error}")
        except hdf5.FAILURES as error:
            problems.append(f"  {directory}: {hdf5.reason(error)}")
    return "\n".join([*lines, *problems]), not problems


def _title(directory: Path) -> str:
    """The title of the job, from the first of its copies that there is."""
    cases = sorted(path.name for path in directory.glob("cases/*"))
    of_a_case = [f"cases/{name}/job.resolved.yaml" for name in cases[:1]]
    for name in ("job.resolved.yaml", "steady.resolved.yaml", "study.resolved.yaml", *of_a_case):
        if (directory / name).is_file():
            found = re.search(r"^title: (.+)$", (directory / name).read_text(errors="replace"), re.MULTILINE)
            return found.group(1).strip("'\"") if found else "without a title"
    return "without a job"


def _run(directory: Path, claims: dict[str, Claim]) -> Iterator[str]:
    table = directory / "measures.csv"
    if not table.exists():
        return
    columns, claim = measures.read(table), claims.get("run")
    if not columns["step"]:
        yield "  run: no step yet"
        return
    step, time = int(columns["step"][-1]), columns["time"][-1]
    ended = claim is not None and claim.finished is not None and claim.finished[0] == step
    how = "finished" if ended else "not finished"
    yield f"  run: {how} after step {step}, t = {time:g} s, {len(columns['step'])} rows"
    last = {name: columns[name][-1] for name in ("pressure", *MEAN_OF, "approach")}
    yield "  last row: " + ", ".join(f"{name} {value:.6g}" for name, value in last.items())
    yield f"  wall time of its steps: {math.fsum(columns['seconds']):.4g} s"
    if (directory / RESOLVED).exists():
        job = shown_job(directory / RESOLVED)
        yield from (f"  {text}" for text in slide.describe(job.history, job.initial, job.grid.dx, columns))


def _theory(directory: Path, claims: dict[str, Claim]) -> Iterator[str]:
    table = directory / theory_settings.TABLE
    if table.exists():
        told = f"  Persson's theory: {len(measures.read(table)['time'])} rows, "
        try:
            settings = theory_settings.read(directory)
        except InputError:
            yield told + "of unknown settings"
            raise
        yield told + (f"gamma {settings.gamma:g}, {settings.waves} of waves" if settings else "of unknown settings")


def _curve(directory: Path, claims: dict[str, Claim]) -> Iterator[str]:
    table = directory / "steady.csv"
    if table.exists() and (speeds := (columns := measures.read(table))["velocity"]):
        best = int(np.argmax(columns["friction"]))
        yield (
            f"  friction curve: {len(speeds)} points from {min(speeds):g} to {max(speeds):g} m/s; the largest friction "
            f"is {columns['friction'][best]:.6g} at {speeds[best]:g} m/s under {columns['pressure'][best]:g} Pa"
        )
        errors = {name: slide.largest(columns[name]) for name in slide.ERRORS if name in columns}
        if errors:
            told = ", ".join(f"{name.removeprefix('error_')} {100 * value:.3g} %" for name, value in errors.items())
            numerics = claims["steady"].job.get("numerics", {}) if "steady" in claims else {}
            asked = f"; asked for: {100 * numerics['accuracy']:.3g} %" if "accuracy" in numerics else ""
            yield f"  largest estimated errors of the curve: {told}{asked}"
        yield from (f"  warning: {text}" for text in warnings_of(directory / curve_points.LOG))


def _checkpoints(directory: Path, claims: dict[str, Claim]) -> Iterator[str]:
    for path in sorted(directory.glob("checkpoint/step-*.h5")):
        contents = checkpoint.inspect(path)
        yield f"  checkpoint after step {contents.step}, t = {contents.time:g} s"


def _fields(directory: Path, claims: dict[str, Claim]) -> Iterator[str]:
    path = directory / "fields.h5"
    if path.exists():
        with h5py.File(path, "r") as file:
            times = file["t"][...]
            names = [name for name in file if isinstance(file[name], h5py.Dataset) and file[name].ndim == 3]
        yield f"  fields: {', '.join(names)} at {int(np.isfinite(times).sum())} of {times.size} instants"


def _sweep(directory: Path, claims: dict[str, Claim]) -> Iterator[str]:
    path = directory / sweep_table.TABLE
    if path.exists():
        states = Counter(str(row["state"]) for row in sweep_table.read(path))
        told = ", ".join(f"{number} {'not begun' if state == '-' else state}" for state, number in states.items())
        yield f"  sweep of {states.total()} cases: {told}"


def _study(directory: Path, claims: dict[str, Claim]) -> Iterator[str]:
    if (directory / "study.txt").exists():
        yield "  study: what settings cost is in study.txt"

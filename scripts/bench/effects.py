"""Part `effects`: CPU time per step with and without each effect, all in one run, and a picture.

Every scene makes the same number of iterations in a step, that of a sliding contact solved to 1e-4, whatever comes out:
so the bars differ by what an effect adds to a step, not by how hard its contact is.
"""

import argparse
import itertools
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from runs import Json, begun

from parcontact.history.timeline import Step
from parcontact.march.loop import March
from parcontact.storage.fields import FieldsFile
from parcontact.storage.provenance import Link, Provenance

from .table import Line, quartiles

ITERATIONS = 3  # of a solve: ten operator calls
LOAD: Json = {"history": [{"pressure": 5e3}]}
CELLS: Json = {"history": [{"pressure": 5e3, "velocity": 0.3, "distance": 2e-5, "cells_per_step": 1}]}
PARTS: Json = {"history": [{"pressure": 5e3, "velocity": 0.3, "distance": 2e-5, "cells_per_step": 0.5}]}


def rubber(branches: int) -> Json:
    """A body of so many relaxing branches."""
    times = np.geomspace(1e-6, 1e-2, branches).tolist()
    series = [{"modulus": 1e6 / branches, "relaxation_time": tau} for tau in times]
    return {"material": {"model": "zener", "modulus_inf": 1e6, "branches": series}}


class Case(NamedTuple):
    """A scene, the one that it is compared with, and the effect that it adds to that."""

    above: str
    effect: str
    job: Json
    fields: tuple[str, ...] = ()


CASES = {
    "elastic, static": Case("", "contact solve", LOAD),
    "elastic, sliding": Case("elastic, static", "sliding", CELLS),
    "1 branch": Case("elastic, sliding", "branches", CELLS | rubber(1)),
    "4 branches": Case("elastic, sliding", "branches", CELLS | rubber(4)),
    "12 branches": Case("elastic, sliding", "branches", CELLS | rubber(12)),
    "elastic, half a cell per step": Case("elastic, sliding", "sub-cell shift", PARTS),
    "elastic, free": Case("elastic, static", "padding", LOAD | {"grid": {"boundary": "free"}}),
    "12 branches, energies": Case("12 branches", "energies", CELLS | rubber(12) | {"output": {"energy": True}}),
    "elastic, fields in each step": Case("elastic, static", "fields", LOAD, ("pressure", "gap")),
}
COLOURS = ("0.75", "tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple", "tab:brown")  # of effects


def effects(points: int, rounds: int, asked: argparse.Namespace) -> Iterator[Line]:
    """In each round every scene makes one step."""
    seconds: dict[str, list[float]] = {name: [] for name in CASES}
    calls: dict[str, int] = {}
    with tempfile.TemporaryDirectory() as directory:
        steppers = {name: _stepper(case, points, Path(directory)) for name, case in CASES.items()}
        for count in range(2 + rounds):  # two to compile, and to start
            for name, step in steppers.items():
                began = time.process_time()
                calls[name] = step()
                if count >= 2:
                    seconds[name].append(time.process_time() - began)
    medians = {name: statistics.median(times) for name, times in seconds.items()}
    for name, case in CASES.items():
        yield Line(f"{name}, {calls[name]} calls", 1e3 * medians[name], "ms")
        if case.above:
            ratios = [a / b for a, b in zip(seconds[name], seconds[case.above], strict=True)]
            yield quartiles(f"{name} over {case.above}", ratios)
    if asked.picture:
        _draw(asked.picture, medians, f"ms per step of {1 + 3 * ITERATIONS} operator calls, {points} x {points} points")


def _stepper(case: Case, points: int, directory: Path) -> Callable[[], int]:
    """A function that makes the next step of a case; returns its operator calls."""
    rough = {"hurst": 0.8, "long_wavelength": 2.5e-4, "short_wavelength": min(16e-3 / points, 1.25e-4)}
    job = {
        "surface": {"shape": "rough", **rough, "rms_slope": 0.02, "seed": 1},
        "material": {"model": "elastic", "shear_modulus": 1e6},
        "numerics": {"tolerance": 1e-15, "max_iterations": ITERATIONS, "accept_unconverged": True, "branch_error": 0.0},
        **case.job,
        "grid": {"points": points, "size": 1e-3, **case.job.get("grid", {})},
    }
    march = begun(job)
    steps = _endless(march)
    file: FieldsFile | None = None
    if case.fields:
        planned = march.scene.job
        file = FieldsFile(directory / "fields.h5", march.scene.slab, planned.grid.size, case.fields, range(99))
        file.make(Provenance((Link(planned.resolved(), 1),)))

    def step() -> int:
        row = march.advance(next(steps))
        if file:
            file.save(row.step, row.time, {name: march.field(name) for name in file.names})
        return row.operator_calls

    return step


def _endless(march: March) -> Iterator[Step]:
    """The steps of a job; a single solve is repeated under loads that go up and down."""
    steps = march.timeline()
    first = next(iter(steps))
    yield from steps
    for number in itertools.count(2):
        yield first._replace(number=number, load=first.load * (1.0 + 0.01 * (number % 2)))


def _draw(path: Path, medians: dict[str, float], label: str) -> None:
    """A bar for each scene, of what each effect adds to a step, from the bare solve up."""
    names = list(dict.fromkeys(case.effect for case in CASES.values()))
    figure = Figure(figsize=(8, 4), layout="constrained")
    axes = figure.subplots()
    for row, name in enumerate(CASES):
        layers, left = list[tuple[str, float]](), 0.0
        while name:
            case = CASES[name]
            layers.insert(0, (case.effect, max(medians[name] - medians.get(case.above, 0.0), 0.0)))
            name = case.above
        for effect, seconds in layers:
            axes.barh(row, 1e3 * seconds, left=1e3 * left, color=COLOURS[names.index(effect)], height=0.7)
            left += seconds
    for effect, colour in zip(names, COLOURS, strict=True):
        axes.barh(0, 0, color=colour, label=effect)
    axes.set_yticks(range(len(CASES)), list(CASES))
    axes.invert_yaxis()
    axes.set_xlabel(f"{label}, one core")
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=120)

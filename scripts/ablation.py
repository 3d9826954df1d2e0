"""What each effect costs: CPU time per step with and without it, all in one run, and a picture.

    .venv/bin/python scripts/ablation.py [--points 1024] [--rounds 15] [--picture jobs/pictures/ablation.png]

Every scene makes the same number of iterations in a step, that of a sliding contact solved to 1e-4, whatever comes out:
so the bars differ by what an effect adds to a step, not by how hard its contact is. In each round every scene makes one
step, and the median over rounds is taken. Takes one to two minutes.
"""

import argparse
import itertools
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from mpi4py import MPI

from parcontact import scene
from parcontact.history.timeline import Step, Timeline
from parcontact.job import Job
from parcontact.march.loop import March
from parcontact.parallel.slab import Slab
from parcontact.storage.fields import FieldsFile
from parcontact.storage.provenance import Link, Provenance

ITERATIONS = 3  # of a solve: ten operator calls
MOST = 1.35  # times the time of an elastic step for twelve branches
PICTURE = Path(__file__).parents[1] / "jobs" / "pictures" / "ablation.png"
Json = dict[str, Any]

LOADS = {"pressure": 5e3}
CELLS: Json = {**LOADS, "velocity": 0.3, "distance": 2e-5, "cells_per_step": 1}
PARTS: Json = {**CELLS, "cells_per_step": 0.5}


def rubber(branches: int) -> Json:
    """A body of so many relaxing branches."""
    times = np.geomspace(1e-6, 1e-2, branches).tolist()
    return {
        "model": "zener",
        "modulus_inf": 1e6,
        "branches": [{"modulus": 1e6 / branches, "relaxation_time": tau} for tau in times],
    }


@dataclass
class Case:
    """A scene; `effects` are what it adds to the one before, from the bare solve on, for its bar in the picture."""

    name: str
    above: str
    effect: str
    job: Json
    fields: bool = False
    seconds: list[float] = field(default_factory=list)
    calls: set[int] = field(default_factory=set)

    @property
    def median(self) -> float:
        return statistics.median(self.seconds)


CASES = [
    Case("elastic, static", "", "contact solve", {"history": [LOADS]}),
    Case("elastic, sliding", "elastic, static", "sliding", {"history": [CELLS]}),
    Case("1 branch", "elastic, sliding", "branches", {"history": [CELLS], "material": rubber(1)}),
    Case("4 branches", "elastic, sliding", "branches", {"history": [CELLS], "material": rubber(4)}),
    Case("12 branches", "elastic, sliding", "branches", {"history": [CELLS], "material": rubber(12)}),
    Case("elastic, half a cell per step", "elastic, sliding", "sub-cell shift", {"history": [PARTS]}),
    Case("elastic, free", "elastic, static", "padding", {"history": [LOADS], "grid": {"boundary": "free"}}),
    Case(
        "12 branches, energies",
        "12 branches",
        "energies",
        {"history": [CELLS], "material": rubber(12), "output": {"energy": True}},
    ),
    Case("elastic, fields in each step", "elastic, static", "fields", {"history": [LOADS]}, fields=True),
]
COLOURS = {
    "contact solve": "0.75",
    "sliding": "tab:blue",
    "branches": "tab:orange",
    "sub-cell shift": "tab:green",
    "padding": "tab:red",
    "energies": "tab:purple",
    "fields": "tab:brown",
}


def job(points: int, **changes: Any) -> Job:
    return Job.model_validate(
        {
            "grid": {"points": points, "size": 1e-3, **changes.pop("grid", {})},
            "surface": {
                "shape": "rough",
                "hurst": 0.8,
                "long_wavelength": 2.5e-4,
                "short_wavelength": 16e-3 / points,
                "rms_slope": 0.02,
                "seed": 1,
            },
            "material": {"model": "elastic", "shear_modulus": 1e6},
            "numerics": {
                "tolerance": 1e-15,
                "max_iterations": ITERATIONS,
                "accept_unconverged": True,
                "branch_error": 0.0,
            },
            **changes,
        }
    )


def stepper(case: Case, points: int, directory: Path) -> Callable[[], None]:
    """What makes the next step of a case and notes its time."""
    planned = job(points, **case.job)
    march = March(scene.build(planned, Slab(MPI.COMM_SELF, points, points)))
    steps = endless(planned)
    file: FieldsFile | None = None
    if case.fields:
        file = FieldsFile(directory / "fields.h5", march.scene.slab, planned.grid.size, ("pressure", "gap"), range(99))
        file.make(Provenance((Link(planned.resolved(), 1),)))

    def make() -> None:
        step = next(steps)
        began = time.process_time()
        row = march.advance(step)
        if file:
            file.save(row.step, row.time, {name: march.field(name) for name in file.names})
        case.seconds.append(time.process_time() - began)
        case.calls.add(row.operator_calls)

    return make


def endless(planned: Job) -> Iterator[Step]:
    """The steps of a job; a single solve is repeated under loads that go up and down."""
    steps = Timeline.of(planned)
    first = next(iter(steps))
    yield from steps
    for number in itertools.count(2):
        yield first._replace(number=number, load=first.load * (1.0 + 0.01 * (number % 2)))


def measure(points: int, rounds: int) -> None:
    with tempfile.TemporaryDirectory() as directory:
        steppers = [stepper(case, points, Path(directory)) for case in CASES]
        for make in (*steppers, *steppers):  # compiled, and started
            make()
        for case in CASES:
            case.seconds.clear()
            case.calls.clear()
        for _ in range(rounds):
            for make in steppers:
                make()


def layers(case: Case) -> list[tuple[str, float]]:
    """Effects and what each adds to a step [s], from the bare solve up."""
    below = next((other for other in CASES if other.name == case.above), None)
    if below is None:
        return [(case.effect, case.median)]
    return [*layers(below), (case.effect, case.median - below.median)]


def draw(path: Path, points: int) -> None:
    matplotlib.use("agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
    for row, case in enumerate(CASES):
        left = 0.0
        for effect, seconds in layers(case):
            axes.barh(row, 1e3 * max(seconds, 0.0), left=1e3 * left, color=COLOURS[effect], height=0.7)
            left += max(seconds, 0.0)
    for effect, colour in COLOURS.items():
        axes.barh(0, 0, color=colour, label=effect)
    axes.set_yticks(range(len(CASES)), [case.name for case in CASES])
    axes.invert_yaxis()
    axes.set_xlabel(f"ms per step of {1 + 3 * ITERATIONS} operator calls, {points} x {points} points, one core")
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=120)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--points", type=int, default=1024)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--picture", type=Path, default=PICTURE)
    options = parser.parse_args()
    measure(options.points, options.rounds)
    by_name = {case.name: case for case in CASES}
    for case in CASES:
        below = by_name.get(case.above)
        more = f"{case.median / below.median:6.2f} times {below.name}" if below else ""
        spread = max(case.seconds) / min(case.seconds) - 1.0
        calls = ", ".join(map(str, sorted(case.calls)))
        print(f"{case.name:32}{1e3 * case.median:8.1f} ms  (+-{spread / 2:4.0%}, {calls} calls){more}")
    pairs = zip(by_name["12 branches"].seconds, by_name["elastic, sliding"].seconds, strict=True)
    ratio = statistics.median(many / none for many, none in pairs)
    verdict = "yes" if ratio <= MOST else "NO"
    print(f"12 branches cost {ratio:.3f} times an elastic step at equal iterations; at most {MOST}: {verdict}")
    draw(options.picture, options.points)
    print(f"picture: {options.picture}")
    return 0 if ratio <= MOST else 1


if __name__ == "__main__":
    raise SystemExit(main())

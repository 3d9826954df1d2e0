"""One random scene and its twin, marched and compared."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from random import Random

import numpy as np
from mpi4py import MPI

from parcontact import scene
from parcontact.march.loop import March
from parcontact.parallel.slab import Slab

from . import scenes, twins
from .scenes import Sketch
from .witness import Witness, distance


@dataclass(frozen=True)
class Trial:
    """What came of a scene: sentences about what must not be, and numbers to count."""

    sketch: Sketch
    twin: str
    violations: list[str]
    failures: list[str]
    counts: Counter[str]
    iterations: int
    distance: float

    @property
    def about(self) -> str:
        ny, nx = self.sketch.heights.shape
        x, y = self.sketch.size
        numerics = " ".join(str(value) for value in self.sketch.numerics.values())
        return f"{nx} x {ny} points, {x:.2g} x {y:.2g} m, {self.sketch.boundary}, {numerics}; {self.twin}"


def witness(sketch: Sketch, directory: Path, comm: MPI.Intracomm = MPI.COMM_SELF) -> Witness:
    """A witness of the whole scene; its heights pass through a file in `directory`, each rank's own; collective."""
    job = sketch.job(directory)
    return Witness(March(scene.build(job, Slab(comm, *job.grid.points)))).see()


def trial(dice: Random, directory: Path, stages: int = 6) -> Trial:
    """March a random scene and the same told in another way."""
    sketch = scenes.sketch(dice, stages)
    twin = twins.twin(dice, sketch)
    one, other = witness(sketch, directory), witness(twin.sketch, directory)
    apart = distance(one, other, twin.told)
    violations = [*one.violations, *(f"{twin.name}: {sentence}" for sentence in other.violations)]
    alike = {
        step: np.array_equal(p, twin.told(other.pressures[step]))
        for step, p in one.pressures.items()
        if step in other.pressures
    }
    if twin.exact and not (len(alike) == one.steps == other.steps and all(alike.values())):
        violations.append(f"{twin.name}: not the same to the last bit, {apart:g} of what certificates allow apart")
    if not apart <= 1.0:
        violations.append(f"{twin.name}: {apart:g} of what certificates allow apart")
    both = (one, other)
    counts = Counter(
        steps=one.steps + other.steps,
        retries=one.retries + other.retries,
        beyond=sum(bool(w.failure) and w.beyond for w in both),
        failed=sum(bool(w.failure) and not w.beyond for w in both),
        violations=len(violations),
    )
    failures = [w.failure for w in both if w.failure]
    return Trial(sketch, twin.name, violations, failures, counts, max(w.iterations for w in both), apart)

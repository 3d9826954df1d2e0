"""Jobs of static solves: what each of their steps gave."""

from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from parcontact import job
from parcontact.files.recorder import StepRow
from parcontact.march import scene
from parcontact.march.loop import March, run_steps
from parcontact.parallel.slab import Slab

Fields = dict[str, NDArray[Any]]


def run(path: Path, *overrides: str) -> list[tuple[StepRow, Fields]]:
    """What each step of a job gave: its row and fields. The steps of these jobs are static solves."""
    loaded = job.load(path, overrides)
    ready = March(scene.build(loaded, Slab.alone(*loaded.grid.points)))
    steps = []

    def note(state: March) -> None:
        if state.row.step > 0:
            fields = {name: state.field(name).copy() for name in ("pressure", "displacement", "gap")}
            steps.append((state.row, fields))

    run_steps(ready, [note])
    return steps

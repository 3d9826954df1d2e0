"""A run from a job to its output directory."""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import march, scene
from .clock import steps
from .errors import InputError
from .job import Job, Rough
from .march import March
from .parallel.slab import Slab
from .record import provenance
from .record.console import Console, Silence
from .record.fields import FieldsFile
from .record.measures import MeasuresFile
from .scene import Scene

Task = Callable[[March], None]


@dataclass(frozen=True)
class Options:
    """What the command line adds to a job."""

    quiet: bool = False


def run(job: Job, slab: Slab, options: Options) -> int:
    """Run a job; collective. Returns the exit code. Nothing is written before the whole job has proved sound."""
    built = scene.build(job, slab)
    directory = job.output.directory
    _prepare(job, slab)
    total = sum(1 for _ in steps(job.history, job.grid))
    console = Console(directory / "run.log", options.quiet, total) if slab.root else Silence()
    try:
        for text in (*job.warnings, *scene.remarks(built)):
            console.warn(text)
        console.say(f"{job.title or job.path.stem}: {job.grid.nx} x {job.grid.ny} points on {_ranks(slab)}")
        marching = March(built)
        tasks = [lambda m: console.step(m.row), *_measures(built), *_fields(built, total)]
        march.run(marching, tasks)
        console.say(f"done: results in {directory}")
        console.log("counts on root: " + ", ".join(f"{name} {count}" for name, count in sorted(slab.tally.items())))
    finally:
        console.close()
    return 0


def _ranks(slab: Slab) -> str:
    return "1 rank" if slab.comm.size == 1 else f"{slab.comm.size} ranks"


def _prepare(job: Job, slab: Slab) -> None:
    """Make the output directory with the job in it; collective. Raises InputError where it cannot be written."""
    directory, problem = job.output.directory, ""
    if slab.root:
        try:
            directory.mkdir(parents=True, exist_ok=True)
            copy = directory / "job.yaml"
            if not (copy.exists() and copy.samefile(job.path)):
                shutil.copyfile(job.path, copy)
            (directory / "job.resolved.yaml").write_text(job.resolved())
        except OSError as error:
            problem = f"the output directory {directory} cannot be written: {error.strerror}"
    if problem := slab.agree(problem):
        raise InputError(problem)


def _measures(built: Scene) -> list[Task]:
    if not built.slab.root:
        return []
    branches = len(built.energy.balance.dissipated) if built.energy and built.job.output.branch_dissipation else 0
    path: Path = built.job.output.directory / "measures.csv"
    path.unlink(missing_ok=True)
    file = MeasuresFile(path, branches)
    return [lambda marching: file.write(marching.row)]


def _fields(built: Scene, total: int) -> list[Task]:
    job = built.job
    if not job.output.fields:
        return []
    saved = {n: i for i, n in enumerate(n for n in range(1, total + 1) if n % job.output.every == 0 or n == total)}
    path = job.output.directory / "fields.h5"
    file = FieldsFile(path, built.slab, job.grid.size, job.output.fields, len(saved))
    seeds = [shape.seed for shape in job.surface if isinstance(shape, Rough)]
    file.make(lambda h5: provenance.write(h5, job.resolved(), [], built.slab.comm.size, seeds))

    def save(marching: March) -> None:
        row = marching.row
        if row.step in saved:
            file.save(saved[row.step], row.time, {name: marching.field(name) for name in job.output.fields})

    return [save]

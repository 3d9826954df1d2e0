"""The settings of a study: their combinations, and the changes of the job.

All meshes, cells per step and integrators are combined. For each integrator the mesh is also refined with the time
steps of the finest mesh. A rough surface of one seed has the same waves on every mesh.

Stages that choose their steps do so in every case, unless there is a ladder of cells per step, which replaces them in
sliding stages.
"""

import itertools
import re
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from pathlib import Path

from ..errors import InputError
from ..job import AUTO, Case, GeometricStep, Job, Stage
from ..job.checks.cells import one_cell
from ..job.reading import CASES

MakeJob = Callable[[Sequence[str]], Job]  # returns the job changed by overrides


@dataclass(frozen=True)
class Settings:
    """One combination: points along x, cells per step (of its mesh; None for chosen steps), and integrator."""

    mesh: int
    cells_per_step: float | None
    integrator: str

    @property
    def time_step(self) -> float:
        """Return the time step in lengths of the box; for chosen steps about one cell."""
        return (self.cells_per_step or 1.0) / self.mesh

    @property
    def effort(self) -> float:
        """Return an estimate of the work, points times steps."""
        return self.mesh**2 / self.time_step

    def __str__(self) -> str:
        return f"mesh {self.mesh}, {self.steps}, {self.integrator}"

    @property
    def directory(self) -> Path:
        """Return the directory of the case in that of the study. It stays the same if ladders get longer."""
        cells = AUTO if self.cells_per_step is None else f"{self.cells_per_step:.9g}"
        return Path(CASES, f"{self.mesh}-{cells}-{self.integrator}")

    @property
    def steps(self) -> str:
        if self.cells_per_step is None:
            return "auto steps"
        return f"{self.cells_per_step:.4g} cell{'s' if self.cells_per_step > 1.0 else ''} per step"


@dataclass(frozen=True)
class Ladders:
    """Ladders from the coarsest to the finest setting; a single value without a ladder.

    `shared` is the relative error that all cases may have in common: the accuracy of chosen steps, else 0. Unless
    something `slides`, friction is not assessed.
    """

    meshes: tuple[int, ...]
    cells: tuple[float | None, ...]
    integrators: tuple[str, ...]
    own: Settings
    shared: float = 0.0
    slides: bool = True

    def combine(self) -> list[Settings]:
        """Return all different combinations, the cheapest first."""
        found = set(itertools.starmap(Settings, itertools.product(self.meshes, self.cells, self.integrators)))
        coarse, finest = self.cells[0], self.meshes[-1]  # time step of the refinement of the mesh alone
        for mesh, integrator in itertools.product(self.meshes, self.integrators):
            found.add(Settings(mesh, coarse and coarse * mesh / finest, integrator))
        return sorted(found, key=lambda case: (case.effort, str(astuple(case))))


def _cells_of_time_steps(job: Job) -> float:
    """Return the cells per step of the first sliding stage with a given time step; 1 without one."""
    steps = ((stage, stage.time_step) for stage in job.history if stage.speed)
    return next((dt / one_cell(stage, job.grid) for stage, dt in steps if isinstance(dt, float)), 1.0)


def ladders(job: Job) -> Ladders:
    """Return the ladders of a job's study. Raises InputError without ladders."""
    study, numerics = job.study, job.numerics
    if study is None:
        raise InputError("no ladders: add a study section to the job, like study: {mesh: [256, 512, 1024]}")
    own = next((stage.cells_per_step for stage in job.history if stage.cells_per_step is not None), None)
    if own is None and not _sliding(job):
        own = _cells_of_time_steps(job)
    if own is None and study.cells_per_step:
        own = 1.0
    case = Settings(job.grid.nx, own, numerics.integrator)
    meshes = tuple(sorted(study.mesh)) or (job.grid.nx,)
    cells: tuple[float | None, ...] = tuple(sorted(study.cells_per_step, reverse=True)) or (own,)
    shared = numerics.asked.of_steps if _sliding(job) and not study.cells_per_step else 0.0
    slides = any(stage.speed for stage in job.history)
    return Ladders(meshes, cells, study.integrator or (numerics.integrator,), case, shared, slides)


def overrides(job: Job, own: Settings, case: Settings) -> list[str]:
    """Return the overrides for a case of the job; all time steps change in the same proportion."""
    ny = 1 if job.grid.ny == 1 else case.mesh * job.grid.ny // job.grid.nx
    words = [f"grid.points=[{case.mesh}, {ny}]", "output.fields=[]", "output.every=1", "output.energy=false"]
    words += [
        "output.branch_dissipation=false",
        "checkpoint.keep=0",
        "study=null",
        f"numerics.integrator={case.integrator}",
    ]
    words.append(f"numerics.tolerance={job.numerics.tolerance!r}")  # the job's tolerance, also if the accuracy chose it
    words += [f"{key}={value!r}" for key, value in _chosen_values(job)]
    factor = case.time_step / own.time_step
    replaced = _sliding(job) if job.study and job.study.cells_per_step else []
    for index, stage in enumerate(job.history):
        place = f"history.{index}"
        if stage in replaced:
            words += [f"{place}.time_step=null", f"{place}.cells_per_step={case.cells_per_step!r}"]
        elif stage.cells_per_step is not None:
            cells = stage.cells_per_step * factor * case.mesh / own.mesh
            words.append(f"{place}.cells_per_step={cells!r}")
        elif isinstance(stage.time_step, GeometricStep):
            first, growth = stage.time_step.first * factor, stage.time_step.growth**factor
            words.append(f"{place}.time_step={{first: {first!r}, growth: {growth!r}}}")
        elif stage.time_step is not None and stage.time_step != AUTO:
            words.append(f"{place}.time_step={stage.time_step * factor!r}")
    return words


def make_cases(job: Job, refined: Ladders, make: MakeJob) -> dict[Settings, Case]:
    """Return the cases of a study, with output directories of their own. Raises InputError with the mistakes of the
    first case that has any."""
    cases = dict[Settings, Case]()
    for one in refined.combine():
        try:
            made = make(overrides(job, refined.own, one))
        except InputError as error:
            said = re.sub(r"(?m)^--set [^:]*: ", "", str(error))
            raise InputError(f"study, case {one}: {said}") from error
        output = made.output.model_copy(update={"directory": job.output.directory / one.directory})
        values = {"mesh": one.mesh, "cells_per_step": one.cells_per_step or AUTO, "integrator": one.integrator}
        cases[one] = Case(len(cases), values, made.model_copy(update={"output": output}))
    return cases


def _sliding(job: Job) -> list[Stage]:
    """Return the sliding stages that choose their steps."""
    return [stage for stage in job.history if stage.chooses and stage.speed]


def _chosen_values(job: Job) -> list[tuple[str, float]]:
    """Return the lengths [m] that effects choose by the mesh of the job, with their keys."""
    return [pair for asked in job.asked("chosen_values") for pair in asked(job).items()]


def describe_choices(job: Job) -> list[str]:
    """Return sentences on the settings that are equal, or chosen for the accuracy, in every case."""
    own = f"{job.grid.nx} x {job.grid.ny} points, the job's own mesh"
    lines = [f"{key}: {value:.4g} m in every case, chosen by auto for {own}" for key, value in _chosen_values(job)]
    refined = _sliding(job) if job.study and job.study.cells_per_step else []
    if stages := [stage.name for stage in job.history if stage.chooses and stage not in refined]:
        bound = f"numerics.accuracy = {job.numerics.asked.of_steps:g}"
        lines.append(f"{', '.join(dict.fromkeys(stages))}: time steps are chosen in every case, for {bound}")
    return lines

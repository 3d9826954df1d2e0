"""The error budget of a step: what the step shows, with what is known of the run."""

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..accuracy.budget import ErrorBudget, ErrorSums, estimate
from ..accuracy.embedded import EmbeddedPair, IntegratorDifference
from ..accuracy.observation import RunProperties, StepObservation, properties_of
from ..accuracy.time_error import time_error
from ..effects.contact_protocol import SolvedContact
from ..history.timeline import Step
from ..physics.body import BodyMemory, Trial, surface_of
from ..physics.entries import Entry, Saved
from ..physics.measures import Measures
from ..physics.slopes import friction_by_energy
from ..physics.units import Units
from ..scene import Scene
from ..solve.contact import Contact

NO_DIFFERENCE = IntegratorDifference(0.0, 0.0)


@dataclass(frozen=True)
class StepErrors:
    """Errors of a step: its budget, None where nothing touches, and the error of its length alone, by which steps
    that are chosen are judged; with the friction of the body, from which a change in the next step is known, infinite
    after a jump. `lasting` is the budget without the error of a rise of friction, which passes: the tolerance of the
    next solves does not follow it."""

    budget: ErrorBudget | None
    step: float
    friction: float
    lasting: ErrorBudget | None

    @property
    def of_friction(self) -> float:
        """The relative error of friction, infinite where there is none."""
        return math.inf if self.budget is None or self.budget.friction is None else self.budget.friction.of_friction


@dataclass(frozen=True)
class SolvedStep:
    """A step that has been solved: the contact by its law, its measures, and the memory of the body after it."""

    step: Step
    trial: Trial
    of_law: SolvedContact[Any]
    measures: Measures
    body: BodyMemory

    @property
    def contact(self) -> Contact:
        return self.of_law.contact

    @property
    def touches(self) -> bool:
        """Return whether the surfaces touch, and there is pressure or tension."""
        return self.of_law.loaded and self.measures.contact_area > 0.0


@dataclass(frozen=True)
class ErrorMemory:
    """Memory of errors: the friction of the body in the last step, infinite where that was a jump, and the sums of the
    budget."""

    friction: float = math.inf
    sums: ErrorSums = field(default_factory=ErrorSums)


@dataclass(frozen=True)
class BudgetPart:
    """The errors of a run, whose body `relaxes` or not; a checkpoint may lack them."""

    relaxes: bool

    def at_rest(self) -> ErrorMemory:
        return ErrorMemory()

    def entries(self, memory: ErrorMemory, units: Units) -> dict[str, Entry]:
        friction = {"friction": Entry(memory.friction, optional=True)} if self.relaxes else {}
        return friction | memory.sums.entries()

    def restored(self, memory: ErrorMemory, saved: Saved) -> ErrorMemory:
        return ErrorMemory(float(saved.get("friction", math.inf)), ErrorSums.restored(saved))


def estimate_errors(scene: Scene, friction: float, solved: SolvedStep) -> StepErrors:
    """Return how wrong a step is, with the `friction` of the body in the step before, infinite where that is not known
    or was a jump; collective."""
    step, measures = solved.step, solved.measures
    branches = scene.material.branched
    prony = None if branches is None else branches.prony
    run = properties_of(scene.job, scene.setup.shortest, scene.folded.bound, prony)
    own = measures.friction - measures.friction_interface
    change, own = own - friction, math.inf if step.jump else own
    observed = replace(_observe(scene, run, solved), change=change)
    time = time_error(run, observed)
    if not solved.touches:
        return StepErrors(None, time, own, None)
    return StepErrors(estimate(run, observed), time, own, estimate(run, replace(observed, change=0.0)))


def _observe(scene: Scene, run: RunProperties, solved: SolvedStep) -> StepObservation:
    """Return what a step shows; collective."""
    step, measures, certificate = solved.step, solved.measures, solved.contact.certificate
    pair, apart, grid = _compare_integrators(scene, solved), _compare_views(scene, solved), scene.choices.grid
    curved = scene.choices.numerics.integrator == "exponential" and step.growth > 0.0
    of_steps: dict[str, Any] = {"difference": pair.difference, "order": pair.order, "seconds": step.dt}
    if not solved.touches:
        return StepObservation(0.0, 0.0, 0.0, 0.0, curved=curved, **of_steps)
    return StepObservation(
        complementarity=certificate.complementarity,
        friction=measures.friction,
        area=measures.contact_area,
        corrected=measures.contact_area_corrected,
        slope=pair.slope * (scene.units.height / scene.units.length),
        interface=measures.friction_interface,
        penetrating=max(certificate.members / measures.contact_area - 1.0, 0.0),
        spared=measures.spared,
        friction_mismatch=apart,
        way=step.velocity,
        slid=_cells_slid(run, step, (grid.dx, grid.dy)),
        angle=pair.angle,
        curved=curved,
        uneven=min(1.0, measures.max_pressure / measures.pressure - 1.0) if measures.pressure > 0.0 else 1.0,
        **of_steps,
    )


def _cells_slid(run: RunProperties, step: Step, cell: tuple[float, float]) -> float:
    """Return by how many cells the surface slides in a step: of mean sides, or across straight edges of contact."""
    dx, dy = cell if run.edges_follow_grid else (run.mean_cell, run.mean_cell)
    return math.hypot(step.velocity[0] / dx, step.velocity[1] / dy) * step.dt


def _compare_integrators(scene: Scene, solved: SolvedStep) -> IntegratorDifference:
    """Return what the embedded pair shows of a step; collective."""
    step, trial, contact, measures = solved.step, solved.trial, solved.contact, solved.measures
    branches = scene.material.branched
    if branches is None:
        return NO_DIFFERENCE
    pair = EmbeddedPair(scene.slab, branches, scene.choices.grid.dx / scene.units.length)
    if not solved.touches:
        return pair.compare_without_load(step.dt, trial, solved.body, step.growth) if step.decide else NO_DIFFERENCE
    load = measures.pressure * scene.slab.points / (trial.alpha * scene.units.pressure)
    pressure = contact.p
    if (touching := solved.of_law.touching) is not pressure:  # tension counts as pressure does
        pressure = np.abs(contact.p) if solved.of_law.pull else np.where(touching, contact.p, 0.0)
        load = scene.slab.sum(float(pressure.sum()))[0]
    share = measures.contact_area
    return pair.compare(step.dt, trial, solved.body, pressure, contact.u, load, share, step.growth)


def _compare_views(scene: Scene, solved: SolvedStep) -> float:
    """Return by how much friction by the slopes of the rigid surface and of the body differ; collective.

    Of an elastic body the latter is 0.
    """
    step, measures, grid = solved.step, solved.measures, scene.choices.grid
    if scene.material.branched is None or measures.friction == 0.0:
        return max(measures.friction - measures.friction_interface, 0.0)
    direction, own = _viscous(step.velocity, measures)
    maps, cyclic = (solved.contact.p, surface_of(solved.body)), grid.cyclic
    other = friction_by_energy(scene.slab, *maps, (grid.dx, grid.dy), direction, cyclic)
    return abs(other * scene.units.height - own)


def _viscous(velocity: tuple[float, float], measures: Measures) -> tuple[tuple[float, float], float]:
    """Return a unit direction, and friction along it without the interface's: that of sliding, or that against the
    force at rest and where the force is rather across, as of ridges that slide along themselves."""
    (x, y), (force_x, force_y) = velocity, (measures.force_x, measures.force_y)
    if abs(force_x * y - force_y * x) >= abs(force_x * x + force_y * y):
        x, y = -force_x, -force_y
    size = math.hypot(x, y)
    along = -(force_x * x + force_y * y) / (size * measures.normal_force)
    return (x / size, y / size), along - measures.friction_interface

"""Error budget of a step, from the step and from properties of the run."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..accuracy.budget import ErrorBudget, ErrorSums, estimate
from ..accuracy.constants import ENERGY
from ..accuracy.embedded import IntegratorDifference
from ..accuracy.observation import RunProperties, StepObservation
from ..accuracy.time_error import error_of_rise, time_error
from ..effects.contact_protocol import SolvedContact
from ..effects.effect import Sheared
from ..history.timeline import Step
from ..physics.body import BodyMemory, Trial, remembers, states_errors
from ..physics.entries import Entry, Saved
from ..physics.measures import Measures
from ..physics.slopes import friction_by_energy
from ..physics.units import Units
from ..scene import Scene
from ..solve.contact import Contact

NO_DIFFERENCE = IntegratorDifference(0.0, 0.0)


@dataclass(frozen=True)
class StepErrors:
    """Errors of a step.

    `budget` is None if nothing touches. `step` is the error of the step's length alone, which decides about chosen
    steps. `friction` is the friction of the body, infinite after a jump; its change in the next step is an error
    source. `lasting` is the budget without the temporary error of rising friction; it sets the tolerance of the next
    solves.
    """

    budget: ErrorBudget | None
    step: float
    friction: float
    lasting: ErrorBudget | None

    @property
    def of_friction(self) -> float:
        """Relative error of friction; infinite without friction."""
        return math.inf if self.budget is None or self.budget.friction is None else self.budget.friction.of_friction

    @property
    def resolved(self) -> bool:
        """True unless spots of contact may be smaller than a cell."""
        return self.budget is None or self.budget.resolved

    @property
    def of_area(self) -> float:
        """The relative error of the contact area, 0 where there is none."""
        return 0.0 if self.budget is None else self.budget.area.total


@dataclass(frozen=True)
class SolvedStep:
    """A solved step: the contact by its law, its measures, and the memory of the body after it."""

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
        """True if the surfaces touch, and there is pressure or tension."""
        return self.of_law.loaded and self.measures.contact_area > 0.0


@dataclass(frozen=True)
class ErrorMemory:
    """Memory of errors: the friction of the body in the last step, infinite after a jump, the sums of the budget, and
    the summed error of the energies that were dissipated and lost in slip [J], infinite if unknown."""

    friction: float = math.inf
    sums: ErrorSums = field(default_factory=ErrorSums)
    energy: float = 0.0


@dataclass(frozen=True)
class BudgetPart:
    """The errors of a run; `relaxes` is True for a viscoelastic body, `energies` if there are energies. Its entries are
    optional."""

    relaxes: bool
    energies: bool = False

    def at_rest(self) -> ErrorMemory:
        return ErrorMemory()

    def entries(self, memory: ErrorMemory, units: Units) -> dict[str, Entry]:
        friction = {"friction": Entry(memory.friction, optional=True)} if self.relaxes else {}
        energy = {"energy": Entry(memory.energy, 1.0, "J", optional=True)} if self.energies else {}
        return friction | energy | memory.sums.entries()

    def restored(self, memory: ErrorMemory, saved: Saved) -> ErrorMemory:
        friction, energy = float(saved.get("friction", math.inf)), float(saved.get("energy", math.inf))
        return ErrorMemory(friction, ErrorSums.restored(saved), energy)


def add_energy_error(summed: float, errors: StepErrors | None, sheared: Sheared | None, dissipated: float) -> float:
    """Return the summed error of energies after a step in which the body has `dissipated` an energy [J], infinite
    without `errors`: relative errors by the step and by the area, and of friction in what slip loses."""
    if errors is None:
        return math.inf
    slip = 0.0 if sheared is None or not sheared.lost else sheared.lost * min(errors.of_friction, 1.0)
    return summed + abs(dissipated) * (errors.step + ENERGY.value * errors.of_area) + slip


def estimate_errors(scene: Scene, friction: float, solved: SolvedStep) -> StepErrors:
    """Return the errors of a step; `friction` is the friction of the body in the step before, infinite if unknown or
    after a jump. Collective."""
    if not states_errors(scene.material):
        return StepErrors(None, 0.0, math.inf, None)
    run, measures = scene.properties, solved.measures
    body = measures.friction - measures.friction_interface
    observed = _observe(scene, run, solved, body - friction)
    time, last = time_error(run, observed), math.inf if solved.step.jump else body
    if not solved.touches:
        return StepErrors(None, time, last, None)
    budget, rise = estimate(run, observed), error_of_rise(run, observed)
    more = max(0.0, rise - time) * observed.body / measures.friction if budget.friction else 0.0
    return StepErrors(budget, time, last, budget.take_from_time(more))


def _observe(scene: Scene, run: RunProperties, solved: SolvedStep, change: float) -> StepObservation:
    """Return the observation of a step with this change of the friction of the body; collective."""
    step, measures, certificate = solved.step, solved.measures, solved.contact.certificate
    pair, mismatch, grid = _compare_integrators(scene, solved), _compare_views(scene, solved), scene.choices.grid
    curved = scene.choices.numerics.integrator == "exponential" and step.growth > 0.0
    of_steps: dict[str, Any] = {"difference": pair.difference, "order": pair.order}
    of_steps |= {"seconds": step.dt, "change": change}
    if remembers(scene.material) and scene.material.branched is None:
        of_steps["own_error"] = scene.material.time_error(solved.body, solved.trial, step.dt)  # type: ignore[attr-defined]
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
        friction_mismatch=mismatch,
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
    """Return the differences that the embedded pair of integrators gives for a step; collective."""
    step, trial, contact, measures = solved.step, solved.trial, solved.contact, solved.measures
    pair = scene.integrators
    if pair is None:
        return NO_DIFFERENCE
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
    """Return the difference of friction by the slopes of the rigid surface and of the body; collective. For an elastic
    body the latter is 0."""
    step, measures, grid = solved.step, solved.measures, scene.choices.grid
    if not remembers(scene.material) or measures.friction == 0.0:
        return max(measures.friction - measures.friction_interface, 0.0)
    direction, own = _viscous(step.velocity, measures)
    displacement = scene.material.displacement(solved.body, solved.contact.u.copy, solved.trial.alpha)
    maps, cyclic = (solved.contact.p, displacement), grid.cyclic
    other = friction_by_energy(scene.slab, *maps, (grid.dx, grid.dy), direction, cyclic)
    return abs(other * scene.units.height - own)


def _viscous(velocity: tuple[float, float], measures: Measures) -> tuple[tuple[float, float], float]:
    """Return a unit direction, and friction along it without the interface. The direction is the direction of sliding,
    or opposite to the force at rest and if the force is mainly across, as for ridges that slide along themselves."""
    (x, y), (force_x, force_y) = velocity, (measures.force_x, measures.force_y)
    if abs(force_x * y - force_y * x) >= abs(force_x * x + force_y * y):
        x, y = -force_x, -force_y
    size = math.hypot(x, y)
    along = -(force_x * x + force_y * y) / (size * measures.normal_force)
    return (x / size, y / size), along - measures.friction_interface

"""The error budget of a step: what the step shows, with what is known of the run.

What the embedded pair shows, and by how much the two views of friction differ, changes slowly while steps are alike:
then each is looked at in every few of them only.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from typing import Any

import numpy as np

from ..history.timeline import Step
from ..job import Cylinder, Flat, Rough, Wave
from ..physics.body import Trial, ZenerBody
from ..physics.budget import ErrorBudget, estimate
from ..physics.embedded import Embedded, Look
from ..physics.entries import Entry
from ..physics.measures import Measures
from ..physics.prony import Prony
from ..physics.seen import Known, Seen
from ..physics.slopes import friction_by_energy
from ..physics.time_error import time_error
from ..scene import Scene, Setup
from ..solve.contact import Contact

PAIR, VIEWS = "budget/look", "budget/views"  # in a checkpoint
NO_LOOK = Look(0.0, 0.0)
ALIKE_STEPS = 4  # of one stage and one length, to which one look at the embedded pair applies at most
ALIKE_VIEWS = 5  # the same of the two views of friction; odd, as steps may be quarters of a cell


@dataclass(frozen=True)
class LastLook:
    """What was seen in a step of this stage and length [s]; it stands for so many steps `so_far`."""

    stage: float = -1.0
    dt: float = 0.0
    so_far: float = 0.0
    seen: tuple[float, ...] = ()

    def stands_for(self, step: Step, most: int) -> bool:
        """Return whether what it has shown applies to one more step, of so many at most."""
        return (self.stage, self.dt) == (step.stage, step.dt) and self.so_far < most

    def once_more(self) -> "LastLook":
        """Return it with one more step for which it stands."""
        return replace(self, so_far=self.so_far + 1.0)

    @property
    def numbers(self) -> list[float]:
        """As a checkpoint has them."""
        return [self.stage, self.dt, self.so_far, *self.seen]

    @classmethod
    def of(cls, numbers: list[float]) -> "LastLook":
        """Return the one of a checkpoint."""
        stage, dt, so_far, *seen = numbers
        return cls(stage, dt, so_far, tuple(seen))


@dataclass(frozen=True)
class Estimate:
    """How wrong a step is: its budget, None where nothing touches, and the error of its length alone, by which steps
    that are chosen are judged."""

    budget: ErrorBudget | None
    step: float = 0.0


class Errors:
    """Estimates of the steps of one scene; allocates nothing, remembers the last looks."""

    def __init__(self, scene: Scene) -> None:
        grid, material, self.slab = scene.job.grid, scene.material, scene.slab
        exponential = scene.job.numerics.integrator == "exponential"
        prony = material.prony if isinstance(material, ZenerBody) else None
        self.known = known_of(scene.setup, scene.folded.bound, exponential, prony)
        self._slope_unit = scene.units.height / scene.units.length
        self._pressure_unit = scene.units.pressure
        self._cell = grid.dx, grid.dy
        cell = grid.dx / scene.units.length
        self._pair = Embedded(self.slab, material, cell) if isinstance(material, ZenerBody) else None
        self._material, self._height, self._cyclic = material, scene.units.height, grid.boundary == "periodic"
        self._last = self._before = (LastLook(), LastLook())

    def of(self, step: Step, trial: Trial, contact: Contact, measures: Measures) -> Estimate:
        """That of a step just committed; collective."""
        self._before = self._last
        look, apart = self._look(step, trial, contact, measures), self._views_apart(step, contact, measures)
        if measures.contact_area == 0.0:
            if step.judge is not None and self._pair is not None:
                look = self._pair.look_without_load(step.dt, trial)
            still = Seen(0.0, look.difference, look.order, 0.0, 0.0, 0.0, 0.0)
            return Estimate(None, time_error(self.known, still, self.slab.points))
        seen = Seen(
            contact.certificate.complementarity,
            look.difference,
            look.order,
            look.slope * self._slope_unit,
            measures.friction,
            measures.contact_area,
            measures.contact_area_corrected,
            math.hypot(step.velocity[0] / self._cell[0], step.velocity[1] / self._cell[1]) * step.dt,
            step.dt,
            max(contact.certificate.members / measures.contact_area - 1.0, 0.0),
            look.angle,
            apart,
        )
        points = self.slab.points
        return Estimate(estimate(self.known, seen, points), time_error(self.known, seen, points))

    def take_back(self) -> None:
        """Forget the looks at a step that is made anew."""
        self._last = self._before

    def entries(self) -> dict[str, Entry]:
        """The last looks, for a checkpoint; none of a body without a memory."""
        if self._pair is None:
            return {}
        return {name: Entry(np.array(last.numbers)) for name, last in zip((PAIR, VIEWS), self._last, strict=True)}

    def restore(self, numbers: Mapping[str, Any]) -> None:
        """Go on from the arrays of a checkpoint; one that has no look is followed by a new one."""
        pair, views = (LastLook.of(numbers[name].tolist()) if name in numbers else LastLook() for name in (PAIR, VIEWS))
        self._last = pair, views

    def _look(self, step: Step, trial: Trial, contact: Contact, measures: Measures) -> Look:
        """What the pair shows of a step, or of the one like it that was looked at last; collective."""
        last, views = self._last
        if self._pair is None or measures.contact_area == 0.0:
            self._last = LastLook(), views
            return NO_LOOK
        if last.stands_for(step, ALIKE_STEPS):
            last = last.once_more()
        else:
            load = measures.pressure * self.slab.points / (trial.alpha * self._pressure_unit)
            look = self._pair.look(step.dt, trial, contact.p, contact.u, load, measures.contact_area)
            last = LastLook(float(step.stage), step.dt, 1.0, astuple(look))
        self._last = last, views
        return Look(*last.seen)

    def _views_apart(self, step: Step, contact: Contact, measures: Measures) -> float:
        """By how much friction by the slopes of the rigid surface and of the body differ; collective.

        Of an elastic body the latter is 0.
        """
        own = measures.friction - measures.friction_interface
        if not isinstance(self._material, ZenerBody) or measures.friction == 0.0:
            return max(own, 0.0)
        pair, last = self._last
        if last.stands_for(step, ALIKE_VIEWS):
            last = last.once_more()
        else:
            direction, own = _viscous(step.velocity, measures)
            other = friction_by_energy(self.slab, contact.p, self._material.u, self._cell, direction, self._cyclic)
            last = LastLook(float(step.stage), step.dt, 1.0, (abs(other * self._height - own),))
        self._last = pair, last
        return last.seen[0]


def known_of(setup: Setup, folded: float, exponential: bool, prony: Prony | None) -> Known:
    """Return what is known of a job before it begins, with the bound of its `folded` branches and what relaxes."""
    job = setup.job
    waves = [shape.short_wavelength for shape in job.surface if isinstance(shape, Rough)]
    waves += [setup.shortest] if setup.shortest is not None else []
    cells = min(waves) / max(job.grid.dx, job.grid.dy) if waves else None
    return Known(cells, 1 in job.grid.points or _ridges(job.surface), folded, exponential, prony)


def _ridges(shapes: Sequence[Any]) -> bool:
    """Return whether the surface is of cylinders and waves along one axis of the grid, as then edges of contact are."""
    across = {"y" if shape.axis == "x" else "x" for shape in shapes if isinstance(shape, Cylinder)}
    waves = [shape.waves for shape in shapes if isinstance(shape, Wave)]
    across |= {axis for x, y in waves for axis, count in (("x", x), ("y", y)) if count}
    return len(across) == 1 and all(isinstance(shape, Cylinder | Wave | Flat) for shape in shapes)


def _viscous(velocity: tuple[float, float], measures: Measures) -> tuple[tuple[float, float], float]:
    """Return a unit direction, and friction along it without the interface's: that of sliding, or that against the
    force at rest and where the force is rather across, as of ridges that slide along themselves."""
    (x, y), (force_x, force_y) = velocity, (measures.force_x, measures.force_y)
    if abs(force_x * y - force_y * x) >= abs(force_x * x + force_y * y):
        x, y = -force_x, -force_y
    size = math.hypot(x, y)
    along = -(force_x * x + force_y * y) / (size * measures.normal_force)
    return (x / size, y / size), along - measures.friction_interface

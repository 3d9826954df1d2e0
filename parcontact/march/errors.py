"""The error budget of a step: what the step shows, with what is known of the run.

What the embedded pair shows changes slowly while steps are alike: then it is looked at in every few of them only.
"""

import math
from collections.abc import Mapping
from dataclasses import astuple, dataclass, replace
from typing import Any

import numpy as np

from ..job import Rough
from ..job.timeline import Step
from ..physics.body import Trial, ZenerBody
from ..physics.budget import ErrorBudget, estimate
from ..physics.embedded import Embedded, Look
from ..physics.entries import Entry
from ..physics.measures import Measures
from ..physics.seen import Known, Seen
from ..physics.time_error import time_error
from ..scene import Scene
from ..solve.contact import Contact

NAME = "budget/look"  # in a checkpoint
NO_LOOK = Look(0.0, 0.0)
ALIKE_STEPS = 4  # of one stage and one length, to which one look at the embedded pair applies at most


@dataclass(frozen=True)
class LastLook:
    """At the embedded pair, in a step of this stage and length [s]; it stands for so many steps `so_far`."""

    stage: float = -1.0
    dt: float = 0.0
    so_far: float = 0.0
    look: Look = NO_LOOK

    def stands_for(self, step: Step) -> bool:
        """Whether what it has shown applies to one more step."""
        return (self.stage, self.dt) == (step.stage, step.dt) and self.so_far < ALIKE_STEPS

    @property
    def numbers(self) -> list[float]:
        """As a checkpoint has them."""
        return [self.stage, self.dt, self.so_far, *astuple(self.look)]


@dataclass(frozen=True)
class Estimate:
    """How wrong a step is: its budget, None where nothing touches, and the error of its length alone, by which steps
    that are chosen are judged."""

    budget: ErrorBudget | None
    step: float = 0.0


class Errors:
    """Estimates of the steps of one scene; allocates nothing, remembers the last look."""

    def __init__(self, scene: Scene) -> None:
        grid, material, self.slab = scene.job.grid, scene.material, scene.slab
        waves = [shape.short_wavelength for shape in scene.job.surface if isinstance(shape, Rough)]
        self.known = Known(
            min(waves) / max(grid.dx, grid.dy) if waves else None,
            1 in grid.points,
            scene.folded.bound,
            scene.job.numerics.integrator == "exponential",
            material.prony if isinstance(material, ZenerBody) else None,
        )
        self._slope_unit = scene.units.height / scene.units.length
        self._pressure_unit = scene.units.pressure
        self._cell = grid.dx, grid.dy
        cell = grid.dx / scene.units.length
        self._pair = Embedded(self.slab, material, cell) if isinstance(material, ZenerBody) else None
        self._last = self._before = LastLook()

    def of(self, step: Step, trial: Trial, contact: Contact, measures: Measures) -> Estimate:
        """That of a step just committed; collective."""
        look = self._look(step, trial, contact, measures)
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
        )
        points = self.slab.points
        return Estimate(estimate(self.known, seen, points), time_error(self.known, seen, points))

    def take_back(self) -> None:
        """Forget the look at a step that is made anew."""
        self._last = self._before

    def entries(self) -> dict[str, Entry]:
        """The last look, for a checkpoint; none of a body without a memory."""
        return {} if self._pair is None else {NAME: Entry(np.array(self._last.numbers))}

    def restore(self, numbers: Mapping[str, Any]) -> None:
        """Go on from the arrays of a checkpoint; one that has no look is followed by a new one."""
        if NAME in numbers:
            stage, dt, so_far, *look = numbers[NAME].tolist()
            self._last = LastLook(stage, dt, so_far, Look(*look))

    def _look(self, step: Step, trial: Trial, contact: Contact, measures: Measures) -> Look:
        """What the pair shows of a step, or of the one like it that was looked at last; collective."""
        self._before = self._last
        if self._pair is None or measures.contact_area == 0.0:
            self._last = LastLook()
        elif self._last.stands_for(step):
            self._last = replace(self._last, so_far=self._last.so_far + 1.0)
        else:
            load = measures.pressure * self.slab.points / (trial.alpha * self._pressure_unit)
            look = self._pair.look(step.dt, trial, contact.p, contact.u, load, measures.contact_area)
            self._last = LastLook(float(step.stage), step.dt, 1.0, look)
        return self._last.look

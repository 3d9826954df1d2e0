"""The error budget of a step: what the step shows, with what is known of the run."""

from dataclasses import dataclass

from ..job import Rough
from ..job.timeline import Step
from ..physics.body import Trial, ZenerBody
from ..physics.budget import ErrorBudget, Known, Seen, estimate, time_error
from ..physics.embedded import Embedded, Look
from ..physics.measures import Measures
from ..scene import Scene
from ..solve.contact import Contact


@dataclass(frozen=True)
class Estimate:
    """How wrong a step is: its budget, None where nothing touches, and the error of its length alone, by which steps
    that are chosen are judged."""

    budget: ErrorBudget | None
    step: float = 0.0


class Errors:
    """Estimates of the steps of one scene; allocates nothing."""

    def __init__(self, scene: Scene) -> None:
        grid, material, self.slab = scene.job.grid, scene.material, scene.slab
        waves = [shape.short_wavelength for shape in scene.job.surface if isinstance(shape, Rough)]
        self.known = Known(
            min(waves) / max(grid.dx, grid.dy) if waves else None,
            1 in grid.points,
            scene.folded.bound,
            scene.job.numerics.integrator == "exponential",
        )
        self._slope_unit = scene.units.height / scene.units.length
        cell = grid.dx / scene.units.length
        self._pair = Embedded(self.slab, material, cell) if isinstance(material, ZenerBody) else None

    def of(self, step: Step, trial: Trial, contact: Contact, measures: Measures) -> Estimate:
        """That of a step just committed; collective."""
        look = Look(0.0, 0.0)
        if self._pair is not None:
            look = self._pair.look(step.dt, trial, contact.p, contact.u)
        if measures.contact_area == 0.0:
            if step.judge is not None and self._pair is not None:
                look = self._pair.look_without_load(step.dt, trial)
            return Estimate(None, time_error(self.known, Seen(0.0, look.difference, look.order, 0.0, 0.0, 0.0, 0.0)))
        seen = Seen(
            contact.certificate.complementarity,
            look.difference,
            look.order,
            look.slope * self._slope_unit,
            measures.friction,
            measures.contact_area,
            measures.contact_area_corrected,
        )
        return Estimate(estimate(self.known, seen, self.slab.points), time_error(self.known, seen))

"""Contact law of surfaces that do not attract: a constraint on pressures (`solve.constraint`), solved from the last
pressures."""

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ..effects.contact_protocol import ContactLaw, Detached, EdgeMotion, PreviousContacts, SolvedContact
from ..history.timeline import Step
from ..parallel.slab import Array
from ..physics.body import Trial
from ..physics.entries import Entry, Saved
from ..physics.measures import Measures
from ..physics.units import Units
from ..scene import Scene, solver_on, solver_on_tiles
from ..solve.contact import Contact
from ..solve.fallback import cold_start, retry
from ..solve.problem import Control, MeanPressure, Problem
from . import failure
from .starts import cells_moved, make_start


def choose_contact_law(scene: Scene) -> ContactLaw[Any]:
    """Return the contact law that an effect of the scene provides, or the law of its constraint. A law that solves by
    the latter gets it by its method `upon`."""
    dry, law = DryLaw(scene), scene.law
    return dry if law is None else law.upon(dry) if hasattr(law, "upon") else law


@dataclass(frozen=True)
class DryLaw:
    """Law of a scene's constraint. It has no memory of its own."""

    scene: Scene
    may_shorten = False

    def solve(
        self,
        trial: Trial,
        step: Step,
        control: Control,
        memory: None,
        past: PreviousContacts,
        before: Measures,
        tolerance: float | None,
    ) -> SolvedContact[None]:
        """Solve a step; see `effects.contact_protocol.ContactLaw.solve`. Raises StepError."""
        scene, contact, remark = self.scene, None, ""
        most = control.value * scene.slab.points if isinstance(control, MeanPressure) else math.inf
        problem = Problem(*scene.operators, trial.effective, scene.constraint(trial.alpha, most), control)
        make_start(scene, past.pressures, step, trial.alpha, past.spare)
        if past.last.alpha == 0.0:  # nothing has been solved before
            on = partial(solver_on, scene.setup)
            contact = cold_start.prepare_start(scene.solver, problem, past.spare, on, solver_on_tiles(scene.setup))
        contact = contact or scene.solver.solve(problem, past.spare, tolerance=tolerance)
        if contact.failure:
            contact, remark = self._retry(step, past, problem, contact)
        return SolvedContact(contact, None, problem.constraint.touches(contact.p), remark=remark)

    def _retry(self, step: Step, past: PreviousContacts, problem: Problem, failed: Contact) -> tuple[Contact, str]:
        """Retry a failed solve; only in double precision if the job accepts unconverged solves. Raises StepError if all
        attempts fail. Return the contact, and a sentence on the attempt that succeeded; collective."""
        scene, would_do = self.scene, failure.accepts(self.scene, failed)
        in_double = (lambda: scene.in_double) if failed.u.dtype == np.float32 else None
        if would_do and in_double is None:
            return failed, ""
        on, most = partial(solver_on, scene.setup), 1 if would_do else None
        contact, tried = retry.retry_solve(scene.solver, problem, failed, on, in_double, most)
        if contact.failure:
            if would_do and failure.accepts(scene, contact):
                return contact, ""
            moved = math.hypot(*cells_moved(scene, step, past.last.position))
            raise failure.of_solve(scene, step, failed, contact, tried, problem.heights, moved)
        return contact, f"the contact solve {failed.failure}; solved when retried with {', with '.join(tried)}"

    def motion(self, solved: SolvedContact[None], before: Measures, now: Measures) -> EdgeMotion:
        """Return no motion: the motion of edges in a step is not limited."""
        return EdgeMotion()

    def gap(self, memory: None) -> Array | None:
        """Return None: the pressure is the unknown."""
        return None

    def detached(self, memory: None) -> Detached | None:
        """Return None: a compressive load is always carried."""
        return None

    def with_end(self, memory: None, end: Detached) -> None:
        """Return None, the memory."""

    def at_rest(self) -> None:
        """Return None, the memory."""

    def entries(self, memory: None, units: Units) -> dict[str, Entry]:
        """Return no entries."""
        return {}

    def restored(self, memory: None, saved: Saved) -> None:
        """Return None."""

"""Solve the contact of a step by a contact law, from a start; errors of failed solves state place, cause and remedies.

Start of a solve: pressures change with time and move with the surface. If the surface has moved by whole cells since
one of the last steps, the pressure of that step is moved by as many cells, without rounding. In steady sliding the
moved pressure is already the solution. With steps of a whole cell the last pressure is moved, extrapolated with the
pressure before it. With steps of half a cell the pressure before the last one is moved. With steps of a third or a
quarter of a cell a still earlier pressure is moved, which is stored only in slides with chosen steps. Otherwise the
last two pressures are extrapolated in the body's frame.

`DryLaw` is the law of surfaces that do not attract: a constraint on pressures (`contact.problem`), solved from the last
pressures. `ClosingLaw` is the law of a surface whose finer roughness is squeezed in the interface: under pressure the
mean planes of this roughness approach by the closing c. With the modulus alpha of a step, in which the pressure is
`alpha p`,

    p >= 0,    w = A p + c(alpha p) - h - d >= 0,    p w = 0.

The gap `u - h - d` is measured to the undeformed highest points of the finer roughness. In contact these points are
squeezed, and the gap is `-c`. An effect provides this law (`effects.effect.Effect.law`), which is solved by splitting
(`contact.splitting`). Energies of the run do not include the work on the finer roughness.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from ..contact import starts
from ..contact.certificate import Judge
from ..contact.problem import Box, Constraint, Contact, Control, MeanPressure, Problem, reachable_certificate
from ..contact.splitting import Splitting
from ..effects.effect import ContactLaw, Detached, EdgeMotion, PreviousContacts, PreviousPressure, SolvedContact
from ..errors import InputError, RunError
from ..job.history import Step
from ..parallel import regrid
from ..parallel.slab import Array
from ..physics import loops
from ..physics.body import Trial
from ..physics.records import Entry, Measures, Saved, Units
from ..physics.surface import are_whole, cells_between
from ..printed import rounded_up
from . import sanity
from .scene import Scene, solver_on, solver_on_tiles

FINITE = "look for heights, loads or moduli that are not finite or of very different magnitude"
UNITS = {"pressure": " Pa", "force": " N", "approach": " m"}
USEFUL = 0.1  # accuracy: largest certificate of a useful contact
MANY_CELLS = 1.5  # tuning: least motion of the surface in a step [cells] for the advice on smaller steps


class StepError(RunError):
    """Error of a failed step; the run keeps the state before the step. `beyond_precision` is True if the tolerance
    needs more digits than the floating-point type has."""

    def __init__(self, text: str, beyond_precision: bool = False) -> None:
        super().__init__(text)
        self.beyond_precision = beyond_precision


class DetachedError(Exception):
    """The surfaces have detached in a step that ends at `time` [s]. `load` is the load of the step, in the unit of its
    control ([Pa], [N] or [m]). The run keeps the state before the step."""

    def __init__(self, time: float, load: float) -> None:
        super().__init__(time, load)
        self.time, self.load = time, load


def accepts(scene: Scene, contact: Contact) -> bool:
    """Return True if `numerics.accept_unconverged` is set and the errors of an unconverged contact are finite."""
    return scene.choices.numerics.accept_unconverged and math.isfinite(contact.certificate.worst)


def describe_place(scene: Scene, step: Step) -> str:
    """Return a text with the number, time and stage of a step."""
    return f"step {step.number} at t = {step.time:g} s (stage {scene.choices.timeline.history[step.stage].name!r})"


def not_finite(scene: Scene, step: Step, measures: Measures) -> StepError:
    """Return the error of a converged step whose measures are not finite."""
    wrong = ", ".join(name for name, value in asdict(measures).items() if not math.isfinite(value))
    return StepError(f"{describe_place(scene, step)}: {wrong} would not be finite; {FINITE}")


def of_solve(
    scene: Scene, step: Step, failed: Contact, last: Contact, tried: list[str], h: Array, moved: float
) -> StepError:
    """Return the error for a step whose contact solve was given up; collective.

    `failed` is the contact of this solve. `tried` names the further attempts, and `last` is the contact of the last
    attempt. `h` is the map of heights in the run's units, shape (rows of this rank, nx). The surface moves by `moved`
    cells in the step.
    """
    also = f", also with {', with '.join(tried)}" if tried else ""
    numerics, what = scene.choices.numerics, f"{describe_place(scene, step)}: the contact solve {failed.failure}{also}"
    if not np.isfinite(last.certificate.worst):
        return StepError(f"{what}; {FINITE}")
    compliance = scene.setup.half_space.largest_compliance
    reach = reachable_certificate(scene.slab, (last.u, h), last.p, compliance, last.certificate.length)
    if numerics.tolerance < reach:
        change = "try a larger numerics.tolerance" if reach <= USEFUL else FINITE
        text = f"{what}; {numerics.precision} precision reaches only about {reach:.1g} here: {change}"
        return StepError(text, beyond_precision=True)
    return StepError(f"{what}; {', or '.join(_changes(scene, step, failed, last, moved)) or FINITE}")


def _out_of_bounds(scene: Scene, step: Step, box: Box, mean: float, unit: float) -> StepError:
    """Return the error for a mean pressure outside the bounds; `unit` is the unit of both [Pa]."""
    bound, which = (box.lowest, "least") if mean < box.lowest else (box.highest, "most")
    text = f"pressures of at {which} {bound * unit:.4g} Pa cannot have the mean {mean * unit:.4g} Pa"
    return StepError(f"{describe_place(scene, step)}: {text}; change the load, or the bound on pressures")


def _changes(scene: Scene, step: Step, failed: Contact, last: Contact, moved: float) -> Iterator[str]:
    """Yield possible remedies, the likeliest first."""
    numerics = scene.choices.numerics
    if "max_iterations" in failed.failure:
        yield f"try numerics.max_iterations above {numerics.max_iterations}"
    if moved > MANY_CELLS:
        yield f"try smaller steps: in this step the surface moves by {moved:.3g} cells"
    elif step.dt > 0.0:
        yield "try smaller steps"
    if last.certificate.worst <= USEFUL:
        yield f"try numerics.tolerance above {rounded_up(last.certificate.worst, 1)}"


def refuse_beyond_full_contact(scene: Scene, step: Step, effective: Array) -> None:
    """Raise StepError if a step prescribes an approach beyond full contact; collective."""
    if sanity.has_full_contact(scene.setup):
        mean = scene.slab.sum(float(effective.sum(dtype=np.float64)))[0] / scene.slab.points
        if text := sanity.beyond_full_contact(scene.setup, step.load, mean * scene.units.height):
            raise StepError(f"{describe_place(scene, step)}: {text}")


def make_start(scene: Scene, pasts: Sequence[PreviousPressure], step: Step, alpha: float, out: Array) -> None:
    """Put the start for the solve of a step into the map `out`: a pressure divided by the modulus `alpha` of the step.
    `pasts` are the last pressures, newest first."""
    if len(pasts) == 1:
        out[...] = pasts[0].pressure
        return
    now, before = pasts[:2]
    growth = step.growth if before.alpha > 0.0 else 0.0
    past = _whole_cells_ago(scene, pasts, step) if growth > 0.0 else None
    if past is not None:
        now, growth = past, 0.0
    _travel(scene, step, now, before, growth, alpha, out)


def cells_moved(scene: Scene, step: Step, since: tuple[float, float]) -> tuple[float, float]:
    """Return by how many cells, along x and y, the surface moves from the position `since` [m] to the end of a step."""
    grid = scene.choices.grid
    return cells_between(since, step.position, (grid.dx, grid.dy))


def _whole_cells_ago(scene: Scene, pasts: Sequence[PreviousPressure], step: Step) -> PreviousPressure | None:
    """Return the newest pressure since which the surface has moved by whole cells; None if it is the last one."""
    last, *older = pasts
    if are_whole(cells_moved(scene, step, last.position)):
        return None
    known = (past for past in older if past.alpha > 0.0)
    return next((past for past in known if are_whole(cells_moved(scene, step, past.position))), None)


def _travel(
    scene: Scene, step: Step, now: PreviousPressure, before: PreviousPressure, growth: float, alpha: float, out: Array
) -> None:
    """Put `(1 + growth) now - growth before`, moved with the surface by whole cells, into `out`."""
    slab, points = scene.slab, scene.choices.grid.points
    along_x, along_y = (
        round(moved) % count  # against overflow in long steps
        for moved, count in zip(cells_moved(scene, step, now.position), points, strict=True)
    )
    older, share = before.pressure, growth * before.alpha / alpha
    if along_y and growth > 0.0:
        older = regrid.roll_rows(slab, before.pressure, along_y, out)
    box = scene.constraint(alpha)
    loops.travel(now.pressure, older, (1.0 + growth) * now.alpha / alpha, share, along_x, box.lowest, box.highest, out)
    if along_y:
        out[...] = regrid.roll_rows(slab, out, along_y, scene.solver.workspace.pressure)


def choose_contact_law(scene: Scene) -> ContactLaw[Any]:
    """Return the contact law of a scene: the law that an effect provides, or else the law of the scene's constraint on
    pressures. A law with the method `upon` extends the law of the constraint: `upon` takes this law and returns the
    extended law."""
    dry, law = DryLaw(scene), scene.law
    return dry if law is None else law.upon(dry) if hasattr(law, "upon") else law


@dataclass(frozen=True)
class DryLaw:
    """Contact law of a scene's bounds on the pressure. This law has no memory of its own."""

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
        """Solve the contact of a step; see `effects.effect.ContactLaw.solve`. Raises StepError."""
        scene, contact, remark = self.scene, None, ""
        most = control.value * scene.slab.points if isinstance(control, MeanPressure) else math.inf
        problem = Problem(*scene.operators, trial.effective, scene.constraint(trial.alpha, most), control)
        if isinstance(control, MeanPressure) and not problem.constraint.admits(control.value):
            raise _out_of_bounds(scene, step, problem.constraint, control.value, trial.alpha * scene.units.pressure)
        make_start(scene, past.pressures, step, trial.alpha, past.spare)
        if cold := past.last.alpha == 0.0:  # nothing has been solved before
            on = partial(solver_on, scene.setup)
            contact = starts.prepare_start(scene.solver, problem, past.spare, on, solver_on_tiles(scene.setup))
        contact = contact or scene.solver.solve(problem, past.spare, tolerance, cold)
        if contact.failure:
            contact, remark = self._retry(step, past, problem, contact)
        return SolvedContact(contact, None, problem.constraint.touches(contact.p), remark=remark)

    def _retry(self, step: Step, past: PreviousContacts, problem: Problem, failed: Contact) -> tuple[Contact, str]:
        """Retry a failed solve; only in double precision if the job accepts unconverged solves. Raises StepError if all
        attempts fail. Return the contact, and a sentence on the attempt that succeeded; collective."""
        scene, would_do = self.scene, accepts(self.scene, failed)
        in_double = (lambda: scene.in_double) if failed.u.dtype == np.float32 else None
        if would_do and in_double is None:
            return failed, ""
        on, most = partial(solver_on, scene.setup), 1 if would_do else None
        contact, tried = starts.retry_solve(scene.solver, problem, failed, on, in_double, most)
        if contact.failure:
            if would_do and accepts(scene, contact):
                return contact, ""
            moved = math.hypot(*cells_moved(scene, step, past.last.position))
            raise of_solve(scene, step, failed, contact, tried, problem.heights, moved)
        return contact, f"the contact solve {failed.failure}; solved when retried with {', with '.join(tried)}"

    def motion(self, solved: SolvedContact[None], before: Measures, now: Measures) -> EdgeMotion:
        """Return no motion: this law does not limit the motion of edges of contact in a step."""
        return EdgeMotion()

    def gap(self, memory: None) -> Array | None:
        """Return None: the pressure is the unknown of this law, not the gap."""
        return None

    def detached(self, memory: None) -> Detached | None:
        """Return None: a compressive load is always carried."""
        return None

    def with_end(self, memory: None, end: Detached) -> None:
        """Return None: this law has no memory."""

    def at_rest(self) -> None:
        """Return None: this law has no memory."""

    def entries(self, memory: None, units: Units) -> dict[str, Entry]:
        """Return no entries for checkpoints: this law has no memory."""
        return {}

    def restored(self, memory: None, saved: Saved) -> None:
        """Return None: this law has no memory."""


SOFTER = 4.0  # tuning: most modulus of the last step over that of this one, for a start from its pressures
MOST_STEPS = 20000  # tuning: limit on the steps of the splitting for one contact


class ClosingLaw(DryLaw):
    """Contact law of an interface whose mean planes approach by c [m] under pressure, as finer roughness is squeezed
    (the closing). c depends on the pressure [Pa] at the end of a step, without memory.

    Raises InputError unless the body is a periodic half space without a hardness.
    """

    def __init__(self, scene: Scene, law: Callable[[Step], Constraint]) -> None:
        super().__init__(scene)
        body, setup = scene.setup.half_space, scene.setup
        if body.moves_in_the_mean or scene.job.material.hardness is not None:
            raise InputError("finer roughness as a law of the interface needs a periodic half space without a hardness")
        judge = Judge(scene.slab, setup.height / scene.units.height)
        self._law = law
        self._splitting = Splitting(
            judge, body.operator(setup.fft), body.inverse(setup.fft), scene.choices.numerics.tolerance, MOST_STEPS
        )

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
        """Solve the contact of a step; see `effects.effect.ContactLaw.solve`."""
        if isinstance(control, MeanPressure) and control.value == 0.0:
            return super().solve(trial, step, control, memory, past, before, tolerance)
        scene, p = self.scene, past.spare
        if 0.0 < past.last.alpha <= SOFTER * trial.alpha:  # a contact is known, of about as many points
            make_start(scene, past.pressures, step, trial.alpha, p)
        else:
            p.fill(0.0)
        law = self._law(step).in_units(trial.alpha * scene.units.pressure, scene.units.height)
        contact = self._splitting.solve(trial.effective, control, law, p, tolerance)
        return SolvedContact(contact, None, law.touches(p))

"""Errors of failed steps: their place, their cause, and possible remedies."""

import math
from collections.abc import Iterator
from dataclasses import asdict

import numpy as np

from ..errors import RunError
from ..history.timeline import Step
from ..parallel.slab import Array
from ..physics.measures import Measures
from ..printed import rounded_up
from ..scene import Scene, sanity
from ..solve.contact import Contact
from ..solve.precision import reachable_certificate

FINITE = "look for heights, loads or moduli that are not finite or of very different magnitude"
UNITS = {"pressure": " Pa", "force": " N", "approach": " m"}
USEFUL = 0.1  # accuracy: largest certificate of a useful contact
MANY_CELLS = 1.5  # tuning: least motion of the surface in a step [cells] for the advice on smaller steps


class StepError(RunError):
    """A step that failed; the run keeps the state before it. `beyond_precision` is True if its tolerance needs more
    digits than numbers of its precision have."""

    def __init__(self, text: str, beyond_precision: bool = False) -> None:
        super().__init__(text)
        self.beyond_precision = beyond_precision


class DetachedError(Exception):
    """The surfaces have detached in a step that ends at `time` [s] under a `load`; the run keeps the state
    before it."""

    def __init__(self, time: float, load: float) -> None:
        super().__init__(time, load)
        self.time, self.load = time, load


def accepts(scene: Scene, contact: Contact) -> bool:
    """Return whether the job accepts a solve that did not reach the tolerance."""
    return scene.choices.numerics.accept_unconverged and math.isfinite(contact.certificate.worst)


def describe_place(scene: Scene, step: Step) -> str:
    """Return number, time and stage of a step."""
    return f"step {step.number} at t = {step.time:g} s (stage {scene.choices.timeline.history[step.stage].name!r})"


def not_finite(scene: Scene, step: Step, measures: Measures) -> StepError:
    """Return the error of a converged step whose measures are not finite."""
    wrong = ", ".join(name for name, value in asdict(measures).items() if not math.isfinite(value))
    return StepError(f"{describe_place(scene, step)}: {wrong} would not be finite; {FINITE}")


def of_solve(
    scene: Scene, step: Step, failed: Contact, last: Contact, tried: list[str], h: Array, moved: float
) -> StepError:
    """Return the error of a contact solve for heights h that has `failed`, and of the attempts `tried`, which end with
    `last`; collective. In the step the surface moves by `moved` cells."""
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

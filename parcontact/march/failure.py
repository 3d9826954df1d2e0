"""What to say of a step that failed: what happened, where, and what to change."""

import math
from collections.abc import Iterator
from dataclasses import asdict

import numpy as np

from ..errors import RunError
from ..history.timeline import Step
from ..parallel.slab import Array
from ..physics.measures import Measures
from ..scene import Scene
from ..solve.contact import Contact

ROUNDINGS = 4.0  # of the largest length, over that of the certificate: none is sure to be better
FINITE = "look for heights, loads or moduli that are not finite or too far apart"
LONG = 1.5  # cells that a surface moves in a long step


class StepError(RunError):
    """A step that could not be made; the run is as it was before it."""


def where(scene: Scene, step: Step) -> str:
    return f"step {step.number} at t = {step.time:g} s (stage {scene.choices.timeline.history[step.stage].name!r})"


def not_finite(scene: Scene, step: Step, measures: Measures) -> StepError:
    """A step whose solve meets its conditions, and whose results are no numbers all the same."""
    wrong = ", ".join(name for name, value in asdict(measures).items() if not math.isfinite(value))
    return StepError(f"{where(scene, step)}: {wrong} would not be finite; {FINITE}")


def of_solve(
    scene: Scene, step: Step, failed: Contact, last: Contact, tried: list[str], h: Array, moved: float
) -> StepError:
    """A contact solve for heights h that has `failed`, also when `tried` in other ways, up to the `last`; collective.

    `moved` is by how many cells the surface went in the step.
    """
    also = f", also with {', with '.join(tried)}" if tried else ""
    changes = ", or ".join(_changes(scene, step, failed, last, h, moved))
    return StepError(f"{where(scene, step)}: the contact solve {failed.failure}{also}; {changes}")


def _changes(scene: Scene, step: Step, failed: Contact, last: Contact, h: Array, moved: float) -> Iterator[str]:
    """What may help, the likeliest first; collective up to its end."""
    numerics = scene.choices.numerics
    if not np.isfinite(last.certificate.worst):
        yield FINITE
        return
    reach, sharp = _reach(scene, last, h), _sharp(scene, h)
    if numerics.tolerance < reach:
        yield f"{numerics.precision} precision reaches only about {reach:.1g} here: try a larger numerics.tolerance"
        return
    if "max_iterations" in failed.failure:
        yield f"try numerics.max_iterations above {numerics.max_iterations}"
    if moved > LONG:
        yield f"try smaller steps: in this one the surface moves by {moved:.3g} cells"
    elif step.dt > 0.0:
        yield "try smaller steps"
    if sharp > 1.0:
        yield "try a finer grid: the surface has most of its curvature in waves of less than four cells"
    yield f"try numerics.tolerance above {last.certificate.worst:.1g}"


def _reach(scene: Scene, last: Contact, h: Array) -> float:
    """The certificate that the rounding of heights, displacements and pressures allows; collective.

    A pressure p that is wrong in its last digit moves the body by that digit of `p (1 - nu) L/(2 pi)` in a wave as long
    as the box: a load far beyond full contact has no digits left for what differs from its mean.
    """
    sizes = scene.slab.reduce((), [float(np.abs(field).max(initial=0.0)) for field in (last.u, h, last.p)])
    sizes[2] *= scene.setup.half_space.largest_compliance
    return ROUNDINGS * float(np.finfo(last.u.dtype).eps) * max(sizes) / last.certificate.length


def _sharp(scene: Scene, h: Array) -> float:
    """Squares of second differences over those of central ones, along x and y (this rank's rows); collective.

    For a wave of n cells `tan^2(pi/n)`: above 1 where waves of less than four cells prevail.
    """
    h = h.astype(np.float64)
    sums = [0.0, 0.0]
    for low, middle, high in ((h[:, :-2], h[:, 1:-1], h[:, 2:]), (h[:-2], h[1:-1], h[2:])):
        sums[0] += float(np.sum((high - 2.0 * middle + low) ** 2))
        sums[1] += float(np.sum((high - low) ** 2))
    second, central = scene.slab.sum(*sums)
    return second / central if central > 0.0 else float(second > 0.0) * np.inf

"""Steps that single precision cannot solve: the next ones are solved in double precision from the start.

With `numerics.precision: mixed` a loose tolerance is reached with an operator in single precision, unless the load
moves the body by far more than the surface is high. The rounding of such a displacement over the height is known
before; where it is more than the tolerance, a step is solved in double precision at once. A solve that stalls all the
same is retried in double precision. The rounding of its displacements over the length of the certificate says by how
much they are too coarse; while that is not less by half, the next steps are solved in double precision, too.
"""

import numpy as np

from ..parallel.slab import Array
from ..physics.entries import Entry, Saved
from ..scene import Scene
from ..solve.contact import Contact
from ..solve.problem import Control, MeanPressure
from .failure import ROUNDINGS, reach_of

NAME = "contact/rounding of single precision"  # in a checkpoint
LESS = 0.5  # tuning: of the rounding with which a solve has stalled: with that single precision is tried again


def rounds_too_much(scene: Scene, control: Control, tolerance: float | None) -> bool:
    """Return whether the load is too large for single precision and a tolerance, the job's if it is None; never of an
    approach, and on layers, which a load moves by less.

    In full contact the certificate compares gaps with the rms height, which is less than the height that is used here.
    """
    body, numerics = scene.setup.half_space, scene.choices.numerics
    if not scene.choices.single_operator.on or not isinstance(control, MeanPressure) or body.layer is not None:
        return False
    moved = ROUNDINGS * float(np.finfo(np.float32).eps) * control.value * body.largest_compliance
    return moved > (tolerance or numerics.tolerance) * scene.setup.height / scene.units.height


def rounding_after(scene: Scene, so_far: float, contact: Contact, h: Array) -> float:
    """Return the certificate that single precision could not go below in this step, or when it failed; 0 where it does.

    `so_far` is that of the step before. Collective, where the contact has been solved in double precision instead.
    """
    if not scene.choices.single_operator.on or contact.u.dtype == np.float32:
        return 0.0
    reach = reach_of(scene, contact, h, np.float32)
    if so_far == 0.0:
        return reach
    return 0.0 if reach < LESS * so_far else so_far


def entries(scene: Scene, rounding: float) -> dict[str, Entry]:
    """Return its entry, where there is an operator in single precision; a checkpoint may lack it."""
    return {NAME: Entry(np.array(rounding), optional=True)} if scene.choices.single_operator.on else {}


def restored(saved: Saved) -> float:
    """Return the rounding of a checkpoint; 0 if it has none."""
    return float(saved[NAME]) if NAME in saved else 0.0

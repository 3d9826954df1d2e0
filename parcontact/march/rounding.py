"""Steps that single precision cannot solve: the next ones are solved in double precision from the start.

With `numerics.precision: mixed` a loose tolerance is reached with an operator in single precision, unless the load
moves the body by far more than the surface is high. Such a solve stalls, and is retried in double precision. The
rounding of its displacements over the length of the certificate says by how much they are too coarse; while that is
not less by half, steps are solved in double precision at once.
"""

import numpy as np

from ..parallel.slab import Array
from ..physics.entries import Entry, Saved
from ..scene import Scene
from ..solve.contact import Contact
from .failure import reach_of

NAME = "contact/rounding of single precision"  # in a checkpoint
LESS = 0.5  # tuning: of the rounding with which a solve has stalled: with that single precision is tried again


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

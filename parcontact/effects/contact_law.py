"""The contact law of a job: admissible pressures, and where surfaces touch in saved maps."""

import math

from ..job import Job
from ..job.added_sections import effects_of
from ..parallel.slab import Array
from ..solve.bounded import Bounded
from ..solve.constraint import Constraint, Mask, NonNegative


def constraint_of(job: Job, unit: float = 1.0, most: float = math.inf) -> Constraint:
    """Return the constraint of a job without a law of its own, for a `unit` of pressure [Pa]; pressures are at
    most `most` units."""
    hardness = job.material.hardness
    return NonNegative() if hardness is None or hardness / unit >= most else Bounded(hardness / unit)


def touching_of(job: Job, pressure: Array, gap: Array) -> Mask:
    """Return a map that is not 0 where surfaces touch, from saved maps of the pressure [Pa] and of the gap [m]."""
    for effect in effects_of(type(job).model_fields).values():
        touching = effect.touches(job, pressure, gap) if effect.decide(job).on and hasattr(effect, "touches") else None
        if touching is not None:
            return touching
    return constraint_of(job).touches(pressure)

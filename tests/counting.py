"""Small jobs on a wave, and all that the program counts for them."""

from collections import Counter
from typing import Any

from marched_jobs import marched

from parcontact.effects.effect import Decision
from parcontact.job import Job
from parcontact.march import choices

Json = dict[str, Any]
NX, NY = 24, 20
MAP = 8 * NX * NY  # bytes
WAVES = 16 * 3 * 3  # bytes of the lowest waves of a surface of 2 along x and 1 along y
ITERATIONS = 3
ELASTIC: Json = {"model": "elastic", "shear_modulus": 1e6}
RUBBER: Json = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]}
STAND: Json = {"pressure": 2e3}
PRESS: Json = {"pressure": {"from": 2e3, "to": 4e3}, "duration": 1e-3, "time_step": 2.5e-4}  # a jump and four steps
SLIDE: Json = {"pressure": 2e3, "velocity": 0.1, "distance": 4e-3 / NX, "cells_per_step": 1}
PART: Json = {**SLIDE, "cells_per_step": 0.5}
SPHERE: Json = {"shape": "sphere", "radius": 1e-2}


def job(**changes: Any) -> Job:
    grid = {"points": [NX, NY], "size": [1e-3, 1e-3], **changes.pop("grid", {})}
    numerics = {"tolerance": 1e-15, "max_iterations": ITERATIONS, "accept_unconverged": True}
    return Job.model_validate(
        {
            "grid": grid,
            "surface": {"shape": "wave", "amplitude": 1e-6, "waves": [2, 1]},
            "material": ELASTIC,
            "history": [STAND],
            **changes,
            "numerics": {**numerics, **changes.get("numerics", {})},
        }
    )


def whole(planned: Job) -> Counter[str]:
    """All that the program counts for a job."""
    march, _ = marched(planned)
    return march.scene.slab.tally.copy()


def extra(on: Job, off: Job) -> dict[str, int]:
    """What one job counts more than another."""
    more, less = whole(on), whole(off)
    return {name: more[name] - less[name] for name in {*more, *less} if more[name] != less[name] if "most" not in name}


def row(planned: Job, name: str) -> Decision:
    return next(effect for effect in choices.choices(planned).decisions if effect.name == name)


TRANSFORM = f"fft {NX}x{NY} float64"

"""Small jobs of every kind, for tests of their plan."""

from typing import Any

from parcontact.door.memory import StageCost
from parcontact.job import Job

Json = dict[str, Any]
ROUGH: Json = {
    "shape": "rough",
    "hurst": 0.8,
    "long_wavelength": 2.5e-4,
    "short_wavelength": 1.25e-4,
    "rms_slope": 0.02,
    "seed": 1,
}
TWO = {
    "model": "zener",
    "modulus_inf": 1e6,
    "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}, {"modulus": 2e6, "relaxation_time": 1e-4}],
}
PRESS = {"pressure": 1e4}
SLIDE = {"pressure": 1e4, "velocity": 0.1, "duration": 1e-3, "time_step": 1e-4}
CELLS = {"pressure": 1e4, "velocity": 0.1, "distance": 1.25e-4, "cells_per_step": 1}


def job(**changes: Any) -> Job:
    return Job.model_validate(
        {
            "grid": {"points": [48, 40], "size": [1e-3, 1e-3], **changes.pop("grid", {})},
            "surface": ROUGH,
            "material": {"model": "elastic", "shear_modulus": 1e6},
            "history": [PRESS],
            **changes,
        }
    )


JOBS: dict[str, Json] = {
    "elastic, static": {},
    "elastic, sliding": {"history": [CELLS]},
    "viscoelastic": {"material": TWO, "history": [CELLS]},
    "between cells": {"material": TWO, "history": [SLIDE]},
    "free": {"grid": {"boundary": "free"}, "surface": {"shape": "sphere", "radius": 1e-2}},
    "free, energies": {"grid": {"boundary": "free"}, "material": TWO, "history": [SLIDE], "output": {"energy": True}},
    "energies": {"material": TWO, "history": [CELLS], "output": {"energy": True}},
    "heat": {
        "material": TWO,
        "history": [SLIDE],
        "thermal": {"conductivity": 0.2, "diffusivity": 1e-7},
        "interface": {"shear_stress": 1e4},
    },
    "adhesion": {"history": [SLIDE], "adhesion": {"work": 0.05, "range": 2e-6}},
    "free, adhesion": {
        "grid": {"boundary": "free"},
        "surface": {"shape": "sphere", "radius": 1e-2},
        "adhesion": {"work": 0.05, "range": 2e-6},
    },
    "long cells": {"grid": {"size": [1e-3, 1e-5]}, "history": [SLIDE]},
    "waves of two cells": {"grid": {"points": 16}, "surface": {"shape": "wave", "amplitude": 1e-7, "waves": [8, 0]}},
    "mixed": {"history": [SLIDE], "numerics": {"precision": "mixed", "tolerance": 1e-4}},
    "mixed, loose": {"history": [SLIDE], "numerics": {"precision": "mixed"}},
    "thin layer": {"body": {"thickness": 1e-4}},
    "thinnest layer": {"body": {"thickness": 4.2e-5}, "history": [CELLS]},
    "free, mixed, loose": {
        "grid": {"boundary": "free"},
        "surface": {"shape": "sphere", "radius": 1e-2},
        "numerics": {"precision": "mixed"},
    },
}
SWEEP = {"history": [SLIDE], "sweep": [{"history.0.duration": [1e-3, 2e-3, 4e-3]}]}


def alike(steps: int, cost: dict[str, float]) -> StageCost:
    """A stage of which all steps were tried, each at such a cost."""
    stage = StageCost(steps)
    for _ in range(steps):
        stage.add(cost)
    return stage

"""A wave on a rubber, pressed and then slid over four cells: the smallest job with two stages."""

from typing import Any

JOB: dict[str, Any] = {
    "grid": {"points": [16, 12], "size": [1e-3, 7.5e-4]},
    "surface": {"shape": "wave", "amplitude": 1e-6, "waves": [2, 1]},
    "material": {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]},
    "history": [
        {"name": "press", "pressure": 1e4, "duration": 1e-3, "time_step": 2.5e-4},
        {"name": "slide", "pressure": 1e4, "velocity": 0.1, "distance": 2.5e-4, "cells_per_step": 1},
    ],
}
STEPS = 9  # a jump, 4 of pressing, 4 of sliding

"""Jobs that slide: a wave in full contact, and a rough surface."""

from typing import Any

import numpy as np
from marched_jobs import SLS

Json = dict[str, Any]

# one wave along x in full contact: 64 cells per wavelength of 0.25 mm, amplitude 0.5 um, 0.2 MPa
WAVELENGTH, HEIGHT, MEAN = 0.25e-3, 0.5e-6, 0.2e6
K, CELL = 2 * np.pi / WAVELENGTH, WAVELENGTH / 64
FAST = 1e3 / K  # m/s, at which it passes in 1 ms per radian


def wave(
    history: list[Json], waves: tuple[int, int] = (1, 0), points: tuple[int, int] = (64, 1), **numerics: Any
) -> Json:
    """A job in which `waves` of WAVELENGTH slide in full contact, solved to rounding."""
    return {
        "grid": {"points": list(points), "size": [WAVELENGTH, WAVELENGTH]},
        "surface": {"shape": "wave", "amplitude": HEIGHT, "waves": list(waves)},
        "material": SLS,
        "history": [{"pressure": MEAN, **stage} for stage in history],
        "numerics": {"tolerance": 1e-13, **numerics},
    }


TYRE = {  # made up: twelve decades
    "model": "zener",
    "modulus_inf": 1e6,
    "branches": [
        {"modulus": 1e6 * modulus, "relaxation_time": 5 * 10.0**exponent}
        for exponent, modulus in enumerate([300, 350, 220, 80, 24, 7, 2.4, 1.0, 0.5, 0.3, 0.2, 0.15], start=-9)
    ],
}


def rough(points: int, history: list[Json], **changes: Any) -> Json:
    """16 cells per shortest wave, rms slope 0.02, 0.1 MPa."""
    return {
        "grid": {"points": points, "size": 1e-3},
        "surface": {
            "shape": "rough",
            "hurst": 0.9,
            "long_wavelength": 2.5e-4,
            "rolloff_wavelength": 2.5e-4,
            "short_wavelength": 16e-3 / points,
            "rms_slope": 0.02,
            "seed": 1,
        },
        "material": TYRE,
        "history": [{"pressure": 1e5, **stage} for stage in history],
        **changes,
    }


def slide(points: int, cells: int, **more: Any) -> Json:
    """A stage of `rough`, over as many cells, one in a step."""
    return {"velocity": 0.3, "distance": cells * 1e-3 / points, "cells_per_step": 1, **more}


PRESS = {"duration": 1e-4, "time_step": {"first": 1e-9, "growth": 1.3}}

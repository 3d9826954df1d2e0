"""The small jobs that checks are made of, as data."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..physics.prony import Integrator

Json = dict[str, Any]

# one branch beside a spring: 2.75 MPa at once, a tenth of it in the end, relaxation time 1 ms, creep time 10 ms
PRONY = (0.275e6, [2.475e6], [1e-3])
GLASSY, LONG_TERM, RELAXATION, CREEP = 2.75e6, 0.275e6, 1e-3, 1e-2

# one wave: 0.25 mm long and 0.5 µm high, in full contact under 0.2 MPa
WAVELENGTH, HEIGHT, MEAN = 0.25e-3, 0.5e-6, 0.2e6
K = 2 * np.pi / WAVELENGTH
FAST = 1.0 / (K * RELAXATION)  # m/s, at which the wave passes in one relaxation time per radian

RADIUS = 1e-2  # m, of spheres
CELL = np.arcsinh(1.0) / np.pi  # displacement in the middle of a square cell under a pressure, over p side/G
INTEGRATORS: tuple[Integrator, ...] = ("exponential", "exponential-linear", "backward-euler")


def zener(modulus_inf: float, moduli: Sequence[float], times: Sequence[float]) -> Json:
    """A body of relaxing branches; elastic without."""
    if not len(moduli):
        return {"model": "elastic", "shear_modulus": modulus_inf}
    branches = [{"modulus": m, "relaxation_time": t} for m, t in zip(moduli, times, strict=True)]
    return {"model": "zener", "modulus_inf": modulus_inf, "branches": branches}


def wave(
    history: Sequence[Json], waves: tuple[int, int] = (1, 0), points: tuple[int, int] = (8, 3), **job: Any
) -> Json:
    """One wave on a square box; stages without a load are in full contact."""
    loads = {"pressure", "force", "approach"}
    return {
        "grid": {"points": list(points), "size": WAVELENGTH},
        "surface": {"shape": "wave", "amplitude": HEIGHT, "waves": list(waves)},
        "material": zener(*PRONY),
        "history": [{**({} if loads & stage.keys() else {"pressure": MEAN}), **stage} for stage in history],
        **job,
    }


def crossed(history: Sequence[Json], points: int = 16, **job: Any) -> Json:
    """Waves along both directions, in partial contact under some 20 kPa: mirror images in x and y."""
    surface = [{"shape": "wave", "amplitude": a, "waves": w} for a, w in ((HEIGHT, [1, 0]), (0.6 * HEIGHT, [0, 1]))]
    return wave(history, points=(points, points), **{"surface": surface, **job})


def sphere(history: Sequence[Json], points: int = 32, size: float = 3e-3, **job: Any) -> Json:
    """A sphere on a body without end."""
    return {
        "grid": {"points": points, "size": size, "boundary": "free"},
        "surface": {"shape": "sphere", "radius": RADIUS},
        "material": zener(*PRONY),
        "history": list(history),
        **job,
    }

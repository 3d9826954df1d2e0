"""Small jobs for checks, as mappings."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..physics.prony import Integrator

Json = dict[str, Any]

# one branch and a spring: modulus 2.75 MPa at once and 0.275 MPa at long times, relaxation time 1 ms, creep time 10 ms
PRONY = (0.275e6, [2.475e6], [1e-3])
GLASSY, LONG_TERM, RELAXATION, CREEP = 2.75e6, 0.275e6, 1e-3, 1e-2

# one wave: 0.25 mm long and 0.5 µm high, in full contact under 0.2 MPa
WAVELENGTH, HEIGHT, MEAN = 0.25e-3, 0.5e-6, 0.2e6
K = 2 * np.pi / WAVELENGTH
FAST = 1.0 / (K * RELAXATION)  # velocity at which the wave excites one radian per relaxation time [m/s]

RADIUS = 1e-2  # radius of spheres [m]
CELL = np.arcsinh(1.0) / np.pi  # displacement in the middle of a square cell under uniform pressure, over p side/G
INTEGRATORS: tuple[Integrator, ...] = ("exponential", "exponential-linear", "backward-euler")


def zener(modulus_inf: float, moduli: Sequence[float], times: Sequence[float]) -> Json:
    """Return a material with relaxing branches; an elastic one without."""
    if not len(moduli):
        return {"model": "elastic", "shear_modulus": modulus_inf}
    branches = [{"modulus": m, "relaxation_time": t} for m, t in zip(moduli, times, strict=True)]
    return {"model": "zener", "modulus_inf": modulus_inf, "branches": branches}


def wave(
    history: Sequence[Json], waves: tuple[int, int] = (1, 0), points: tuple[int, int] = (8, 3), **job: Any
) -> Json:
    """Return a job of one wave on a square box; stages without a load are in full contact."""
    loads = {"pressure", "force", "approach"}
    return {
        "grid": {"points": list(points), "size": WAVELENGTH},
        "surface": {"shape": "wave", "amplitude": HEIGHT, "waves": list(waves)},
        "material": zener(*PRONY),
        "history": [{**({} if loads & stage.keys() else {"pressure": MEAN}), **stage} for stage in history],
        **job,
    }


def crossed(history: Sequence[Json], points: int = 16, **job: Any) -> Json:
    """Return a job of two crossed waves, in partial contact at about 20 kPa, with mirror symmetry in x and y."""
    surface = [{"shape": "wave", "amplitude": a, "waves": w} for a, w in ((HEIGHT, [1, 0]), (0.6 * HEIGHT, [0, 1]))]
    return wave(history, points=(points, points), **{"surface": surface, **job})


def sphere(history: Sequence[Json], points: int = 32, size: float = 3e-3, **job: Any) -> Json:
    """Return a job of a sphere on a half space with free boundaries."""
    return {
        "grid": {"points": points, "size": size, "boundary": "free"},
        "surface": {"shape": "sphere", "radius": RADIUS},
        "material": zener(*PRONY),
        "history": list(history),
        **job,
    }

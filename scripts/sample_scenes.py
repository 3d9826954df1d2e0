"""Scenes on which error estimates and time steps are compared with the truth: rough surfaces, spheres, cylinders."""

from runs import Json

PRONY = [{"modulus": 2e6 * 3.0**-k, "relaxation_time": 1e-6 * 10.0**k} for k in range(5)]
RUBBER = {"model": "zener", "modulus_inf": 1e5, "branches": PRONY}
SOLID = {"model": "zener", "modulus_inf": 0.275e6, "branches": [{"modulus": 2.475e6, "relaxation_time": 1e-3}]}


def rough(points: int, pressure: float, *stages: Json, material: Json = RUBBER, steady_at: float | None = None) -> Json:
    """Stages at one pressure, from a virgin body or from steady sliding."""
    wave = min(16e-3 / points, 1.25e-4)  # 16 cells where the box has room for two such waves in its longest
    surface = {"shape": "rough", "hurst": 0.9, "long_wavelength": 2.5e-4, "short_wavelength": wave, "rms_slope": 0.02}
    history = [{"pressure": pressure, **stage} for stage in stages]
    job: Json = {"grid": {"points": points, "size": 1e-3}, "surface": surface, "material": material, "history": history}
    if steady_at is not None:
        job["initial"] = {"state": "steady", "velocity": steady_at, "pressure": pressure}
    return job


def sphere(points: int, *stages: Json) -> Json:
    return {
        "grid": {"points": points, "size": 6e-3, "boundary": "free"},
        "surface": {"shape": "sphere", "radius": 1e-2, "center": [2e-3, 3e-3]},
        "material": SOLID,
        "history": [{"force": 0.15, **stage} for stage in stages],
    }


def cylinder(points: int, *stages: Json) -> Json:
    return {
        "grid": {"points": [4 * points, 1], "size": [4e-3, 1e-3]},
        "surface": {"shape": "cylinder", "radius": 1e-2, "center": [1.5e-3, 0.0]},
        "material": SOLID,
        "history": [{"pressure": 2e4, **stage} for stage in stages],
    }


def slide(velocity: float, distance: float) -> Json:
    return {"velocity": velocity, "distance": distance}

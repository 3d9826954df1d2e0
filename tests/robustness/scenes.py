"""Random scenes, as hard as they come: bodies, surfaces, grids, histories.

All choices follow from a seeded `random.Random`.
"""

from dataclasses import dataclass, field
from pathlib import Path
from random import Random

import numpy as np

from parcontact.job import Job

from .stories import Json, Map, Storyteller, decades

SIDES = (1, 2, 3, 5, 8, 12, 13, 16, 17, 24, 31, 64)  # points; primes among them
MOST_POINTS = 576


@dataclass(frozen=True)
class Sketch:
    """A job whose surface is a map of heights [m], and maybe a shape of its own; `offset` [m] is added to all of them.

    Without `energy` branches that the job cannot tell from springs are folded, as far as numerics.branch_error allows.
    """

    heights: Map
    size: tuple[float, float]
    boundary: str
    material: Json
    history: tuple[Json, ...]
    numerics: Json = field(default_factory=dict)
    offset: float = 0.0
    energy: bool = True
    shape: Json = field(default_factory=dict)

    def job(self, directory: Path) -> Job:
        """The job, its heights in a file of this directory."""
        path = directory / "heights.npy"
        np.save(path, self.heights)
        ny, nx = self.heights.shape
        constant = {"shape": "wave", "amplitude": self.offset, "waves": [0, 0]}
        return Job.model_validate(
            {
                "grid": {"points": [nx, ny], "size": list(self.size), "boundary": self.boundary},
                "surface": [
                    {"shape": "file", "path": str(path)},
                    *([constant] if self.offset else []),
                    *([self.shape] if self.shape else []),
                ],
                "material": self.material,
                "history": list(self.history),
                "numerics": self.numerics,
                "output": {"energy": self.energy},
            }
        )


# -- bodies and surfaces ----------------------------------------------------------------------------------------------


def material(dice: Random) -> Json:
    """1 to 15 branches over 20 decades of time and 12 of modulus, or none, around a modulus of any size."""
    scale = decades(dice, -3, 9)
    poisson = dice.choice([0.5, 0.5, 0.0, -0.5, 0.3])
    if dice.random() < 0.1:
        return {"model": "elastic", "poisson": poisson, "shear_modulus": scale}
    branches = [branch(dice, scale) for _ in range(dice.randint(1, 15))]
    long_term = dice.choice([0.0, scale * decades(dice, -6, 6)])
    return {"model": "zener", "poisson": poisson, "modulus_inf": long_term, "branches": branches}


def branch(dice: Random, scale: float) -> Json:
    """In one of the two forms."""
    modulus, time = scale * decades(dice, -6, 6), decades(dice, -10, 10)
    if dice.random() < 0.8:
        return {"modulus": modulus, "relaxation_time": time}
    kelvin = dice.choice([0.0, modulus * decades(dice, -3, 3)])
    return {"G0": modulus, "G1": kelvin, "eta1": time * (modulus + kelvin)}


def shape(dice: Random) -> tuple[int, int]:
    """Rows and columns of a grid: one row, one column, primes, squares."""
    nx = dice.choice(SIDES)
    ny = dice.choice([side for side in SIDES if side * nx <= MOST_POINTS and side + nx > 2])
    return ny, nx


def heights(dice: Random, ny: int, nx: int) -> Map:
    """A surface of height about 1."""
    random = np.random.default_rng(dice.getrandbits(32))
    y, x = np.meshgrid((np.arange(ny) + 0.5) / ny - 0.5, (np.arange(nx) + 0.5) / nx - 0.5, indexing="ij")
    kind = dice.choice(["noise", "rough", "spike", "pit", "waves", "sphere", "cylinder", "flat"])
    if kind == "noise":  # everything up to the Nyquist wavenumber
        return random.standard_normal((ny, nx))
    if kind == "rough":
        wave_number = np.hypot(np.fft.fftfreq(ny, 1 / ny)[:, None], np.fft.rfftfreq(nx, 1 / nx)[None, :])
        spectrum = np.fft.rfft2(random.standard_normal((ny, nx))) / np.maximum(wave_number, 1.0) ** 1.8
        return np.fft.irfft2(spectrum, s=(ny, nx))
    if kind in ("spike", "pit"):
        result = np.zeros((ny, nx))
        result[random.integers(ny), random.integers(nx)] = 1.0 if kind == "spike" else -1.0
        return result
    if kind == "waves":
        along_x, along_y = random.integers(0, max(nx // 2, 1)), random.integers(0, max(ny // 2, 1))
        return np.cos(2 * np.pi * along_x * x) * np.cos(2 * np.pi * along_y * y + 0.3)
    if kind == "sphere":
        return -(x**2) - y**2
    if kind == "cylinder":
        return -(x**2) if nx > 1 else -(y**2)
    return np.zeros((ny, nx))


def formula(dice: Random, size: tuple[float, float], points: tuple[int, int], height: float) -> Json:
    """A round shape, or roughness by its spectrum, of about this height [m]."""
    longest, cell = max(size), max(length / count for length, count in zip(size, points, strict=True) if count > 1)
    round_shape = {"radius": longest**2 / (8.0 * height), "profile": dice.choice(["exact", "paraboloid"])}
    kind = dice.choice(["sphere", "cylinder", "rough"])
    if kind == "rough" and 2.0 * cell < min(size) / 2.0:
        return {
            "shape": "rough",
            "hurst": dice.uniform(0.1, 1.0),
            "long_wavelength": longest,
            "short_wavelength": 2.0 * cell,
            "rms_height": height,
            "seed": dice.randint(0, 9),
        }
    return {"shape": "sphere" if kind == "sphere" else "cylinder", **round_shape}


def box(dice: Random) -> tuple[float, float]:
    """Sides [m] from nanometres to kilometres, up to 10 000 : 1."""
    length, stretch = decades(dice, -7, 3), dice.choice([0.0, dice.uniform(-4, 4)])
    return length, length * 10.0**stretch


def sketch(dice: Random, stages: int = 6) -> Sketch:
    """A scene of at most so many stages."""
    body, (ny, nx), size = material(dice), shape(dice), box(dice)
    height = min(size) * decades(dice, -6, 0)
    surface = height * heights(dice, ny, nx)
    own = formula(dice, size, (nx, ny), height) if dice.random() < 0.2 else {}
    boundary = dice.choice(["periodic", "periodic", "free"])
    controls = ("pressure", "force") if own else ("pressure", "pressure", "force", "approach")
    history = Storyteller(dice, surface, size, boundary == "periodic", body, controls).history(stages)
    numerics = {
        "tolerance": dice.choice([2e-3, 2e-3, 2e-5, 2e-7]),  # 1e-4, 1e-6 and 1e-8 of the surface's height
        "integrator": dice.choice(["exponential", "exponential", "backward-euler"]),
        "kernel": "love" if boundary == "free" else dice.choice(["spectral", "spectral", "love"]),
        "precision": dice.choice(["double"] * 9 + ["mixed"]),
        "branch_error": dice.choice([0.0, 1e-3]),
    }
    return Sketch(surface, size, boundary, body, history, numerics, energy=dice.random() < 0.7, shape=own)

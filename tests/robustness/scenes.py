"""Random scenes, as hard as they come: bodies, surfaces, grids, histories.

All choices follow from a seeded `random.Random`.
"""

import math
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
from numpy.typing import NDArray

from parcontact.job import Job

Map = NDArray[np.floating]
Json = dict[str, Any]


def decades(dice: Random, low: float, high: float) -> float:
    """A number whose logarithm is uniform between those of `10**low` and `10**high`."""
    return 10.0 ** dice.uniform(low, high)


@dataclass
class Storyteller:
    """Makes one stage after another; remembers the last load and the last way [m], to go on from or go back."""

    dice: Random
    surface: Map
    size: tuple[float, float]
    periodic: bool
    body: Json
    controls: tuple[str, ...]
    load: Json = field(default_factory=dict)
    way: tuple[float, float] = (0.0, 0.0)

    def history(self, most: int) -> tuple[Json, ...]:
        """A jump from nothing and up to a given number of stages."""
        return (self.jump(), *(self.stage() for _ in range(self.dice.randint(1, most))))

    def stage(self) -> Json:
        tell = self.dice.choice([self.jump, self.ramp, self.dwell, self.dwell, self.slide, self.slide, self.unload])
        return tell()

    def jump(self) -> Json:
        return self._loaded(0.0)

    def ramp(self) -> Json:
        duration, before = self._duration(), self.load
        ((name, end),) = self._loaded(duration).items()
        start = -float(self.surface.max()) if name == "approach" else 0.5 * end
        return {name: {"from": before.get(name, start), "to": end}, **self._steps(duration)}

    def dwell(self) -> Json:
        duration = self._duration()
        return {**self._kept(duration), **self._steps(duration)}

    def unload(self) -> Json:
        """Completely, for a while."""
        self.load = {"pressure": 0.0}
        duration = self._duration()
        return {"pressure": 0.0, **self._steps(duration)}

    def slide(self) -> Json:
        """By whole cells along x, or by any part of them in any direction, a shape's way on or its way back."""
        dice, columns = self.dice, self.surface.shape[1]
        duration, steps = self._duration(), dice.randint(2, 12)
        if self.way == (0.0, 0.0) or dice.random() < 0.5:
            cells = dice.choice([1.0, 2.0, 0.37, 3.3]) * steps * self.size[0] / columns
            angle = dice.choice([0.0, math.pi, math.pi / 2, dice.uniform(0, 2 * math.pi)])
            self.way = (cells * round(math.cos(angle), 12), cells * round(math.sin(angle), 12))
        else:
            self.way = (-self.way[0], -self.way[1])
        velocity = [way / duration for way in self.way]
        return {**self._kept(duration), "velocity": velocity, "duration": duration, "time_step": duration / steps}

    def _duration(self) -> float:
        return decades(self.dice, -11, 11)

    def _steps(self, duration: float) -> Json:
        """A few equal ones, or one for each decade."""
        count = self.dice.randint(1, 10)
        if self.dice.random() < 0.5:
            return {"duration": duration, "time_step": duration / count}
        return {"duration": duration, "time_step": {"first": duration * 10.0**-count, "growth": 10.0}}

    def _kept(self, duration: float) -> Json:
        return dict(self.load) if self.load and self.dice.random() < 0.7 else self._loaded(duration)

    def _loaded(self, duration: float) -> Json:
        """A load of any size for a motion that takes this long."""
        control = self.dice.choice(self.controls)
        if control == "approach":
            top, mean = float(self.surface.max()), float(self.surface.mean())
            depth = self.dice.uniform(0.0, 0.95 if self.periodic else 3.0)
            self.load = {"approach": -top + depth * (top - mean)}
        else:
            unit = full_contact(self.surface, self.size, self.body["poisson"]) * effective_modulus(self.body, duration)
            pressure = unit * decades(self.dice, -8, 1)
            area = self.size[0] * self.size[1]
            self.load = {"pressure": pressure} if control == "pressure" else {"force": pressure * area}
        return dict(self.load)


def effective_modulus(body: Json, time: float) -> float:
    """About what resists a motion that takes `time` [s]; not zero for a fluid."""
    if body["model"] == "elastic":
        return float(body["shear_modulus"])
    total: float = body["modulus_inf"]
    for b in body["branches"]:
        if "modulus" in b:
            total += b["modulus"] * min(1.0, b["relaxation_time"] / time if time else 1.0)
        else:
            series = b["G0"] + b["G1"]
            total += b["G0"] / series * (b["G1"] + b["G0"] * min(1.0, b["eta1"] / series / time if time else 1.0))
    return total


def full_contact(surface: Map, size: tuple[float, float], poisson: float) -> float:
    """Mean pressure over modulus at which a periodic body touches everywhere; that of a slope of one cell if flat."""
    ny, nx = surface.shape
    qy, qx = np.fft.fftfreq(ny, size[1] / ny)[:, None], np.fft.rfftfreq(nx, size[0] / nx)[None, :]
    pressure = np.fft.irfft2(2 * np.pi * np.hypot(qx, qy) * np.fft.rfft2(surface), s=(ny, nx)) / (1 - poisson)
    return max(-float(pressure.min()), 0.0) or 1e-3


# -- scenes -----------------------------------------------------------------------------------------------------------

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
    """A scene of at most a given number of stages."""
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

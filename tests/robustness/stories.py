"""Random histories: jumps and ramps of the load over nine decades, rest over many decades of time, sliding there and
back, complete unloading."""

import math
from dataclasses import dataclass, field
from random import Random
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
        """A jump from nothing and up to so many stages."""
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

"""Random scenes with known errors: each is a job on a grid, and the same job on a finer grid.

All choices follow from the number of a scene. Surfaces are given by wavelengths and seeds, which do not depend on the
grid: a finer grid has the same surface in the same box for the same time. Maps are sums of waves at the points of each
grid, so they are not interpolated.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
from numpy.typing import NDArray

Json = dict[str, Any]
Map = NDArray[np.float64]
SECOND = 1e-3  # relaxation times are within some decades of it [s]
HISTORIES = {
    "static": 8,
    "rest": 6,
    "ramp": 8,
    "slide": 20,
    "velocity step": 9,
    "reversal": 9,
    "oblique": 11,
    "steady start": 4,
    "steady": 25,
}
SLIDES = ("slide", "velocity step", "reversal", "oblique", "steady start", "steady")
EFFECTS = {"none": 60, "layer": 12, "hardness": 9, "heat": 12, "adhesion": 7}
SURFACES = {"rough": 40, "wave": 12, "sphere": 16, "cylinder": 12, "measured": 20}
FINER = 4  # refinement of the grid of a reference


@dataclass(frozen=True)
class Sketch:
    """A scene: its job without maps, the waves of a measured map by their numbers along x and y, and its classes."""

    number: int
    plain: Json
    waves: dict[tuple[int, int], complex]
    kind: Json

    def job(self, directory: Path, finer: int = 1, sharper: float = 1.0) -> Json:
        """Return the job on a grid `finer` times as fine, with `sharper` times the accuracy; write its map into the
        directory."""
        grid = self.plain["grid"]
        points = [n * finer if n > 1 else 1 for n in grid["points"]]
        numerics = {**self.plain["numerics"], "accuracy": self.plain["numerics"]["accuracy"] / sharper}
        if finer > 1:
            numerics.pop("integrator", None)
        job = {**self.plain, "grid": {**grid, "points": points}, "numerics": numerics}
        if "history" in job:
            job["history"] = [_finer(stage, finer) for stage in job["history"]]
        if self.waves:
            path = directory / f"map_{self.number}_{points[0]}.npy"
            np.save(path, heights(self.waves, points[0], points[1]))
            job["surface"] = [{"shape": "file", "path": str(path)}, *self.plain["surface"]]
        return job


def _finer(stage: Json, finer: int) -> Json:
    """Steps that are given a given number of times finer; cells already are."""
    step = stage.get("time_step")
    if isinstance(step, dict):
        return {**stage, "time_step": {"first": step["first"] / finer, "growth": step["growth"] ** (1.0 / finer)}}
    return {**stage, "time_step": step / finer} if step else stage


def heights(waves: dict[tuple[int, int], complex], nx: int, ny: int) -> Map:
    """Their sum at the points of a grid."""
    spectrum = np.zeros((ny, nx), complex)
    for (x, y), amplitude in waves.items():
        spectrum[y % ny, x % nx] += 0.5 * amplitude
        spectrum[-y % ny, -x % nx] += 0.5 * amplitude.conjugate()
    return np.asarray(np.fft.ifft2(spectrum).real * nx * ny)


def sketch(number: int) -> Sketch:
    """The scene of this number."""
    return _Draw(number).sketch()


def decades(dice: Random, low: float, high: float) -> float:
    return float(10.0 ** dice.uniform(low, high))


class _Draw:
    """One after the other: kinds, grid, body, surface, loads, history."""

    def __init__(self, number: int) -> None:
        self.number, self.dice = number, Random(f"coverage {number}")
        dice = self.dice
        self.effect = dice.choices(list(EFFECTS), list(EFFECTS.values()))[0]
        fits = {"hardness": ("static", "rest", "ramp", "slide", "velocity step", "reversal"), "adhesion": ("ramp",)}
        fits["heat"] = ("slide", "velocity step", "steady")
        histories = {name: HISTORIES[name] for name in fits.get(self.effect, HISTORIES)}
        self.history = dice.choices(list(histories), list(histories.values()))[0]
        self.surface = dice.choices(list(SURFACES), list(SURFACES.values()))[0]
        if self.effect == "adhesion":
            self.surface = dice.choice(["sphere", "wave", "rough"])
        free = {"sphere": 0.6, "cylinder": 0.0, "rough": 0.2, "measured": 0.15, "wave": 0.0}[self.surface]
        self.free = self.history != "steady start" and self.effect != "layer" and dice.random() < free
        self.points = self._points()
        self.size = decades(dice, -4, -2)
        self.dx = self.size / self.points[0]
        elastic = 0.2 if self.history not in ("velocity step", "steady start", "steady") else 0.05
        elastic = 0.0 if self.effect == "heat" else elastic
        self.body = self._elastic() if dice.random() < elastic else self._zener()
        self.cells = min(decades(dice, math.log10(2.05), math.log10(16.0)), max(self.points) / 2.6)
        self.waves: dict[tuple[int, int], complex] = {}

    def sketch(self) -> Sketch:
        shapes, length, slope, radius = self._shapes()
        speed = self._speed(length)
        area = self._area()
        stiffness = self._stiffness(speed / length if self.history in SLIDES else 1.0 / SECOND)
        pressure = stiffness * (
            _round_pressure(self.surface, radius, area, self.size, self.points)
            if radius
            else slope * (2.0 * area + 8.0 * max(area - 0.5, 0.0))
        )
        accuracy = round(decades(self.dice, math.log10(0.005), -1.0), 5)
        plain: Json = {
            "title": f"coverage, scene {self.number}",
            "grid": {"points": self.points, "size": [self.dx * n if n > 1 else self.size for n in self.points]},
            "surface": shapes,
            "material": self.body,
            "numerics": {"accuracy": accuracy, "branch_error": 0.1 * accuracy},
        }
        if self.free:
            plain["grid"]["boundary"] = "free"
        if self.history not in ("steady", "static", "steady start") and self.dice.random() < 0.08:
            plain["numerics"]["integrator"] = "backward-euler"
        self._story(plain, pressure, speed)
        self._add_effect(plain, pressure, pressure / area)
        kind = {
            "body": "elastic" if self.body["model"] == "elastic" else _branches(len(self.body["branches"])),
            "surface": self.surface,
            "boundary": "free" if self.free else "line" if 1 in self.points else "periodic",
            "history": self.history,
            "effect": self.effect,
            "cells": round(2.0 * self._radius(area) if radius else self.cells, 2),
            "asked": accuracy,
        }
        return Sketch(self.number, plain, self.waves, kind)

    # -- body and surface ----------------------------------------------------------------------------------------------

    def _points(self) -> list[int]:
        dice = self.dice
        if self.surface in ("cylinder", "wave") and not self.free and dice.random() < 0.5:
            return [dice.choice([64, 96, 128, 128]), 1] if self.effect != "adhesion" else [64, 1]
        few = self.history in ("static", "steady", "rest")
        n = dice.choice([48, 64, 96] if few else [32, 48, 64, 80])
        n = dice.choice([24, 32]) if self.effect == "adhesion" else n
        return [n, n // 2] if dice.random() < 0.2 and self.surface in ("rough", "measured") else [n, n]

    def _elastic(self) -> Json:
        return {"model": "elastic", "shear_modulus": decades(self.dice, 5, 8)}

    def _zener(self) -> Json:
        dice, scale = self.dice, decades(self.dice, 4, 8)
        branches = [
            {"modulus": scale * decades(dice, -1.5, 1.5), "relaxation_time": SECOND * decades(dice, -3, 3)}
            for _ in range(dice.choice([1, 1, 2, 3, 5, 8, 12]))
        ]
        total = sum(branch["modulus"] for branch in branches)
        return {"model": "zener", "modulus_inf": total * decades(dice, -3, 0.5), "branches": branches}

    def _speed(self, length: float) -> float:
        """Return a speed [m/s] at which sliding by `length` [m] takes about a relaxation time; in every fourth scene
        any speed."""
        if self.body["model"] == "elastic" or self.dice.random() < 0.25:
            return length / SECOND * decades(self.dice, -5, 5)
        branches = self.body["branches"]
        branch = self.dice.choices(branches, [b["modulus"] for b in branches])[0]
        return float(length / branch["relaxation_time"] * decades(self.dice, -1.5, 1.0))

    def _stiffness(self, frequency: float) -> float:
        """Return |G| [Pa] at a frequency [1/s]."""
        if self.body["model"] == "elastic":
            return float(self.body["shear_modulus"])
        turns = [(b["modulus"], 2j * math.pi * frequency * b["relaxation_time"]) for b in self.body["branches"]]
        return float(abs(self.body["modulus_inf"] + sum(g * w / (1.0 + w) for g, w in turns)))

    def _shapes(self) -> tuple[list[Json], float, float, float]:
        """Return the shapes except maps, a typical wavelength or length [m], the rms slope, and the radius of a round
        shape, or 0."""
        dice, short = self.dice, self.cells * self.dx
        radius = self.size * decades(dice, 0.5, 1.5)
        long = min(self.size * dice.choice([1.0, 0.5, 0.5]), self.dx * min(n for n in self.points if n > 1))
        long, slope, hurst = max(long, 1.3 * short), decades(dice, -2, -0.5), round(dice.uniform(0.3, 1.0), 2)
        below: list[Json] = []
        if self.free or self.surface in ("sphere", "cylinder"):
            shape = "cylinder" if self.surface == "cylinder" else "sphere"
            below = [{"shape": shape, "radius": radius, "center": self._center()}]
        if self.surface in ("sphere", "cylinder"):
            return below, 0.1 * self.size, 0.0, radius
        if self.surface == "wave":
            count = max(1, round(self.points[0] / self.cells))
            amplitude = slope * self.size / (2.0 * math.pi * count) * math.sqrt(2.0)
            across = 0 if 1 in self.points else dice.choice([0, 0, count, max(1, count // 2)])
            phase = dice.uniform(0.0, 6.0)
            self.cells = self.points[0] / count
            shapes = [{"shape": "wave", "amplitude": amplitude, "waves": [count, 0], "phase": phase}]
            if across:
                shapes.append({"shape": "wave", "amplitude": amplitude, "waves": [0, across], "phase": phase})
            return shapes, self.size / count, slope, 0.0
        if self.free:
            slope = min(slope, 0.1 * self.size / radius)
            below[0]["center"] = [0.4 * self.size, 0.5 * self.dx * self.points[1]]
        length = math.sqrt(long * short)
        if self.surface == "measured":
            self.waves = self._measured(long, short, hurst, slope)
            return below, length, slope, radius if self.free else 0.0
        rough = {"shape": "rough", "hurst": hurst, "long_wavelength": long, "short_wavelength": short}
        rough |= {"rms_slope": slope, "seed": dice.randint(0, 10**6)}
        return [rough, *below], length, slope, radius if self.free else 0.0

    def _center(self) -> list[float]:
        """Return a random position between points near the middle; in a free box at 0.38 of its length, so that the
        contact stays inside."""
        dice, (nx, ny) = self.dice, self.points
        return [((0.38 if self.free else 0.5) * nx + dice.random()) * self.dx, (0.5 * ny + dice.random()) * self.dx]

    def _measured(self, long: float, short: float, hurst: float, slope: float) -> dict[tuple[int, int], complex]:
        nx, ny = self.points
        random, waves, square = np.random.default_rng([7, self.number]), {}, 0.0
        for x in range(0, nx // 2):
            for y in range(-(ny // 2) + 1, ny // 2):
                k = math.hypot(x / (nx * self.dx), y / (ny * self.dx))
                if (x or y > 0) and 1.0 / long * 0.999 <= k <= 1.0 / short:
                    a = complex(*random.standard_normal(2)) * k ** -(1.0 + hurst)
                    waves[x, y], square = a, square + 0.5 * abs(2.0 * math.pi * k * a) ** 2
        return {index: a * slope / math.sqrt(square) for index, a in waves.items()}

    # -- loads and motion ----------------------------------------------------------------------------------------------

    def _area(self) -> float:
        dice = self.dice
        if self.surface in ("sphere", "cylinder") or self.free:
            return decades(dice, -3 if dice.random() < 0.3 else -2, math.log10(0.1))
        return dice.uniform(0.5, 1.1) if dice.random() < 0.25 else decades(dice, -3, -0.3)

    def _radius(self, area: float) -> float:
        """Return the radius of one contact in cells."""
        count = self.points[0] * self.points[1]
        if self.surface == "cylinder":
            return 0.5 * area * self.points[0]
        return math.sqrt(area * count / math.pi)

    def _story(self, plain: Json, p: float, v: float) -> None:
        dice, dx = self.dice, self.dx
        way, rest = dice.uniform(4.0, 16.0) * dx, SECOND * decades(dice, -2, 2)
        if self.free:
            way = min(way, 0.2 * self.size)
        stepping: Callable[[], Json] = lambda: {}  # noqa: E731
        if dice.random() < 0.4:
            cells = dice.choice([0.5, 1.0, 1.0, 2.0, 0.37])
            stepping = lambda: {"cells_per_step": cells}  # noqa: E731
        grown = {"time_step": {"first": rest / 200.0, "growth": dice.choice([1.2, 1.5, 2.0])}}
        resting = {} if dice.random() < 0.6 else grown
        angle = dice.choice([0.25, 0.5, dice.uniform(0.05, 0.95)]) * math.pi
        press = {"name": "press", "pressure": p, "duration": rest, **resting}
        before = [press] if dice.random() < 0.5 else []

        def slide(velocity: Any, far: float, load: Any = p) -> Json:
            return {"name": "slide", "pressure": load, "velocity": velocity, "distance": far, **stepping()}

        if self.history == "steady":
            oblique = 1 not in self.points and dice.random() < 0.3
            direction = [math.cos(angle), math.sin(angle)] if oblique else [1.0, 0.0]
            plain["steady"] = {"velocities": [v], "pressures": [p], "direction": direction}
        elif self.history == "static":
            plain["history"] = [{"name": "press", "pressure": p}]
        elif self.history == "rest":
            plain["history"] = [press]
        elif self.history == "ramp":
            ramp = {"name": "ramp", "pressure": {"from": 0.0, "to": p}, "duration": rest}
            back = {"name": "back", "pressure": {"from": p, "to": 0.3 * p}, "duration": rest}
            plain["history"] = [ramp, back] if dice.random() < 0.5 else [ramp, press]
        elif self.history == "slide":
            load: Any = p if dice.random() < 0.7 else {"from": 0.4 * p, "to": p}
            plain["history"] = [*before, slide(v, way, load)]
        elif self.history == "velocity step":
            plain["history"] = [*before, slide(v, 0.5 * way), slide(v * decades(dice, -1.5, 1.5), 0.5 * way)]
        elif self.history == "reversal":
            plain["history"] = [*before, slide(v, 0.6 * way), slide(-v, 0.6 * way)]
        elif self.history == "oblique":
            across = 1 in self.points
            velocity = [v * math.cos(angle), 0.0 if across else v * math.sin(angle)]
            plain["history"] = [*before, slide(velocity if abs(velocity[0]) > 0.01 * v or not across else v, way)]
        elif self.history == "steady start":
            plain["initial"] = {"state": "steady", "velocity": v, "pressure": p}
            plain["history"] = [slide(v * decades(dice, -1.5, 1.5), way)]

    def _add_effect(self, plain: Json, p: float, mean: float) -> None:
        """Add a layer, a hardness, heat, or adhesion with its own history; `mean` is the mean pressure in the contact
        [Pa]."""
        dice = self.dice
        if self.effect == "layer":
            base = dice.choice(["bonded", "smooth"])
            plain["body"] = {"thickness": max(2.0 * self.dx, self.size * decades(dice, -1.3, 0.0)), "base": base}
        elif self.effect == "hardness":
            plain["material"] = {**plain["material"], "hardness": max(1.5 * p, mean * decades(dice, -0.2, 0.5))}
        elif self.effect == "heat":
            plain["thermal"] = {"conductivity": 0.2, "diffusivity": 1e-7}
        elif self.effect == "adhesion":
            self._stick(plain)
        if "history" in plain and "initial" not in plain and (self.effect == "adhesion" or dice.random() < 0.4):
            plain["output"] = {"energy": True}

    def _stick(self, plain: Json) -> None:
        """Add adhesion: press and pull over about the height of the surface, with a process zone of two to eight
        cells."""
        dice, modulus = self.dice, 4.0 * self.body.get("modulus_inf", self.body.get("shear_modulus"))
        shape, zone = plain["surface"][0], self.dx * decades(dice, 0.3, 0.9)
        top, height = 0.0, self.size**2 / (8.0 * shape.get("radius", 1.0))
        if "radius" not in shape:
            waves = self.dx * self.cells if shape["shape"] == "rough" else self.size / shape["waves"][0]
            height = 2.0 * shape.get("amplitude", shape.get("rms_slope", 0.0) * waves)
            top = 0.5 * height * len(plain["surface"]) if shape["shape"] == "wave" else 1.5 * height
        work = modulus * height**2 / self.size * decades(dice, -2.0, 0.0)
        plain["adhesion"] = {"work": work, "range": math.sqrt(zone * work / modulus)}
        far, near, rest = -top - 0.3 * height, 0.2 * height - top, SECOND * decades(dice, -1, 1)
        press = {"name": "press", "approach": {"from": far, "to": near}, "duration": rest}
        pull = {"name": "pull", "approach": {"from": near, "to": far}, "duration": rest * decades(dice, -1, 1)}
        plain["history"] = [press, pull]


def _branches(count: int) -> str:
    return "1 branch" if count == 1 else "2 to 5" if count <= 5 else "8 to 12"


def _round_pressure(surface: str, radius: float, area: float, size: float, points: list[int]) -> float:
    """Return the mean pressure over the shear modulus for which Hertz's contact is this share of the box."""
    share = points[1] / points[0] if points[1] > 1 else 1.0
    if surface == "cylinder":
        return math.pi * (0.5 * area * size) ** 2 / radius / size
    return 16.0 / 3.0 * math.sqrt(area * share * size**2 / math.pi) ** 3 / radius / (share * size**2)

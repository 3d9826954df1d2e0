"""The same scene described in another way: what must come out identical."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from random import Random
from typing import Any

import numpy as np

from .scenes import Json, Map, Sketch, decades


@dataclass(frozen=True)
class Twin:
    """A sketch that must give the same as another: its maps of pressures [Pa] `stated` back; `exact` to the last
    bit."""

    name: str
    sketch: Sketch
    stated: Callable[[Map], Map]
    exact: bool = False


def twin(dice: Random, of: Sketch) -> Twin:
    """One of them."""
    others = [*([] if of.shape else [mirrored, transposed]), *([] if of.energy else [folded, folded])]
    return dice.choice([offset, scaled, *others])(dice, of)


def folded(dice: Random, of: Sketch) -> Twin:
    """With a map for every branch, if it did without some; without some, if it had all."""
    numerics = {**of.numerics, "branch_error": 0.0 if of.numerics["branch_error"] else 1e-3}
    return Twin("branch_error", replace(of, numerics=numerics), lambda p: p)


def offset(dice: Random, of: Sketch) -> Twin:
    """The surface higher or lower by up to 1e6 times its height."""
    added = (float(np.ptp(of.heights)) or _shape_height(of)) * decades(dice, -2, 6) * dice.choice([-1, 1])
    history = tuple(_higher(stage, added) for stage in of.history)
    return Twin("offset", replace(of, offset=of.offset + added, history=history), lambda p: p)


def _shape_height(of: Sketch) -> float:
    """At least about that of the shape on the box [m], or a length of the box if there is none."""
    rough, radius = of.shape.get("rms_height", 0.0), of.shape.get("radius", math.inf)
    return float(rough or min(of.size) ** 2 / radius or of.size[0])


def scaled(dice: Random, of: Sketch) -> Twin:
    """Other units of length, modulus and time: powers of two, so that every digit is the same."""
    return Twin("scaling", *rescaled(of, *(2.0 ** dice.randint(-40, 40) for _ in range(3))), exact=True)


def rescaled(of: Sketch, length: float, modulus: float, time: float) -> tuple[Sketch, Callable[[Map], Map]]:
    """The same scene in units that are a given number of times smaller, and what turns its pressures back."""
    factors = {
        **dict.fromkeys(("shear_modulus", "modulus_inf", "modulus", "G0", "G1", "pressure"), modulus),
        **dict.fromkeys(("radius", "rms_height", "long_wavelength", "short_wavelength", "approach"), length),
        **dict.fromkeys(("relaxation_time", "duration", "time_step", "first"), time),
        **{"force": modulus * length**2, "eta1": modulus * time, "velocity": length / time},
    }
    sketch = replace(
        of,
        heights=of.heights * length,
        size=(of.size[0] * length, of.size[1] * length),
        offset=of.offset * length,
        material=_times(of.material, factors),
        shape=_times(of.shape, factors),
        history=tuple(_times(stage, factors) for stage in of.history),
    )
    return sketch, lambda p: p / modulus


def mirrored(dice: Random, of: Sketch) -> Twin:
    """In a plane across x."""
    history = tuple(_each_velocity(stage, lambda x, y: [-x, y]) for stage in of.history)
    return Twin("mirror image", replace(of, heights=of.heights[:, ::-1], history=history), lambda p: p[:, ::-1])


def transposed(dice: Random, of: Sketch) -> Twin:
    """x and y exchanged."""
    history = tuple(_each_velocity(stage, lambda x, y: [y, x]) for stage in of.history)
    return Twin("transposition", replace(of, heights=of.heights.T, size=of.size[::-1], history=history), lambda p: p.T)


def _higher(stage: Json, by: float) -> Json:
    """An approach of a surface that is higher."""
    if "approach" not in stage:
        return stage
    d = stage["approach"]
    return {**stage, "approach": {end: value - by for end, value in d.items()} if isinstance(d, dict) else d - by}


def _each_velocity(stage: Json, change: Callable[[float, float], list[float]]) -> Json:
    return {**stage, "velocity": change(*stage["velocity"])} if "velocity" in stage else stage


def _times(part: Json, factors: dict[str, float], factor: float = 1.0) -> Json:
    """Every number times the factor of its name, or of what it is an end or a component of."""

    def times(value: Any, factor: float) -> Any:
        if isinstance(value, dict):
            return _times(value, factors, factor)
        if isinstance(value, list):
            return [times(entry, factor) for entry in value]
        return value * factor if isinstance(value, float) else value

    dimensionless = {"poisson", "growth", "hurst"}
    return {
        name: value if name in dimensionless else times(value, factors.get(name, factor))
        for name, value in part.items()
    }

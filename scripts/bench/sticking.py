"""Part `sticking`: operator calls of steps with adhesion, over those of the same steps without.

A cell is half a process zone. Surfaces are pressed and let go, or slide. A step is resolved if the edge of contact
moves by at most half a process zone. Both jobs have the same tolerance, which is given. Under the same tolerance steps
with adhesion are the more exact ones as a rule. So the steps without are also made to the same measured errors, those
of the load over the sum of all pressures and tensions, and of the area, means over the steps.
"""

import argparse
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from runs import Json, begun

from parcontact.march import sticking as steps_of

from .table import Line, Map

MOST = 256  # points along a side: of a sphere a quarter of them
SIZE, MODULUS, SLOPE = 1e-4, 4e6, 0.1
TOLERANCE, EXACT = 5e-3, 2e-5
ELASTIC: Json = {"model": "elastic", "shear_modulus": MODULUS / 4}
RUBBER: Json = {"model": "zener", "modulus_inf": MODULUS / 4, "branches": [{"modulus": 9e6, "relaxation_time": 1.0}]}


class Steps(NamedTuple):
    """Operator calls, how far the edge moves [half process zones], mean pressures and means of their sizes, areas."""

    calls: Map
    front: Map
    pressure: Map
    size: Map
    area: Map

    def errors(self, exact: "Steps") -> tuple[float, float]:
        """The mean errors of load and area, over the means of what they are errors of."""
        load, area = np.abs(self.pressure - exact.pressure).mean(), np.abs(self.area - exact.area).mean()
        return float(load / exact.size.mean()), float(area / exact.area.mean())


class Scene(NamedTuple):
    """A body, and the work of adhesion over E* slope^2 and the shortest wave; of a sphere it is that at its edge."""

    body: Json
    strength: float
    surface: str = "rough"
    boundary: str = "periodic"
    slides: bool = False


SCENES = {
    "sphere, elastic": Scene(ELASTIC, 0.01, "sphere"),
    "sphere, elastic, free": Scene(ELASTIC, 0.01, "sphere", "free"),
    "sphere, rubber": Scene(RUBBER, 0.01, "sphere"),
    "rough, elastic, weak": Scene(ELASTIC, 0.0025),
    "rough, elastic, middle": Scene(ELASTIC, 0.01),
    "rough, elastic, strong": Scene(ELASTIC, 0.05),
    "rough, rubber, middle": Scene(RUBBER, 0.01),
    "rough, rubber, strong": Scene(RUBBER, 0.05),
    "rough, rubber, sliding": Scene(RUBBER, 0.01, slides=True),
}


def sticking(points: int, rounds: int, asked: argparse.Namespace) -> Iterator[Line]:
    """The same steps with adhesion and without, of which those count that are resolved."""
    for name, scene in SCENES.items():
        job = job_of(scene, min(points, MOST))
        plain = {key: value for key, value in job.items() if key != "adhesion"}
        steps = count(job)
        resolved = steps.front <= 1.0
        yield Line(f"{name}: resolved steps of {len(resolved)}", int(resolved.sum()))
        yield Line(f"{name}: calls per step", steps.calls[resolved].mean())
        yield Line(f"{name}: over those without", _ratio(steps, count(plain), resolved))
        yield Line(f"{name}: over those to the same errors", _ratio(steps, as_exact(job, plain, steps), resolved))


def _ratio(steps: Steps, others: Steps, resolved: Map) -> float:
    return float(steps.calls[resolved].sum() / others.calls[resolved].sum())


def as_exact(job: Json, plain: Json, steps: Steps) -> Steps:
    """The steps of the plain job to the largest of some tolerances at which their errors are at most those of steps."""
    load, area = steps.errors(count(job, EXACT))
    exact, tolerance = count(plain, EXACT), TOLERANCE
    while True:
        found = count(plain, tolerance)
        own = found.errors(exact)
        if (own[0] <= load and own[1] <= area) or tolerance < 2.0 * EXACT:
            return found
        tolerance *= 0.5


def job_of(scene: Scene, points: int) -> Json:
    """The job of a scene: from the first contact to some tenths of the area and back, or a slide there."""
    if scene.surface == "sphere":
        points //= 4
    cell = SIZE / points
    work = scene.strength * MODULUS * SLOPE**2 * 8 * cell
    job: Json = {"grid": {"points": points, "size": SIZE, "boundary": scene.boundary}, "material": scene.body}
    job |= {"adhesion": {"work": work, "range": "auto"}}
    if scene.surface == "sphere":
        radius = SIZE / 6 / SLOPE
        job["surface"] = {"shape": "sphere", "radius": radius}
        low, high, step = 0.2 * SLOPE * SIZE / 6, 2.0 * SLOPE * SIZE / 6, SLOPE * cell
    else:
        job["surface"] = {"shape": "rough", "hurst": 0.8, "long_wavelength": SIZE / 4, "short_wavelength": 8 * cell}
        job["surface"] |= {"rms_slope": SLOPE, "seed": 1}
        height = float(begun({**job, "history": [{"pressure": 0.0}]}).field("height").std())
        low, high, step = -2.5 * height, -height, SLOPE * cell
    count = math.ceil((high - low) / step)
    press, back = ({"approach": {"from": a, "to": b}, "duration": 1.0} for a, b in ((low, high), (high, low)))
    slide = {"approach": high, "velocity": 10 * cell, "distance": 16 * cell, "cells_per_step": 1}
    job["history"] = [
        {**press, "time_step": 1.0 / count},
        slide if scene.slides else {**back, "time_step": 1.0 / count},
    ]
    return job


def count(job: Json, tolerance: float = TOLERANCE) -> Steps:
    """The steps of a job to a tolerance, but for the first two."""
    march, found = begun({**job, "numerics": {"tolerance": tolerance}}), list[tuple[float, ...]]()
    law, gap = march.scene.choices.adhesion, march.field("gap").copy()
    for step in march.steps():
        before = march.row.measures
        march.advance(step)
        now, row = march.field("gap"), march.row
        flips = float(np.sum((now == 0.0) != (gap == 0.0)))
        front = 0.0 if law is None else steps_of.front_of(march.scene, flips, before, row.measures)
        forces = row.measures.pressure, float(np.abs(march.field("pressure")).mean())
        found.append((row.operator_calls, front, *forces, row.measures.contact_area))
        gap = now.copy()
    return Steps(*np.array(found[2:]).T)

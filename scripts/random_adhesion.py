#!/usr/bin/env python3
"""Random scenes of contacts that stick: laws, surfaces, bodies, loads, rates and grids; every run must come to its end.

    .venv/bin/python scripts/random_adhesion.py [--scenes 200] [--seed 0] [--only NUMBER] [--finer 0]

A scene that was not pulled off under a load ends after its last step. After each step the gap is not negative, the
pressure is minus the attraction where the gap is open, energies add up, and what snaps lose never falls. Scenes that
came off are made again, with `--finer 1`, in steps a quarter as long: they must come off within the steps before and
after. A solve that does not reach its tolerance is a fault. Ends with 0 if all held.
"""

import math
import sys
from collections import Counter
from collections.abc import Iterator
from functools import partial
from random import Random
from typing import Any

import campaign
import numpy as np
from runs import begun

from parcontact.errors import RunError
from parcontact.job import Job
from parcontact.march.loop import March

MODULUS = 1e6  # Pa; of the relaxed body
STEPS = 12  # of a stage
BALANCE = 1e-9  # of the largest energy: rounding
WRONG = 0.05  # of all pressure: certificates allow a gap to be wrong by a part of the range
LEAST = 1e-3  # of the strength: less is none


def scene(random: Random) -> dict[str, Any]:
    """A job: one of spheres, waves and rough surfaces, pressed, pulled or slid."""
    points, size = random.choice([16, 24, 32, 48]), 10 ** random.uniform(-5, -3)
    cell, poisson = size / points, random.choice([0.5, 0.5, 0.3])
    modulus = 2 * MODULUS / (1 - poisson)
    surface, height = shape(random, size, cell)
    zone = cell * 10 ** random.uniform(0.0, 0.9)
    work = modulus * height**2 / size * 10 ** random.uniform(-2.0, 0.5)
    reach = math.sqrt(zone * work / modulus)
    found: dict[str, Any] = {
        "grid": {"points": points, "size": size, "boundary": random.choice(["periodic", "free"])},
        "surface": surface,
        "material": body(random, poisson),
        "adhesion": {"work": work, "range": reach, "law": "exponential"},
        "output": {"energy": True},
    }
    if random.random() < 0.1:
        found["adhesion"]["law"] = "dugdale"
    if random.random() < 0.15 and poisson < 0.5:
        found["body"] = {"thickness": size * random.uniform(0.2, 1.0), "base": random.choice(["bonded", "smooth"])}
    if random.random() < 0.15 and poisson == 0.5:
        found["interface"] = {"shear_stress": 1e4}
    found["history"] = list(history(random, height, size, work, modulus))
    return found


def shape(random: Random, size: float, cell: float) -> tuple[dict[str, Any], float]:
    """A surface, and its height [m] over the box."""
    kind = random.choice(["sphere", "wave", "rough", "rough"])
    if kind == "sphere":
        radius = size * 10 ** random.uniform(0.5, 1.5)
        return {"shape": "sphere", "radius": radius}, size**2 / (8 * radius)
    height = size * 10 ** random.uniform(-3.0, -1.5)
    if kind == "wave":
        return {"shape": "wave", "amplitude": height, "waves": [random.randint(1, 2), random.randint(0, 1)]}, 2 * height
    waves = {"long_wavelength": size / 2, "short_wavelength": max(4 * cell, size / 8)}
    rough = {"shape": "rough", "hurst": 0.8, **waves, "rms_height": height, "seed": random.randint(0, 99)}
    return rough, 4 * height


def body(random: Random, poisson: float) -> dict[str, Any]:
    if random.random() < 0.4:
        return {"model": "elastic", "shear_modulus": MODULUS, "poisson": poisson}
    times = [10 ** random.uniform(-2.0, 1.0) for _ in range(random.choice([1, 1, 3]))]
    branches = [{"modulus": MODULUS * 10 ** random.uniform(-0.5, 1.0), "relaxation_time": time} for time in times]
    return {"model": "zener", "modulus_inf": MODULUS, "branches": branches, "poisson": poisson}


def history(random: Random, height: float, size: float, work: float, modulus: float) -> Iterator[dict[str, Any]]:
    """One to three stages: approaches between apart and half of the height, loads of either sign, slides."""
    control = random.choice(["approach", "approach", "pressure"])
    scale = 0.4 * height if control == "approach" else 0.2 * modulus * height / size
    now = -random.uniform(0.5, 1.0) * height if control == "approach" else 0.0
    for _ in range(random.randint(1, 3)):
        then = (
            random.uniform(-1.0 if control == "approach" else -0.3, 0.3) * scale - (control == "approach") * height / 2
        )
        duration = 10 ** random.uniform(-2.0, 1.0)
        stage: dict[str, Any] = {control: {"from": now, "to": then}, "duration": duration}
        if random.random() < 0.75:
            stage["time_step"] = duration / STEPS
        if random.random() < 0.25:
            stage |= {control: then, "velocity": size / 10 / duration}
        yield stage
        now = then


def violations(march: March, before: float) -> Iterator[str]:
    """What is wrong after a step, of which `before` says what snaps had lost."""
    row, gap, p = march.row, march.field("gap"), march.field("pressure")
    law = march.scene.choices.adhesion
    assert law is not None
    surfaces, lost = row.added[2], row.added[3]
    if gap.min() < 0.0:
        yield f"a gap of {gap.min():g} m"
    if law.kind == "exponential":
        apart = np.abs(p + law.strength * np.exp(-gap / law.range))[gap > 0.0].sum()
        if apart > WRONG * np.abs(p).sum() + LEAST * law.strength * p.size:
            yield f"open points carry {apart / np.abs(p).sum():.2g} of all pressure too much or too little"
    parts = row.stored, row.dissipated, surfaces, lost
    if abs(row.work - sum(parts)) > BALANCE * max(map(abs, (row.work, *parts))):
        yield f"work {row.work:g} J is not stored, dissipated, surfaces, snaps {parts}"
    if lost < before:
        yield f"snaps give back {before - lost:g} J"


def go(job: dict[str, Any], counts: Counter[str]) -> tuple[March, list[str]]:
    """March a job to its end; what was wrong."""
    march, wrong, lost = begun(Job.model_validate(job)), list[str](), 0.0
    for step in march.steps():
        march.advance(step)
        if march.detached:
            break
        found = list(violations(march, lost))
        wrong += [f"step {march.row.step}: {text}" for text in found]
        lost = march.row.added[3]
        counts["calls"] += march.row.operator_calls
        counts["steps"] += 1
        counts["steps that took more than 100 iterations"] += march.row.iterations > 100
        if len(wrong) > 2:
            break
    return march, wrong


def trial(counts: Counter[str], seed: int, finer: int, number: int) -> Iterator[str]:
    """March a scene, and once more in finer steps where it came off."""
    job = scene(Random(f"{seed} {number}"))
    about = f"({job['grid']['boundary']} {job['surface']['shape']} {job['material']['model']} {job['adhesion']['law']})"
    try:
        march, wrong = go(job, counts)
    except RunError as error:
        counts["failed"] += 1
        yield f"{about} {str(error)[:250]}"
        return
    yield from (f"{about} {text}" for text in wrong)
    counts["snaps"] += march.state.sticking.snaps if march.state.sticking is not None else 0
    counts["came off"] += bool(march.detached)
    if not march.detached or not finer:
        return
    steps = [{**stage, "time_step": stage["duration"] / (4 * STEPS)} for stage in job["history"]]
    again, _ = go({**job, "history": steps}, counts)
    longest = max(stage["duration"] / STEPS for stage in job["history"])
    one, other = (each.state.sticking.detached[0] for each in (march, again) if each.state.sticking is not None)
    if not again.detached or abs(one - other) > 1.01 * longest:
        yield f"{about} came off at {one:g} s, in finer steps at {other:g} s"


def main() -> int:
    options = campaign.parser(__doc__, trials=200, what="scenes", finer=(1, "1: in finer steps, too"))
    asked, counts = options.parse_args(), Counter[str]()
    return int(campaign.go(asked, partial(trial, counts, asked.seed, asked.finer), counts) > 0)


if __name__ == "__main__":
    sys.exit(main())

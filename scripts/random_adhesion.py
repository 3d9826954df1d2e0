#!/usr/bin/env python3
"""Random scenes of adhesive contacts, with random laws, surfaces, bodies, loads, rates and grids; every run must
finish.

    .venv/bin/python scripts/random_adhesion.py [--scenes 200] [--seed 0] [--only NUMBER] [--finer 10]

A run ends after its last step, or when the surfaces detach under a load. After each step the gap must not be negative,
the pressure must be minus the attraction where the gap is open, energies must add up, and the energy lost in snaps must
not fall. A solve that does not reach its tolerance is a fault. Each scene is repeated with `--finer` times as many
steps (0: not repeated); contact must end at the same times within a step. Restarts and ranks are tested in tests/march.
The exit code is 0 without faults.
"""

import math
import sys
from collections import Counter
from collections.abc import Iterator
from functools import partial
from itertools import pairwise
from random import Random
from typing import Any

import campaign
import numpy as np
import runs
from numpy.typing import NDArray

from parcontact.effects.adhesion.effect import law_of
from parcontact.errors import RunError
from parcontact.job import Job
from parcontact.march.loop import March

MODULUS = 1e6  # modulus of the relaxed body [Pa]
STEPS = 12  # steps of a stage
BALANCE = 1e-9  # rounding error of energies over the largest energy
WRONG = 0.05  # error over the sum of pressures, by the allowed error of the gap
LEAST = 1e-3  # share of the strength, or of the work of adhesion, that counts as 0
LATE = 1.5  # most steps between ends of contact with longer and shorter steps
Map = NDArray[np.float64]


def scene(random: Random) -> dict[str, Any]:
    """Return a job with a sphere, waves or a rough surface that is pressed, pulled or slid."""
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
    found["history"] = list(history(random, height, 0.0 if surface["shape"] == "sphere" else height / 2, size, modulus))
    return found


def shape(random: Random, size: float, cell: float) -> tuple[dict[str, Any], float]:
    """Return a surface, and its height [m] over the box."""
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


def history(random: Random, height: float, top: float, size: float, modulus: float) -> Iterator[dict[str, Any]]:
    """Return one to three stages: approaches from separation to a tenth of the height below its `top`, loads of either
    sign, and slides."""
    control = random.choice(["approach", "approach", "pressure"])
    moves = control == "approach"
    level, scale = (-top, 0.4 * height) if moves else (0.0, 0.2 * modulus * height / size)
    now = level - random.uniform(0.0, 0.5) * height if moves else 0.0
    for _ in range(random.randint(1, 3)):
        then = level + random.uniform(-1.0 if moves else -0.3, 0.3) * scale
        duration = 10 ** random.uniform(-2.0, 1.0)
        stage: dict[str, Any] = {control: {"from": now, "to": then}, "duration": duration}
        if random.random() < 0.75:
            stage["time_step"] = duration / STEPS
        if random.random() < 0.25:
            stage |= {control: then, "velocity": size / 10 / duration}
        yield stage
        now = then


def violations(march: March, before: float) -> Iterator[str]:
    """Yield violations after a step; `before` is the energy lost in snaps before it [J]."""
    row, gap, p = march.row, march.field("gap"), march.field("pressure")
    law = law_of(march.scene.job)
    surfaces, lost = row.added[2], row.added[3]
    if gap.min() < 0.0:
        yield f"a gap of {gap.min():g} m"
    if law.kind == "exponential":
        apart = np.abs(p + law.strength * np.exp(-gap / law.range))[gap > 0.0].sum()
        if apart > WRONG * np.abs(p).sum() + LEAST * law.strength * p.size:
            yield f"pressures of open points are wrong by {apart / np.abs(p).sum():.2g} of all pressure"
    parts = row.stored, row.dissipated, surfaces, lost
    grid = march.scene.choices.grid
    largest = max(map(abs, (row.work, *parts, LEAST * law.work * grid.lx * grid.ly)))
    if abs(row.work - sum(parts)) > BALANCE * largest:
        yield f"work {row.work:g} J is not stored, dissipated, surfaces, snaps {parts}"
    if lost < before:
        yield f"snaps give back {before - lost:g} J"


def go(job: dict[str, Any], counts: Counter[str], checks: bool = True) -> tuple[March, Map, list[str]]:
    """March a job to its end; return the march, the time, contact area and pressure of each step, and violations if
    `checks`."""
    march, made, wrong, lost = runs.begun(Job.model_validate(job)), [], list[str](), 0.0
    for step in march.steps():
        march.advance(step)
        row = march.row
        if march.detached:
            break
        made.append((row.time, row.measures.contact_area, row.measures.pressure))
        if checks:
            wrong += [f"step {row.step}: {text}" for text in violations(march, lost)]
        lost = row.added[3]
        counts["calls"] += row.operator_calls
        counts["steps"] += 1
        counts["steps that took more than 100 iterations"] += row.iterations > 100
        if len(wrong) > 2:
            break
    if march.detached:
        made.append((march.state.law.end.time, 0.0, 0.0))
    return march, np.array(made).reshape(-1, 3), wrong


def trial(counts: Counter[str], seed: int, finer: int, number: int) -> Iterator[str]:
    """March a scene, and repeat it with finer steps."""
    job = scene(Random(f"{seed} {number}"))
    about = f"({job['grid']['boundary']} {job['surface']['shape']} {job['material']['model']} {job['adhesion']['law']})"
    try:
        march, made, wrong = go(job, counts)
        counts["snaps"] += march.state.memories["adhesion"].snaps
        counts["touched"] += bool(made[:, 1].max(initial=0.0) > 0.0)
        counts["detached"] += bool(march.detached)
        wrong += in_finer_steps(job, made, counts, finer) if finer else []
    except RunError as error:
        counts["failed"] += 1
        wrong = [str(error)[:250]]
    yield from (f"{about} {text}" for text in wrong)


def in_finer_steps(job: dict[str, Any], made: Map, counts: Counter[str], finer: int) -> Iterator[str]:
    """Yield the times at which contact ends with longer or with shorter steps only."""
    steps = [{**stage, "time_step": stage["duration"] / (finer * STEPS)} for stage in job["history"]]
    try:
        _, again, _ = go({**job, "history": steps}, Counter(), checks=False)
    except RunError as error:
        counts["failed in finer steps"] += 1
        yield f"in finer steps: {str(error)[:250]}"
        return
    late = LATE * max(stage["duration"] / STEPS for stage in job["history"])
    for one, other, what in ((made, again, "not in finer steps"), (again, made, "in finer steps only")):
        for time in ends(one, 2.0 * late):
            counts["ends of contact"] += 1
            near = np.abs(other[:, 0] - time) <= late
            if not np.any(other[near, 1] == 0.0):
                yield f"contact ends at {time:g} s, {what}"


def ends(made: Map, lasts: float) -> Iterator[float]:
    """Yield the times at which contact ends for at least `lasts` [s], or until the end of the history."""
    for before, now in pairwise(made):
        after = (made[:, 0] >= now[0]) & (made[:, 0] <= now[0] + lasts)
        if before[1] > 0.0 and not made[after, 1].any():
            yield float(now[0])


def main() -> int:
    options = campaign.parser(__doc__, trials=200, what="scenes", finer=(10, "times as many steps, or 0"))
    asked, counts = options.parse_args(), Counter[str]()
    return int(campaign.go(asked, partial(trial, counts, asked.seed, asked.finer), counts) > 0)


if __name__ == "__main__":
    sys.exit(main())

"""Random jobs of all sections mixed, small enough to be run in a fraction of a second.

Bodies, surfaces, loads and rates have sensible sizes to each other, over many decades of all of them; what a job asks
for does not always go together, and `check` says so then. All choices follow from a seeded `random.Random`.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from .scenes import Json, decades

SIDES = (1, 2, 3, 5, 8, 8, 12, 12, 13, 16, 16, 16, 20)  # points
TITLES = ("\x1b[31m red", "tab\tand\nline", "half \ud800 a pair", "\ufffe", "轮胎", "$x^$ & <b>", "w" * 300)
FIELDS = ("pressure", "displacement", "gap", "height")


@dataclass(frozen=True)
class Scale:
    """Sizes to which those of a job are near: of the box [m], rms slope, modulus in the end and at once [Pa],
    relaxation time [s], pressure in middling contact [Pa], velocity [m/s] at which waves of the box see branches."""

    points: tuple[int, int]
    size: tuple[float, float]
    free: bool
    slope: float
    modulus: float
    glassy: float
    time: float

    @property
    def length(self) -> float:
        return max(self.size)

    @property
    def height(self) -> float:
        return self.slope * self.length / 10.0

    @property
    def pressure(self) -> float:
        return self.slope * self.modulus

    @property
    def speed(self) -> float:
        return self.length / self.time


def draw(dice: Random, directory: Path, stick: bool = False) -> Json:
    """Return a job as data; the files that it names are in the directory. With `stick` its contact sticks."""
    points = (dice.choice(SIDES), dice.choice(SIDES))
    side = decades(dice, -7, 0)
    size = (side, side * points[1] / points[0] * dice.choice([1.0, 1.0, 1.0, 0.5, 2.0]))
    modulus = decades(dice, 4, 10)
    glassy = modulus * decades(dice, 0.1, 3)
    scale = Scale(points, size, dice.random() < 0.35, decades(dice, -3, -0.5), modulus, glassy, decades(dice, -6, 4))
    sticky, warm = dice.random() < 0.2, dice.random() < 0.2
    job: Json = {
        "grid": {"points": list(points), "size": list(size), **({"boundary": "free"} if scale.free else {})},
        "surface": _surface(dice, scale, directory),
        "material": _material(dice, scale, directory),
        "numerics": _numerics(dice, scale),
        "output": _output(dice, warm),
    }
    kind = dice.choices(["history", "steady", "start", "both"], [12, 4, 3, 1])[0]
    if kind == "steady" or kind == "both":
        job["steady"] = _steady(dice, scale)
    if kind != "steady":
        job["history"] = [_stage(dice, scale, sticky) for _ in range(dice.choice([1, 1, 2, 2, 3]))]
    if kind == "start":
        load = scale.pressure * decades(dice, -4, 1.5)
        velocity = _velocity(dice, scale) if dice.random() < 0.8 else 0.0
        job["initial"] = {"state": "steady", "velocity": velocity, "pressure": load}
    if dice.random() < 0.2:
        job["body"] = {"thickness": scale.length * decades(dice, -1.5, 1), "base": dice.choice(["bonded", "smooth"])}
    if sticky:
        job["adhesion"] = _adhesion(dice, scale)
    if warm:
        job["thermal"] = _thermal(dice, scale)
    if dice.random() < 0.15:
        job["interface"] = _interface(dice, scale)
    if dice.random() < 0.1:
        job["leakage"] = {"every": dice.choice([1, 2, 3])}
    if dice.random() < 0.1:
        job["checkpoint"] = {"every": dice.choice([1, 3]), "keep": dice.choice([0, 1, 2])}
    if dice.random() < 0.06:
        job["sweep"] = _sweep(dice, job)
    job = _with_stick(dice, scale, job) if stick else job
    job = job if dice.random() < 0.05 else _reconciled(dice, job)
    return _with_rare_keys(Random(repr(job)), job)


def draw_in_bands(dice: Random) -> Json:
    """Return a job whose spectrum is cut into bands, often too few points for its waves."""
    longest = decades(dice, -4, -1)
    surface = {"shape": "rough", "hurst": dice.uniform(0.3, 1.0), "rms_slope": decades(dice, -2, -0.5)}
    surface |= {"long_wavelength": longest, "short_wavelength": longest / dice.choice([2.0, 4.0, 20.0])}
    asked = {"count": dice.choice([1, 2]), "waves": dice.choice([1, 2, 2, 4]), "samples": dice.choice([1, 2])}
    points = dice.choice([1, 2, 32, 48, 64, [64, 1], [48, 64]])
    bands = {"points": points, **{key: value for key, value in asked.items() if dice.random() < 0.8}}
    steady = {"velocities": [decades(dice, -3, 1)], "pressures": [decades(dice, 3, 6)]}
    job: Json = {"surface": surface, "material": {"include": "synthetic_tyre"}, "bands": bands, "steady": steady}
    return job | {"numerics": {"accuracy": 0.3}}


def _with_rare_keys(dice: Random, job: Json) -> Json:
    """Return a job with what few jobs have: from dice of its own, so that other jobs stay as they were."""
    if dice.random() < 0.05:
        job["numerics"]["strict"] = True
    if dice.random() < 0.03:
        job["grid"]["points"] = "auto"
    elif dice.random() < 0.03 and "history" in job:
        nx = job["grid"]["points"][0]
        meshes = [{"mesh": [nx, 2 * nx]}, {"mesh": sorted({nx // 2 or 1, nx})}]
        job["study"] = dice.choice([*meshes, {"integrator": ["exponential", "backward-euler"]}])
    if dice.random() < 0.05:
        job["title"] = dice.choice(TITLES)
    return job


def _reconciled(dice: Random, job: Json) -> Json:
    """Return a job without what does not go together."""
    material, free = job["material"], job["grid"].get("boundary") == "free"
    steady = job.keys() & {"steady", "initial"}
    if "adhesion" in job and (steady or material.pop("hardness", None)):
        del job["adhesion"]
    if steady:
        material.pop("hardness", None)
        if material.get("modulus_inf") == 0.0:
            material["modulus_inf"] = material["branches"][0].get("modulus", 1e6)
    if "initial" in job:
        job["output"] = {name: value for name, value in job["output"].items() if name in ("fields", "every")}
    if free and (steady or ("body" in job and min(job["grid"]["points"]) < 3)):
        job.pop("body", None)
    if "interface" in job:
        material["poisson"] = 0.5
    shifts = "shift" in material or "include" in material
    if "thermal" in job:
        if not shifts or "initial" in job:
            job["thermal"].pop("feedback", None)
        if free or "history" in job:
            job["thermal"].pop("counterbody", None)
    if "steady" in job:
        if not shifts:
            job["steady"].pop("temperatures", None)
        if free:
            job["steady"].pop("waves", None)
    return job


# -- surfaces ---------------------------------------------------------------------------------------------------------


def _surface(dice: Random, scale: Scale, directory: Path) -> Json | list[Json]:
    makers = [_rough, _rough, _sphere, _cylinder, _wave, _wave, _file, _topography, _spectrum, lambda *_: _FLAT]
    shapes = [dice.choice(makers)(dice, scale, directory) for _ in range(dice.choice([1, 1, 1, 2, 3]))]
    return shapes[0] if len(shapes) == 1 and dice.random() < 0.7 else shapes


_FLAT: Json = {"shape": "flat"}


def _rough(dice: Random, scale: Scale, directory: Path) -> Json:
    sides = zip(scale.size, scale.points, strict=True)
    cell = max((length / n for length, n in sides if n > 1), default=scale.length)
    shortest = cell * dice.choice([2.0, 2.0, 3.0, 4.0, 8.0])
    longest = max(scale.length * dice.choice([0.25, 0.5, 1.0, 1.0, 2.0]), 1.5 * shortest)
    made: Json = {"shape": "rough", "hurst": dice.uniform(0.1, 1.0), "seed": dice.randint(0, 10**6)}
    made |= {"long_wavelength": longest, "short_wavelength": shortest}
    if dice.random() < 0.3:
        made["rolloff_wavelength"] = dice.uniform(shortest, longest)
    size = {"rms_slope": scale.slope, "rms_height": scale.height}
    if 1 not in scale.points:  # the constant of a surface
        size["psd_constant"] = (scale.height * longest) ** 2
    name = dice.choice(list(size))
    return {**made, name: size[name], "amplitudes": dice.choice(["random", "fixed"])}


def _spectrum(dice: Random, scale: Scale, directory: Path) -> Json:
    q = 2 * np.pi / scale.length * np.geomspace(0.5, 12.0, 20)
    c2 = (scale.height / q[2]) ** 2 * np.maximum(q / q[4], 1.0) ** (-2.0 * (1.0 + dice.uniform(0.3, 1.0)))
    kind = "C1D[m^3]" if 1 in scale.points else "C2D[m^4]"
    lines = [f"q[1/m] {kind}", *(f"{k:.9g} {value:.9g}" for k, value in zip(q, c2, strict=True))]
    (directory / "psd.csv").write_text("\n".join(lines) + "\n")
    return {"shape": "rough", "spectrum": "psd.csv", "seed": dice.randint(0, 99)}


def _center(dice: Random, scale: Scale) -> Json:
    if dice.random() < 0.6:
        return {}
    return {"center": [dice.uniform(0.2, 0.8) * length for length in scale.size]}


def _sphere(dice: Random, scale: Scale, directory: Path) -> Json:
    radius = scale.length / scale.slope * decades(dice, -0.5, 1)
    return {"shape": "sphere", "radius": radius, "profile": _profile(dice), **_center(dice, scale)}


def _cylinder(dice: Random, scale: Scale, directory: Path) -> Json:
    radius, axis = scale.length / scale.slope * decades(dice, -0.5, 1), dice.choice(["x", "y"])
    return {"shape": "cylinder", "radius": radius, "axis": axis, "profile": _profile(dice), **_center(dice, scale)}


def _profile(dice: Random) -> str:
    return dice.choice(["paraboloid", "exact"])


def _wave(dice: Random, scale: Scale, directory: Path) -> Json:
    waves = [dice.randint(-(n // 2), n // 2) if dice.random() < 0.5 else min(1, n // 2) for n in scale.points]
    height = scale.height * dice.choice([0.0, 1.0, 1.0, 1.0, -1.0])
    return {"shape": "wave", "amplitude": height, "waves": waves, "phase": dice.uniform(-4.0, 4.0)}


def _heights(dice: Random, scale: Scale) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    nx, ny = scale.points
    noise = np.random.default_rng(dice.getrandbits(32)).standard_normal((ny, nx))
    return scale.height * noise


def _file(dice: Random, scale: Scale, directory: Path) -> Json:
    heights = _heights(dice, scale)
    if dice.random() < 0.5:
        np.save(directory / "road.npy", heights * 1e6)
        return {"shape": "file", "path": "road.npy", "scale": 1e-6}
    np.savetxt(directory / "road.txt", heights)
    return {"shape": "file", "path": "road.txt"}


def _topography(dice: Random, scale: Scale, directory: Path) -> Json:
    nx, ny = max(scale.points[0], 4) + 5, max(scale.points[1], 4) + 5
    heights = scale.height * np.random.default_rng(dice.getrandbits(32)).standard_normal((ny, nx))
    if dice.random() < 0.3:
        heights[dice.randrange(ny), dice.randrange(nx)] = np.nan
    np.save(directory / "map.npy", heights * 1e6)
    size = [length * 1.5 for length in scale.size]
    made: Json = {"shape": "topography", "path": "map.npy", "unit": "um", "size": size, "fill": dice.random() < 0.8}
    if dice.random() < 0.5:
        made["detrend"] = dice.choice(["mean", "tilt", "curvature"])
    if dice.random() < 0.5:
        made["periodic"] = dice.choice(["smooth", "mirror"])
    return made


# -- bodies -----------------------------------------------------------------------------------------------------------


def _material(dice: Random, scale: Scale, directory: Path) -> Json:
    kind = dice.choices(["elastic", "zener", "tyre", "dma"], [3, 12, 1, 2])[0]
    if kind == "tyre":
        return (
            {"include": "synthetic_tyre", "temperature": dice.uniform(0.0, 60.0)}
            if dice.random() < 0.2
            else {"include": "synthetic_tyre"}
        )
    more: Json = {"poisson": dice.choice([0.5, 0.5, 0.5, 0.3, 0.0, -0.5])}
    if dice.random() < 0.12:
        more["hardness"] = scale.pressure * decades(dice, -1, 2)
    if kind == "elastic":
        return {"model": "elastic", "shear_modulus": scale.modulus, **more}
    if kind == "dma":
        return {"model": "dma", "path": _moduli(dice, scale, directory), **more}
    branches = [_branch(dice, scale) for _ in range(dice.choice([1, 1, 2, 3, 8]))]
    inf = 0.0 if dice.random() < 0.08 else scale.modulus
    made: Json = {"model": "zener", "modulus_inf": inf, "branches": branches, **more}
    if dice.random() < 0.25:
        made |= {"shift": _shift(dice), "temperature": dice.uniform(5.0, 35.0)}
    return made


def _branch(dice: Random, scale: Scale) -> Json:
    modulus, time = scale.glassy * decades(dice, -1, 0), scale.time * decades(dice, -3, 3)
    if dice.random() < 0.7:
        return {"modulus": modulus, "relaxation_time": time}
    kelvin = dice.choice([0.0, modulus * decades(dice, -2, 2)])
    return {"G0": modulus, "G1": kelvin, "eta1": dice.choice([time * (modulus + kelvin)] * 8 + [0.0, math.inf])}


def _shift(dice: Random) -> Json:
    return dice.choice(
        [
            {"law": "wlf", "C1": 8.86, "C2": 101.6, "reference": 20.0},
            {"law": "arrhenius", "energy": 5e4, "reference": 20.0},
            {"law": "factors", "temperatures": [0.0, 20.0, 40.0], "logs": [1.9, 0.0, -1.1], "reference": 20.0},
        ]
    )


def _moduli(dice: Random, scale: Scale, directory: Path) -> str:
    """Write moduli of a body of three branches, a decade apart."""
    omega = np.geomspace(0.03, 300.0, 24) / scale.time
    times = scale.time * np.array([0.1, 1.0, 10.0])
    wave = 1j * omega[:, None] * times
    modulus = scale.modulus + (scale.glassy / 3.0 * wave / (1.0 + wave)).sum(axis=1)
    rows = [f"{w:.9g} {g.real:.9g} {g.imag:.9g}" for w, g in zip(omega, modulus, strict=True)]
    (directory / "dma.txt").write_text("\n".join(["omega[rad/s] G'[Pa] G''[Pa]", *rows]) + "\n")
    return "dma.txt"


def _adhesion(dice: Random, scale: Scale) -> Json:
    cell = scale.length / max(scale.points)
    modulus = 2.0 * scale.modulus
    work = (0.3 * scale.height) ** 2 * modulus / cell * decades(dice, -1.5, 0.5)  # of a range near the heights
    made: Json = {"work": work, "law": dice.choice(["exponential", "exponential", "dugdale"])}
    if dice.random() < 0.6:
        made["range"] = (dice.choice([1.0, 2.0, 4.0]) * cell * work / modulus) ** 0.5
    return {**made, "detached": dice.choice(["end", "open"])}


def _thermal(dice: Random, scale: Scale) -> Json:
    made: Json = {"conductivity": 0.2, "diffusivity": scale.length**2 / scale.time * decades(dice, -4, 1)}
    if dice.random() < 0.3:
        made["feedback"] = "mean"
    if dice.random() < 0.3:
        made["distance"] = scale.length * decades(dice, 0, 3)
    if dice.random() < 0.2:
        made["counterbody"] = {"conductivity": 2.0, "diffusivity": 1e-6}
    return made


def _interface(dice: Random, scale: Scale) -> Json:
    made: Json = {"shear_stress": scale.pressure * decades(dice, -2, 0)}
    return made if dice.random() < 0.5 else {**made, "velocity": scale.speed, "width": dice.uniform(1.0, 5.0)}


def _with_stick(dice: Random, scale: Scale, job: Json) -> Json:
    """Return a job whose contact sticks, with up to five stages that press, rest, shear, reverse, turn and roll."""
    bound = {"coefficient": decades(dice, -1.5, 0.3)} if dice.random() < 0.5 else _interface(dice, scale)
    job = {key: value for key, value in job.items() if key not in ("steady", "initial", "body", "adhesion", "leakage")}
    if "model" in job["material"]:
        job["material"]["poisson"] = 0.5
    job["output"] |= {"energy": dice.random() < 0.6} | (
        {"fields": ["pressure", "traction"]} if dice.random() < 0.5 else {}
    )
    way, duration = scale.slope * scale.length * decades(dice, -2, 1), scale.time * decades(dice, -2, 2)
    speed, load = way / duration, scale.pressure * decades(dice, -2, 0.5)
    shapes = job["surface"] if isinstance(job["surface"], list) else [job["surface"]]
    rolls = not any(part["shape"] in ("rough", "topography") for part in shapes)
    stages: list[Json] = [{"pressure": load, **dice.choice([{}, {"duration": duration}])}]
    for _ in range(dice.choice([1, 2, 3, 4])):
        loaded = dice.choice([load, load, {"from": load, "to": load * dice.choice([0.0, 0.5, 2.0])}])
        moved: Json = {"velocity": dice.choice([speed, speed, -speed, 0.1 * speed, [0.6 * speed, -0.8 * speed]])}
        steps = _steps(dice, duration, dice.choice([1, 2, 5, 12]), moving=True)
        if dice.random() < 0.2:
            moved, steps = {}, {"time_step": duration / dice.choice([1, 3])}
        elif rolls and dice.random() < 0.3:
            moved["creep"] = dice.choice([0.0, 0.01, -0.1, [0.5, 0.2]])
        stages.append({"pressure": loaded, "duration": duration, **moved, **steps})
    return {**job, "interface": {**bound, "stick": True}, "history": stages}


# -- loads and motion -------------------------------------------------------------------------------------------------


def _velocity(dice: Random, scale: Scale) -> Any:
    speed = scale.speed * decades(dice, -2, 2)
    return dice.choice([speed, -speed, [speed, 0.0], [0.0, speed], [0.6 * speed, -0.8 * speed]])


def _load(dice: Random, scale: Scale, sticky: bool) -> tuple[str, float]:
    """One control and a value for it."""
    control = dice.choices(["pressure", "force", "approach"], [4, 1, 2])[0]
    if control == "approach":
        return control, scale.height * (dice.uniform(0.0, 3.0) if scale.free else -dice.uniform(0.0, 3.0))
    pressure = scale.pressure * decades(dice, -4, 1.5) * dice.choice([1.0] * 12 + [0.0])
    pressure *= -0.05 if sticky and dice.random() < 0.2 else 1.0
    return control, pressure * (scale.size[0] * scale.size[1] if control == "force" else 1.0)


def _stage(dice: Random, scale: Scale, sticky: bool) -> Json:
    control, load = _load(dice, scale, sticky)
    lasts = dice.random() < 0.75
    stage: Json = {control: load}
    if lasts and dice.random() < 0.35:  # loading, unloading
        share = dice.choice([0.0, 0.1, 0.5, 2.0])
        other = load * share if control != "approach" else load + scale.height * dice.uniform(-1.0, 1.0)
        stage[control] = dict(zip(("from", "to"), dice.sample([load, other], 2), strict=True))
    if not lasts:
        return stage
    moving, steps = dice.random() < 0.6, dice.choice([1, 2, 4, 7, 12])
    duration = scale.time * decades(dice, -2, 2)
    if moving:
        way = scale.length * dice.choice([0.02, 0.2, 1.0, 1.5])
        stage["velocity"] = velocity = _velocity(dice, scale)
        duration = way / math.hypot(*(velocity if isinstance(velocity, list) else [velocity]))
        if dice.random() < 0.6:
            stage["distance"] = way
            stage |= _steps(dice, duration, steps, True)
            return stage
    return {**stage, "duration": duration, **_steps(dice, duration, steps, moving)}


def _steps(dice: Random, duration: float, steps: int, moving: bool) -> Json:
    kind = dice.choices(["given", "growing", "cells", "auto", "none"], [5, 3, 4, 1, 1])[0]
    if kind == "growing":
        return {"time_step": {"first": duration / 2.0**steps, "growth": 2.0}}
    if kind == "cells" and moving:
        return {"cells_per_step": dice.choice([0.5, 1, 1, 2, 3.7])}
    if kind == "auto":
        return {"time_step": "auto"}
    return {} if kind == "none" else {"time_step": duration / steps}


def _steady(dice: Random, scale: Scale) -> Json:
    speeds = [scale.speed * decades(dice, -2, 2) for _ in range(dice.choice([1, 2, 3]))]
    made: Json = {"velocities": dice.choice([speeds, f"{min(speeds):.6g}:{2 * max(speeds):.6g}:3"])}
    made["pressures"] = [scale.pressure * decades(dice, -3, 1.5) for _ in range(dice.choice([1, 1, 2]))]
    if dice.random() < 0.3:
        made["direction"] = dice.choice([[0.0, 1.0], [1.0, 1.0], [-1.0, 0.3], [1e-9, 1.0]])
    if dice.random() < 0.2:
        made["waves"] = True
    if dice.random() < 0.25:
        made["temperatures"] = [10.0, 30.0]
    return made


# -- calculation ------------------------------------------------------------------------------------------------------


def _numerics(dice: Random, scale: Scale) -> Json:
    made: Json = {"accuracy": dice.choice([0.3, 0.2, 0.1, {"friction": 0.3, "area": 0.1}])}
    more: Json = {
        "integrator": dice.choice(["exponential", "backward-euler"]),
        "tolerance": decades(dice, -7, -1),
        "kernel": "love" if scale.free else dice.choice(["spectral", "love"]),
        "precision": dice.choice(["double", "mixed"]),
        "branch_error": dice.choice([0.0, 0.1]),
        "accept_unconverged": True,
    }
    return made | {key: value for key, value in more.items() if dice.random() < 0.2}


def _output(dice: Random, warm: bool) -> Json:
    fields = [name for name in FIELDS if dice.random() < 0.5] + ["temperature"] * (warm and dice.random() < 0.7)
    made: Json = {"fields": fields, "every": dice.choice([1, 1, 2, 5])} if dice.random() < 0.5 else {}
    if dice.random() < 0.35:
        made |= {"energy": True, "branch_dissipation": dice.random() < 0.3}
    return made


def _sweep(dice: Random, job: Json) -> list[Json]:
    keys: list[Json] = [
        {"numerics.tolerance": [1e-3, 1e-2]},
        {"numerics.integrator": ["exponential", "backward-euler"]},
    ]
    if "history" in job:
        (control,) = job["history"][0].keys() & {"pressure", "force", "approach"}
        keys.append({f"history.0.{control}": [job["history"][0][control]] * 2})
    return dice.sample(keys, dice.choice([1, 1, 2]))

"""What a run remembers from one step to the next, for checkpoints: each part under its own name, with units."""

import re
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from ..errors import InputError
from ..parallel.slab import Slab
from ..physics.body import Zener
from ..physics.energy import ZenerEnergy
from ..record.checkpoint import Contents, Entry, read
from ..scene import Scene
from .step import March

MAYBE = "contact/earlier pressure"  # not kept by a history of single solves, whose successor starts from the last one


def entries(march: March) -> dict[str, Entry]:
    """Everything remembered after the last step, by names `part/name`; maps are the run's own, not copies."""
    units = _Units(march.scene)
    state: dict[str, Any] = {
        "clock/distance": march.row.distance,
        "clock/position": np.array(march.position),
        "contact/pressure": march.p,
        "contact/modulus": march.alpha,
        "contact/earlier modulus": march.alpha_old,
        "contact/approach": march.d,
    }
    if march.p_old is not None:
        state[MAYBE] = march.p_old
    for part, owner in _owners(march.scene).items():
        state |= {f"{part}/{name}": value for name, value in owner.state().items()}
    if isinstance(march.scene.material, Zener):
        prony = march.scene.material.prony
        state |= {"material/moduli": prony.moduli, "material/relaxation times": prony.relaxation_times}
    return {name: Entry(value, *units.of(name)) for name, value in state.items()}


def restore(march: March, contents: Contents, slab: Slab) -> None:
    """Put a run that has not begun into the state of a checkpoint; collective.

    Raises InputError if the run remembers something that the checkpoint does not have.
    """
    wanted = entries(march)
    asleep = _asleep(march.scene, contents)
    for name in asleep if MAYBE in contents.maps else [MAYBE, *asleep]:
        wanted.pop(name, None)
    _compare(contents, wanted)
    read(contents, slab, wanted)
    numbers = {
        name: contents.numbers[name] * (contents.units[name] / entry.unit)
        for name, entry in wanted.items()
        if not entry.is_map
    }
    march.row = replace(march.row, step=contents.step, time=contents.time, distance=float(numbers["clock/distance"]))
    x, y = numbers["clock/position"].tolist()
    march.position = (x, y)
    march.alpha, march.alpha_old = float(numbers["contact/modulus"]), float(numbers["contact/earlier modulus"])
    march.d = float(numbers["contact/approach"])
    for part, owner in _owners(march.scene).items():
        found = {name.removeprefix(f"{part}/"): value for name, value in numbers.items() if name.startswith(f"{part}/")}
        own = {name: value for name, value in owner.state().items() if f"{part}/{name}" not in asleep}
        owner.restore({**own, **found})  # its maps have been read in place


def _asleep(scene: Scene, contents: Contents) -> list[str]:
    """The maps of branches that were folded when the checkpoint was written, and are not any more.

    Raises InputError for a memoryless one that steps have become too short for: what it remembered is lost.
    """
    if not isinstance(scene.material, Zener) or "material/frozen" not in contents.numbers:
        return []
    numbers = [k for k in scene.material.kept if f"material/branch {k}" not in contents.maps]
    for k in numbers:
        error, allowed = scene.folded.memoryless_errors[k], contents.job["numerics"].get("branch_error", 0.0)
        if not contents.numbers["material/frozen"][k] and error > allowed:
            time = scene.frame.prony.relaxation_times[k]
            raise InputError(
                f"{contents.path} has no map of the branch of relaxation time {time:g} s: its run had no step so short "
                f"that it mattered to numerics.branch_error = {allowed:g}, now friction would be wrong by {error:.2g}; "
                "keep to longer steps, or start afresh (--restart never)"
            )
    return [f"material/branch {k}" for k in numbers]


def _compare(contents: Contents, wanted: dict[str, Entry]) -> None:
    if lacking := [name for name in wanted if name not in contents.units]:
        hint = ": output.energy was off, and energies count from the start" if lacking[0].startswith("energy/") else ""
        raise InputError(f"{contents.path} does not have {', '.join(lacking)}, which the job needs{hint}")
    for name in ("material/moduli", "material/relaxation times"):
        if name in wanted:
            old = np.asarray(contents.numbers[name]) * contents.units[name]
            new = np.asarray(wanted[name].value) * wanted[name].unit
            if old.shape != new.shape or not np.allclose(old, new, rtol=1e-12, atol=0.0):
                raise InputError(f"{contents.path} has other branches: {name} was {old.tolist()}, is {new.tolist()}")


class _Remembers(Protocol):
    def state(self) -> dict[str, Any]: ...

    def restore(self, state: dict[str, Any]) -> None: ...


def _owners(scene: Scene) -> dict[str, _Remembers]:
    owners: dict[str, _Remembers] = {}
    if isinstance(scene.material, Zener):
        owners["material"] = scene.material
    if isinstance(scene.energy, ZenerEnergy):
        owners["energy"] = scene.energy
        if scene.energy.memory is not None:
            owners["memory"] = scene.energy.memory
    return owners


class _Units:
    """SI values of 1, and symbols, of what a run remembers. Pressures are kept over the modulus of their step."""

    def __init__(self, scene: Scene) -> None:
        units, grid = scene.units, scene.job.grid
        strain, height, modulus = units.height / units.length, units.height, units.modulus
        energy = units.pressure * height * grid.dx * grid.dy
        self._table = (
            (r"clock/.*", 1.0, "m"),
            (r"contact/.*pressure", strain, "1"),
            (r"contact/.*modulus", modulus, "Pa"),
            (r"contact/approach", height, "m"),
            (r"material/displacement", height, "m"),
            (r"material/branch \d+", modulus * height, "Pa m"),
            (r"(material|memory)/frozen", 1.0, "1"),
            (r"material/moduli", modulus, "Pa"),
            (r"material/relaxation times", 1.0, "s"),
            (r"memory/displacement", strain, "1"),
            (r"memory/branch \d+", modulus * strain, "Pa"),
            (r"energy/(work|stored|dissipated)", energy, "J"),
            (r"energy/spring", height * strain, "m"),
            (r"energy/branches", modulus**2 * height * strain, "Pa^2 m"),
        )

    def of(self, name: str) -> tuple[float, str]:
        return next((unit, symbol) for pattern, unit, symbol in self._table if re.fullmatch(pattern, name))

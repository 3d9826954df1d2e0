"""A checkpoint of a run: the entries of its parts, each under the name of the part, and how a run goes on from them."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..parallel.slab import Slab
from ..physics.entries import Entry, Remembers
from ..physics.units import Units
from ..record.checkpoint import Contents, read
from ..scene import Scene


def entries(parts: Mapping[str, Remembers], units: Units) -> dict[str, Entry]:
    """What parts of a run remember, by names `part/name`; maps are the run's own, not copies."""
    return {f"{part}/{name}": entry for part, owner in parts.items() for name, entry in owner.entries(units).items()}


def restore(parts: Mapping[str, Remembers], scene: Scene, contents: Contents, slab: Slab) -> None:
    """Put the parts of a run into the state of a checkpoint; collective.

    Raises InputError if one remembers something that the checkpoint does not have.
    """
    _refuse_lost_branches(scene, contents)
    declared = entries(parts, scene.units)
    wanted = {name: entry for name, entry in declared.items() if not entry.optional or name in contents.units}
    _compare(contents, wanted)
    read(contents, slab, wanted)
    saved = {name: _value(name, entry, contents) for name, entry in wanted.items()}
    for part, owner in parts.items():
        head = f"{part}/"
        owner.restore({name.removeprefix(head): value for name, value in saved.items() if name.startswith(head)})


def _value(name: str, entry: Entry, contents: Contents) -> NDArray[Any]:
    """A map, which has been read in place, or numbers in the run's units."""
    if entry.is_map:
        return np.asarray(entry.value)
    return np.asarray(contents.numbers[name] * (contents.units[name] / entry.unit))


def _compare(contents: Contents, wanted: dict[str, Entry]) -> None:
    if lacking := [name for name in wanted if name not in contents.units]:
        hint = ": output.energy was off, and energies count from the start" if lacking[0].startswith("energy/") else ""
        raise InputError(f"{contents.path} does not have {', '.join(lacking)}, which the job needs{hint}")
    for name in (name for name, entry in wanted.items() if entry.given):
        old = np.asarray(contents.numbers[name]) * contents.units[name]
        new = np.asarray(wanted[name].value) * wanted[name].unit
        if old.shape != new.shape or not np.allclose(old, new, rtol=1e-12, atol=0.0):
            raise InputError(f"{contents.path} is of another job: {name} was {old.tolist()}, is {new.tolist()}")


def _refuse_lost_branches(scene: Scene, contents: Contents) -> None:
    """A branch that relaxed too fast to have a map in the run that wrote the checkpoint may need one now that steps are
    shorter: then what it remembered is lost."""
    if "material/frozen" not in contents.numbers:
        return
    for k in scene.folded.kept:
        if f"material/branch {k}" in contents.maps or contents.numbers["material/frozen"][k]:
            continue
        error, allowed = scene.folded.memoryless_errors[k], contents.job["numerics"].get("branch_error", 0.0)
        if error > allowed:
            time = scene.frame.prony.relaxation_times[k]
            raise InputError(
                f"{contents.path} has no map of the branch of relaxation time {time:g} s: its run had no step so short "
                f"that it mattered to numerics.branch_error = {allowed:g}, now friction would be wrong by {error:.2g}; "
                "keep to longer steps, or start afresh (--restart never)"
            )

"""All that one step of a run hands to the next, and checkpoints of it: what goes into them, and how a run goes on."""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..parallel.slab import Array
from ..physics.entries import Entry, MapCount, Saved
from ..physics.units import Units
from ..scene import Scene
from ..storage.checkpoint import Contents, read
from ..storage.row import Row

FURTHER = 2  # pressures before the earlier one that are kept for starts, of three and of four steps ago
MODULI, POSITIONS = "contact/further moduli", "clock/further positions"  # in a checkpoint, of these


class Past(NamedTuple):
    """The pressure after a step: a map of p with the pressure `alpha p`, and where the surface was [m]; with an alpha
    of 0 none is known."""

    pressure: Array
    alpha: float = 0.0
    position: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class State:
    """A run after a step, but for what the parts of its scene remember themselves (`Scene.parts`).

    `pressure` is a map of p with the pressure `alpha p`, `earlier` the one before it (no history of single solves keeps
    one), `alpha` and `alpha_old` the moduli of the two steps; `approach` d of the body, all in the run's units.
    `position` [m] is by how much the surface has moved, `position_old` by how much it had with the earlier pressure;
    `further` are those before that, the newest first, where they are kept.
    """

    row: Row
    pressure: Array
    earlier: Array | None
    alpha: float = 0.0
    alpha_old: float = 0.0
    approach: float = 0.0
    position: tuple[float, float] = (0.0, 0.0)
    position_old: tuple[float, float] = (0.0, 0.0)
    further: tuple[Past, ...] = ()

    @staticmethod
    def count_maps(lasts: bool, keeps_further: bool) -> MapCount:
        """Of the states before and after a step, which share the earlier pressures; there is one if stages last."""
        earlier = lasts + FURTHER * keeps_further
        return MapCount(held=2 + earlier, saved=1 + earlier)

    @property
    def pasts(self) -> tuple[Past, ...]:
        """All pressures, the newest first."""
        last = Past(self.pressure, self.alpha, self.position)
        if self.earlier is None:
            return (last,)
        return last, Past(self.earlier, self.alpha_old, self.position_old), *self.further

    def entries(self, units: Units) -> dict[str, Entry]:
        """What a checkpoint has of it; step and time it says itself."""
        strain = units.height / units.length
        earlier = (
            {}
            if self.earlier is None
            else {
                "contact/earlier pressure": Entry(self.earlier, strain, optional=True),
                "clock/earlier position": Entry(np.array(self.position_old), 1.0, "m", optional=True),
            }
        )
        return {
            "clock/distance": Entry(self.row.distance, 1.0, "m"),
            "clock/position": Entry(np.array(self.position), 1.0, "m"),
            "contact/pressure": Entry(self.pressure, strain),
            "contact/modulus": Entry(self.alpha, units.modulus, "Pa"),
            "contact/earlier modulus": Entry(self.alpha_old, units.modulus, "Pa"),
            "contact/approach": Entry(self.approach, units.height, "m"),
            **earlier,
            **self._further_entries(units),
        }

    def _further_entries(self, units: Units) -> dict[str, Entry]:
        """Those of the further pressures."""
        if not self.further:
            return {}
        maps = {
            _name(k): Entry(p.pressure, units.height / units.length, optional=True) for k, p in enumerate(self.further)
        }
        return {
            **maps,
            MODULI: Entry(np.array([past.alpha for past in self.further]), units.modulus, "Pa", optional=True),
            POSITIONS: Entry(np.array([past.position for past in self.further]).ravel(), 1.0, "m", optional=True),
        }

    def _further_restored(self, saved: Saved) -> tuple[Past, ...]:
        """The further pressures of a checkpoint, none of them known where it has none."""
        if MODULI not in saved:
            return tuple(Past(past.pressure) for past in self.further)
        places = np.reshape(saved[POSITIONS], (-1, 2)).tolist()
        known = zip(self.further, saved[MODULI].tolist(), places, strict=True)
        return tuple(Past(past.pressure, alpha, (x, y)) for past, alpha, (x, y) in known)

    def restored(self, saved: Saved, row: Row) -> "State":
        """The state that a checkpoint has, whose maps have been read into those of this one."""
        if self.earlier is not None and "contact/earlier pressure" not in saved:
            self.earlier.fill(0.0)
        names = ("contact/modulus", "contact/earlier modulus", "contact/approach", "clock/distance")
        alpha, alpha_old, approach, distance = (float(saved[name]) for name in names)
        x, y = saved["clock/position"].tolist()
        old_x, old_y = saved.get("clock/earlier position", saved["clock/position"]).tolist()
        row = replace(row, distance=distance)
        further = self._further_restored(saved)
        return State(row, self.pressure, self.earlier, alpha, alpha_old, approach, (x, y), (old_x, old_y), further)


def _name(index: int) -> str:
    """In a checkpoint, of a further pressure."""
    return f"contact/pressure {index + 3} steps ago"


def entries(scene: Scene, state: State) -> dict[str, Entry]:
    """Everything that a run remembers, by names `part/name`; maps are the run's own, not copies."""
    units = scene.units
    parts = ((f"{part}/{name}", e) for part, owner in scene.parts.items() for name, e in owner.entries(units).items())
    return {**state.entries(units), **dict(parts)}


def restore(scene: Scene, state: State, contents: Contents) -> State:
    """Put the parts of a scene into the state of a checkpoint; the run's own, in the maps of `state`, is returned.

    Collective. Raises InputError for a checkpoint that lacks something, or is of another body.
    """
    _refuse_lost_branches(scene, contents)
    declared = entries(scene, state)
    wanted = {name: entry for name, entry in declared.items() if not entry.optional or name in contents.units}
    _compare(contents, wanted)
    read(contents, scene.slab, wanted)
    saved = {name: _value(name, entry, contents) for name, entry in wanted.items()}
    for part, owner in scene.parts.items():
        head = f"{part}/"
        owner.restore({name.removeprefix(head): value for name, value in saved.items() if name.startswith(head)})
    return state.restored(saved, Row(contents.step, contents.time))


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
            time = scene.setup.prony.relaxation_times[k]
            raise InputError(
                f"{contents.path} has no map of the branch of relaxation time {time:g} s: its run had no step so short "
                f"that it mattered to numerics.branch_error = {allowed:g}, now friction would be wrong by {error:.2g}; "
                "keep to longer steps, or start afresh (--restart never)"
            )

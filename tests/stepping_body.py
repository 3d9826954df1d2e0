"""A body and its memory as one object, which steps in place."""

from collections.abc import Iterable

from parcontact.parallel.slab import Array
from parcontact.physics.body import BodyMemory, MovedHeights, Trial, ZenerBody, surface_of
from parcontact.physics.records import Entry, Saved, Units


class HeldBody:
    """A body that remembers its last step."""

    def __init__(self, body: ZenerBody) -> None:
        self.body = body
        self.memory: BodyMemory = body.at_rest()

    @property
    def u(self) -> Array:
        """The displacement."""
        return surface_of(self.memory)

    @property
    def branches(self) -> Array:
        """The maps of its branches, advanced."""
        self.body.advance_branches(self.memory)
        return self.memory.branches

    def begin(self, dt: float, heights: MovedHeights, growth: float = 0.0) -> Trial:
        return self.body.begin(self.memory, dt, heights, growth)

    def commit(self, trial: Trial, displacement: Array) -> None:
        self.memory = self.body.commit(self.memory, trial, displacement, self.u)

    def start_from(self, displacement: Array, branches: Iterable[Array]) -> None:
        self.body.start_from(self.memory, displacement, branches)

    def entries(self, units: Units) -> dict[str, Entry]:
        return self.body.entries(self.memory, units)

    def restore(self, saved: Saved) -> None:
        """Go on from maps that are read into its own, as a checkpoint's are."""
        for name, entry in self.body.entries(self.memory, Units(1.0, 1.0, 1.0)).items():
            if entry.is_map and name in saved:
                entry.value[...] = saved[name]  # type: ignore[index]
        self.memory = self.body.restored(self.memory, saved)

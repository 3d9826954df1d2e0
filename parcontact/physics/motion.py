"""Where the rigid surface is: `h(x, t) = h0(x - s(t))`, with s its displacement [m]."""

from typing import Protocol

from ..history.timeline import SAME_PLACE
from .body import MovedHeights
from .surface import Surface

Vector = tuple[float, float]
PARTS = 10**9  # accuracy: of a cell: nearer positions are the same but for rounding, as those whole cells apart


def cells_between(old: Vector, new: Vector, cell: Vector) -> Vector:
    """By how many cells, along x and y, the surface moves from one displacement [m] to another."""
    return (new[0] - old[0]) / cell[0], (new[1] - old[1]) / cell[1]


def are_whole(cells: Vector) -> bool:
    """True for a displacement of whole cells."""
    return all(abs(moved - round(moved)) <= SAME_PLACE for moved in cells)


class Motion(Protocol):
    """Heights of the surface at a displacement; collective."""

    def at(self, displacement: tuple[float, float]) -> MovedHeights: ...


class AnyFraction:
    """Any fraction of a cell in any direction: the heights are made anew when the surface has moved."""

    def __init__(self, surface: Surface) -> None:
        self._surface = surface
        self._where = (0.0, 0.0)
        self._map = surface.heights(self._where, surface.slab.empty())

    def at(self, displacement: tuple[float, float]) -> MovedHeights:
        if displacement != self._where:
            self._surface.slab.tally["shift"] += 1
            self._surface.heights(displacement, self._map)
            self._where = displacement
        return MovedHeights(self._map)


class AlongX:
    """Sliding along x on a periodic box, by whole cells or (PARTS) by parts of a cell: one map, made anew when the part
    of a cell beside the whole ones has changed, and an index offset for these."""

    def __init__(self, surface: Surface, parts: int = 1) -> None:
        self._surface, self._parts, self._part = surface, parts, 0
        self._map = surface.heights((0.0, 0.0), surface.slab.empty())

    def at(self, displacement: tuple[float, float]) -> MovedHeights:
        cell = self._surface.cell[0]
        whole, part = divmod(round(displacement[0] / cell * self._parts), self._parts)
        if part != self._part:
            self._surface.slab.tally["shift"] += 1
            self._surface.heights((part / self._parts * cell, 0.0), self._map)
            self._part = part
        return MovedHeights(self._map, whole % self._surface.slab.nx)

"""Position of the rigid surface: `h(x, t) = h0(x - s(t))`, with s its displacement [m]."""

from typing import Protocol

from ..history.timeline import SAME_PLACE
from .body import MovedHeights
from .surface import Surface

Vector = tuple[float, float]
PARTS = 10**9  # accuracy: positions are rounded to this fraction of a cell


def cells_between(old: Vector, new: Vector, cell: Vector) -> Vector:
    """Return by how many cells, along x and y, the surface moves from one displacement [m] to another."""
    return (new[0] - old[0]) / cell[0], (new[1] - old[1]) / cell[1]


def are_whole(cells: Vector) -> bool:
    """Return True for a displacement of whole cells."""
    return all(abs(moved - round(moved)) <= SAME_PLACE for moved in cells)


class Motion(Protocol):
    """Heights of the surface at a displacement [m]; collective."""

    def at(self, displacement: tuple[float, float]) -> MovedHeights: ...


class AnyFraction:
    """Motion by any fraction of a cell in any direction: the heights are computed again after each motion."""

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
    """Motion along x on a periodic box, by whole cells or (PARTS) by parts of a cell.

    Whole cells are an index offset; the map is computed again when the fraction of a cell has changed.
    """

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

"""Nested grids: a contact is solved on the coarsest grid first, and each solution is the start on the next
finer grid."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from ..parallel import regrid
from ..parallel.slab import Array, Slab


@dataclass(frozen=True)
class Level:
    """One grid: its slab and the heights on it."""

    slab: Slab
    heights: Array


def coarser_levels(slab: Slab, heights: Array) -> list[Level]:
    """Return a grid and all coarser ones, the finest first; collective."""
    levels = [Level(slab, heights)]
    while (coarse := regrid.coarser(levels[-1].slab)) is not None:
        levels.append(Level(coarse, regrid.restrict(levels[-1].slab, coarse, levels[-1].heights)))
    return levels


class OnGrid(Protocol):
    """An object that belongs to a grid."""

    @property
    def slab(self) -> Slab: ...


L = TypeVar("L", bound=OnGrid)


def descend(levels: Sequence[L], solve: Callable[[L, Array], Array], start: Array) -> None:
    """Put a start for the finest grid into `start`: the solution on the next coarser grid, or 0 if there is none.

    `solve(level, start)` returns the pressure on a level. If it is not finite, the next level starts from 0.
    Collective.
    """
    below: tuple[L, Array] | None = None
    for level in reversed(levels):
        here = start if level is levels[0] else level.slab.empty(start.dtype)
        here.fill(0.0)
        if below is not None and _is_finite(below[0].slab, below[1]):
            regrid.prolong(below[0].slab, level.slab, below[1], here)
        if level is not levels[0]:
            below = level, solve(level, here)


def _is_finite(slab: Slab, p: Array) -> bool:
    return slab.sum(float(not np.all(np.isfinite(p))))[0] == 0.0

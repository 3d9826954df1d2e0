"""Records of a run: measures of an instant and certificates of solves, and entries of checkpoints with their units.

This file imports only numpy, so that it is imported quickly.

Each part of a run (`RunPart`) returns its memory before the first step, returns the checkpoint entries of a memory,
and restores a memory from saved entries, on any number of ranks. `march.state.parts_of` lists all parts.

In the units of a run all numbers are dimensionless. The units are powers of two: conversion is exact, and a checkpoint
in SI units restarts bit for bit.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

LONG_CELLS = 0.1  # fitted: power of the ratio of sides in `excess_of` (`scripts/chosen_mesh.py`)
SIDE = (math.pi - 1.0 + math.log(2.0)) / 24.0  # physics: cells in excess per side of a cell on the edge of contact


def excess_of(dx: float, dy: float, edges_follow_grid: bool = False) -> float:
    """Return by how many cells the counted contact area is too large, divided by the number of cell sides on the edge
    of contact.

    This excess is the constant SIDE for square cells, and for all cells if `edges_follow_grid`. For long cells it is
    smaller, since edges of contact then follow mostly the longer sides: SIDE times r to the power LONG_CELLS, with r
    the shorter of `dx` and `dy` over the longer one.
    """
    return SIDE if edges_follow_grid else SIDE * (min(dx, dy) / max(dx, dy)) ** LONG_CELLS


@dataclass(frozen=True)
class Measures:
    """Measures of a contact at one instant. Areas are shares of the nominal area.

    * pressure, max_pressure [Pa]: the mean over the box, and the largest value;
    * normal_force, force_x, force_y [N]: forces on the rigid surface. The tangential forces include the friction of the
      interface;
    * friction: tangential force divided by normal force, 0 without a compressive load;
    * force_interface [N], friction_interface: the parts of the tangential force and of `friction` from the interface;
    * approach, mean_gap [m]: approach of the rigid surface, and the mean of the gap over the box;
    * gap_by_edges [m]: error of `mean_gap` in a free box, whose points are shifted by half a cell against the box;
    * contact_area: share of the points with pressure;
    * contact_area_corrected: `contact_area` without the excess along edges of contact;
    * spared: area that the correction leaves in, as points on the edge have yielded;
    * straight: 1 if all edges of contact are parallel to one axis of the grid, 0 if equal lengths of the edges are
      parallel to x and to y, as in round spots;
    * at_edge: True if an isolated contact reaches the edge of the box.

    The correction of the area holds on average for edges in all directions that are smooth on the scale of a cell:
    spheres, and rough surfaces whose shortest wave has at least 4 cells. The edge of the box is not an edge of contact.
    """

    pressure: float = 0.0
    force_x: float = 0.0
    force_y: float = 0.0
    friction: float = 0.0
    contact_area: float = 0.0
    approach: float = 0.0
    mean_gap: float = 0.0
    gap_by_edges: float = 0.0
    max_pressure: float = 0.0
    contact_area_corrected: float = 0.0
    at_edge: bool = False
    normal_force: float = 0.0
    friction_interface: float = 0.0
    force_interface: float = 0.0
    spared: float = 0.0
    straight: float = 0.0

    @property
    def finite(self) -> bool:
        return all(map(math.isfinite, vars(self).values()))

    @property
    def friction_x(self) -> float:
        """Tangential force along x divided by normal force, `-force_x/normal force`, positive where it opposes motion
        along +x; 0 at zero load."""
        force = math.hypot(self.force_x, self.force_y)
        return 0.0 - self.friction * (self.force_x / force) if force > 0.0 else 0.0


@dataclass(frozen=True)
class Certificate:
    """Errors of a returned pressure, without unit. They are computed from this pressure alone.

    * complementarity: `sum(p |g|)/(L sum(p))`;
    * penetration: the largest `max(-g, 0)/L` of all points;
    * load: `|mean(p)/P0 - 1|`, 0 under a given approach;
    * members: share of the points that have pressure or penetration;
    * length: L, the standard deviation of the displacement u in the contact, weighted by the pressure,

        L^2 = <p, u^2>/<p> - (<p, u>/<p>)^2.

    L is at least LEAST_SHARE of the mean `<p, u>/<p>`, which matters for contacts of one or two points, and at most the
    height of the surface. L does not depend on the size of the box. In steady sliding along lines of points, waves that
    do not vary along the lines may meet a far lower modulus and make most of the displacement
    (`contact.certificate.Lines`).
    """

    complementarity: float
    penetration: float
    load: float
    length: float = math.nan
    members: float = 0.0

    @cached_property
    def worst(self) -> float:
        total = self.complementarity + self.penetration + self.load
        return total if math.isnan(total) else max(self.complementarity, self.penetration, self.load)

    def shortened(self, share: float) -> "Certificate":
        """Return the errors for a reference length that is `share` times the present `length`."""
        gaps = self.complementarity / share, self.penetration / share
        return replace(self, complementarity=gaps[0], penetration=gaps[1], length=share * self.length)


def _power_of_two(value: float) -> float:
    return 2.0 ** round(math.log2(value)) if value > 0.0 else 1.0


@dataclass(frozen=True)
class Units:
    """Units of a run: of heights and displacements [m], of lengths in the plane [m], and of moduli [Pa]."""

    height: float
    length: float
    modulus: float

    @classmethod
    def near(cls, height: float, length: float, modulus: float) -> "Units":
        """Return the powers of two nearest to typical values; for a flat surface (height 0) the unit of heights is
        `length`."""
        return cls(_power_of_two(height or length), _power_of_two(length), _power_of_two(modulus))

    @property
    def pressure(self) -> float:
        """Unit of pressures [Pa], `modulus height/length`."""
        return self.modulus * self.height / self.length


Saved = Mapping[str, NDArray[Any]]
Memory = TypeVar("Memory")


@dataclass(frozen=True)
class Entry:
    """A remembered quantity: a map (two-dimensional, the rows of this rank), or numbers. `unit` is the factor from
    `value` to SI units, and `symbol` is the name of the SI unit.

    A checkpoint may lack an `optional` entry. Then the method `restored` of the part makes a value for this entry. A
    `given` entry follows from the job: its value is not restored, and a checkpoint with another value is refused.
    """

    value: NDArray[Any] | float
    unit: float = 1.0
    symbol: str = "1"
    optional: bool = False
    given: bool = False

    @property
    def is_map(self) -> bool:
        return np.ndim(self.value) == 2

    @property
    def nbytes(self) -> int:
        """Bytes of this rank's part of the entry."""
        return np.asarray(self.value).nbytes


class RunPart(Protocol[Memory]):
    """A part of a run that has a memory from one step to the next.

    The memory is a value: a step returns a new memory. Two memories may share maps (`march.state`).
    """

    def at_rest(self) -> Memory:
        """Return the memory before the first step, in new maps."""

    def entries(self, memory: Memory, units: Units) -> dict[str, Entry]:
        """Return the checkpoint entries of a memory by the part's own names; maps are not copied."""

    def restored(self, memory: Memory, saved: Saved) -> Memory:
        """Return the memory of a checkpoint. The saved maps have already been read into `memory`. Other entries of
        `saved` are arrays of numbers in the run's units."""


def with_part(part: str, entries: Mapping[str, Entry]) -> dict[str, Entry]:
    """Return the entries of a part under their full names `part/name` in a checkpoint."""
    return {f"{part}/{name}": entry for name, entry in entries.items()}


def part_of(part: str, saved: Saved) -> Saved:
    """Return the entries of one part of a checkpoint, by the part's own names."""
    head = f"{part}/"
    return {name.removeprefix(head): value for name, value in saved.items() if name.startswith(head)}

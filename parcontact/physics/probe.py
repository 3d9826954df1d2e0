"""Measures of a step, in SI units: load, tangential force, contact area, gaps.

Counted in cells, the contact area is too large, as a cell on the edge of contact counts as a whole. With the length S
of all edges of contact along the sides of cells of length dx, the area is on average `A - (pi - 1 + ln 2)/24 S dx` (V.
A. Yastrebov, G. Anciaux, J.-F. Molinari, Tribology International 114 (2017) 161, arXiv:1701.02727). In cells this is
`SIDE` for each side between a point in contact and one that is not, and less on long cells (`measures.excess_of`).

This holds if the pressure falls to 0 at the edge. Where a stiff counterbody yields, it ends at the hardness H, and a
point on the edge carries the share p/H of it: the excess is `1 - p/H` of a cell, and 0 at points that have yielded.
Where the pressure falls from H to 0 over a cell or more, the edge is as without yielding, although points on it may
have neighbours that have yielded. The smaller excess of the two holds for both.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from numpy.typing import NDArray

from ..parallel import rows
from ..parallel.slab import Array, Slab
from . import loops
from .interface_friction import Shear, Vector
from .measures import Measures, excess_of
from .surface import Surface
from .units import Units

YIELDED = 1e-6  # accuracy: relative distance of a pressure to the hardness up to which a point counts as yielded


class _Yielding(NamedTuple):
    """Sums over all points of a contact that may yield: excess cells on its edge if pressures end at the hardness
    there, points that have yielded, and their gaps, which are negative."""

    excess: float
    points: float
    gaps: float


@dataclass(frozen=True)
class Probe:
    """Computes measures from the maps of a solved step; pressures are bounded by the `hardness` [Pa]."""

    slab: Slab
    surface: Surface
    units: Units
    shears: Sequence[Shear] = ()
    hardness: float | None = None

    @cached_property
    def _excess(self) -> float:
        """Excess cells per side on the edge of contact."""
        (lx, ly), slab = self.surface.size, self.slab
        return excess_of(lx / slab.nx, ly / slab.ny, 1 in (slab.nx, slab.ny))

    def measure(
        self,
        p: Array,
        alpha: float,
        u: Array,
        h: Array,
        d: float,
        touching: NDArray[Any],
        displacement: Vector,
        velocity: Vector = (0.0, 0.0),
        least_load: float = 0.0,
    ) -> Measures:
        """Return the measures of the pressure `alpha p` with the gap `u - h - d`; collective.

        The surface has moved by `displacement` [m] and moves with `velocity` [m/s]. `touching` is a map that is not 0
        where the surfaces touch. Friction is 0 without a compressive load above `least_load` [N], the rounding of two
        forces that balance. If nothing touches, all pressure is tension, and a load above 0 is an error of the solve.
        """
        units, points = self.units, self.slab.points
        along_x, along_y = self.surface.periodic
        *sums, largest = loops.sum_measures(p, u, h, touching, rows.before_first(self.slab, touching, along_y), along_x)
        edge = _touches_edge(self.slab, touching, self.surface.periodic)
        load, count, gaps, sides, largest, edge = self.slab.reduce(sums, [largest, edge])
        unit_pressure = alpha * units.pressure
        excess, least = self._excess * sides, 0.0
        if self.hardness is not None and largest * unit_pressure >= (1.0 - YIELDED) * self.hardness:
            highest = self.hardness / unit_pressure
            yielding = self._measure_yielded(p, u, h, highest)
            gaps -= yielding.gaps - yielding.points * d
            excess, least = min(excess, yielding.excess), min(load / highest, count)
        area = self.surface.size[0] * self.surface.size[1]
        force_x, force_y = 0.0, 0.0
        if load > 0.0 or least_load > 0.0:
            unit_force = area / points * unit_pressure * units.height
            force_x, force_y = (unit_force * force for force in self.surface.forces(p, displacement))
        normal = load / points * unit_pressure * area
        presses = normal > least_load and count > 0
        corrected = max(count - excess, least) / points
        forces = [shear.force(corrected * area, velocity) for shear in self.shears]
        own = sum(force[0] for force in forces), sum(force[1] for force in forces)
        force_x, force_y = force_x + own[0], force_y + own[1]
        rubbed = math.hypot(*own)
        return Measures(
            pressure=load / points * unit_pressure,
            force_x=force_x,
            force_y=force_y,
            friction=math.hypot(force_x, force_y) / normal if presses else 0.0,
            contact_area=count / points,
            approach=d * units.height - self.surface.datum,
            mean_gap=(gaps / points - d) * units.height,
            max_pressure=largest * unit_pressure,
            contact_area_corrected=corrected,
            at_edge=edge > 0.0,
            normal_force=normal,
            friction_interface=rubbed / normal if presses else 0.0,
            force_interface=rubbed,
            spared=(self._excess * sides - excess) / points,
        )

    def _measure_yielded(self, p: Array, u: Array, h: Array, highest: float) -> _Yielding:
        """Return the sums for a contact whose pressures end at `highest`, in the unit of p; collective."""
        along_x, along_y = self.surface.periodic
        above, below = rows.around(self.slab, p, 1, along_y)
        found = loops.measure_yielded(p, u, h, above[0], below[0], along_x, (1.0 - YIELDED) * highest)
        sharp, sides, count, gaps = self.slab.sum(*found)
        return _Yielding(sharp + self._excess * sides, count, gaps)


def _touches_edge(slab: Slab, touching: NDArray[Any], periodic: tuple[bool, bool]) -> float:
    """Return 1 if the surfaces touch on this rank at a free edge of the box, in a direction with several points."""
    sides = [touching[:, 0], touching[:, -1]] if slab.nx > 1 and not periodic[0] else []
    if slab.ny > 1 and len(touching) and not periodic[1]:
        sides += [touching[0]] * (slab.rows.start == 0) + [touching[-1]] * (slab.rows.stop == slab.ny)
    return float(any(side.any() for side in sides))

"""What a step did, in SI: load, tangential force, contact area, gaps, energies."""

import math
from dataclasses import dataclass

from ..parallel.slab import Array, Slab
from . import loops
from .surface import Surface
from .units import Units


@dataclass(frozen=True)
class Measures:
    """One instant: pressures [Pa], forces [N] on the rigid surface, lengths [m]; area as a share of the nominal."""

    pressure: float = 0.0
    force_x: float = 0.0
    force_y: float = 0.0
    friction: float = 0.0
    contact_area: float = 0.0
    approach: float = 0.0
    mean_gap: float = 0.0
    max_pressure: float = 0.0


@dataclass(frozen=True)
class Ledger:
    """Turns the maps of a solved step into measures."""

    slab: Slab
    surface: Surface
    units: Units

    def measures(
        self, p: Array, alpha: float, u: Array, h: Array, d: float, displacement: tuple[float, float]
    ) -> Measures:
        """Of the pressure `alpha p`, with `u - h - d` the gap, the surface moved by `displacement` [m]; collective."""
        units, points = self.units, self.slab.points
        *sums, largest = loops.measure(p, u, h)
        load, count, gaps, largest = self.slab.reduce(sums, [largest])
        unit_pressure = alpha * units.pressure
        area = self.surface.size[0] * self.surface.size[1]
        force_x, force_y = 0.0, 0.0
        if load > 0.0:
            unit_force = area / points * unit_pressure * units.height
            force_x, force_y = (unit_force * force for force in self.surface.forces(p, displacement))
        normal = load / points * unit_pressure * area
        return Measures(
            pressure=load / points * unit_pressure,
            force_x=force_x,
            force_y=force_y,
            friction=math.hypot(force_x, force_y) / normal if normal > 0.0 else 0.0,
            contact_area=count / points,
            approach=d * units.height - self.surface.datum,
            mean_gap=(gaps / points - d) * units.height,
            max_pressure=largest * unit_pressure,
        )

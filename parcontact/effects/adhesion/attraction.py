"""Laws of adhesion: the attraction of two surfaces as a function of their gap, and its length scales.

With the work of adhesion w [J/m^2], the range rho [m] and the gap g,

    exponential  sigma(g) = (w/rho) exp(-g/rho),          gamma(g) = w exp(-g/rho),
    dugdale      sigma(g) = w/rho for g < rho, else 0,    gamma(g) = w max(1 - g/rho, 0).

A node that crosses the end of Dugdale's law would snap, with an error proportional to the side h of the cells. So
the computed law ends over a ramp in the gap, centred at rho: it is the mean of the law over a cell at the end of the
process zone, where the gap rises by about 2 rho h/l in a cell.

The traction at the edge of a contact rises over the process zone `l = E* rho^2/w`, with E* = 2 G/(1 - nu). Tabor's
and Johnson's parameters classify adhesive contacts,

    mu = (R w^2/(E*^2 rho^3))^(1/3),        alpha^2 = 2 w lambda/(pi^2 E* h^2),

of a sphere of radius R (D. Tabor, J. Colloid Interface Sci. 58 (1977) 2), and of a wave of length lambda whose
crests are 2 h above its troughs (K. L. Johnson, Int. J. Solids Struct. 32 (1995) 423).
"""

import math
from dataclasses import dataclass
from typing import Any, Literal

from ...job.sections.calculation import Grid

KINDS = ("exponential", "dugdale")


@dataclass(frozen=True)
class AdhesionLaw:
    """Law of adhesion: work [J/m^2], range [m], kind, and the ramp [m] of Dugdale's law."""

    work: float
    range: float
    kind: Literal["exponential", "dugdale"] = "exponential"
    ramp: float = 0.0

    @property
    def strength(self) -> float:
        """Largest attraction [Pa]."""
        return self.work / self.range

    def process_zone(self, modulus: float) -> float:
        """Return the length l of the process zone [m] for E* [Pa]."""
        return modulus * self.range**2 / self.work

    def tabor(self, modulus: float, radius: float) -> float:
        """Return Tabor's parameter for E* [Pa] and the radius of a sphere [m]."""
        return (radius * self.work**2 / (modulus**2 * self.range**3)) ** (1.0 / 3.0)

    def johnson(self, modulus: float, length: float, amplitude: float) -> float:
        """Return Johnson's parameter for E* [Pa], the length of a wave [m] and its amplitude [m]."""
        return math.sqrt(2.0 * self.work * length / (math.pi**2 * modulus)) / abs(amplitude)


def ramp_of(law: AdhesionLaw, modulus: float, cell: float) -> float:
    """Return the ramp of Dugdale's law [m], 2 rho h/l and at most 2 rho, for E* [Pa] and the side of a cell [m]."""
    return 2.0 * law.range * cell / max(law.process_zone(modulus), cell)


def smallest_range(work: float, modulus: float, cell: float, cells: float) -> float:
    """Return the range [m] whose process zone has the length of `cells` cells, for E* [Pa] and the side of
    a cell [m]."""
    return math.sqrt(cells * cell * work / modulus)


def modulus_of(material: Any) -> float:
    """Return E* = 2 G/(1 - nu) of the relaxed body [Pa]."""
    return float(2.0 * material.fitted.long_modulus / (1.0 - material.poisson))


def cell_of(grid: Grid) -> float:
    """Return the longer side of a cell [m] among the directions with several points."""
    return max((step for step, n in zip((grid.dx, grid.dy), grid.points, strict=True) if n > 1), default=grid.dx)

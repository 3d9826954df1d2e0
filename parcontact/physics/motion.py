"""Motion of the surface, and the forces that follow from it.

Position of the rigid surface: `h(x, t) = h0(x - s(t))`, with s its displacement [m].

Tangential force of a pressure on the surface of the body, `-<p, du/ds>`, the second estimate of friction.

In the continuum this force equals the force on the rigid surface, `-<p, dh/ds>` (paper, Eq. 10), as the gap and its
slope vanish under pressure. On a mesh the difference of both forces measures the mesh error of friction. On an elastic
body the force on the body is exactly 0, as the operator A is symmetric and any antisymmetric difference along s
commutes with it.

Slopes are differences of the eighth order,

    du/dx = sum_k c_k (u(x + k dx) - u(x - k dx))/dx,      c = 4/5, -1/5, 4/105, -1/280,

with an error of 0.03 % for a wave of 8 cells and 3 % for a wave of 4. Unlike slopes of a Fourier series, these
differences need only points near the contact, in periodic and in free boxes.

Friction of the contact area itself is a shear stress that opposes sliding on all points in contact:

    F = -tau A v/|v|,    tau constant, or    tau(v) = tau_0 exp(-(log10(a_T |v|/v_0)/w)^2),

a bell-shaped function of the logarithm of the velocity with its maximum at v_0, shifted by temperature like the bulk
(B. Lorenz, Y. R. Oh, S. K. Nam, S. H. Jeon, B. N. J. Persson, J. Chem. Phys. 142 (2015) 194701, with c = 1/w^2). Shear
does not move an incompressible half space along its normal (nu = 1/2), so that this friction is added without a coupled
solve.
"""

import math
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ..compiled import loop
from ..job.history import SAME_PLACE
from ..parallel import regrid
from ..parallel.slab import Array, Slab
from .body import MovedHeights
from .surface import Surface

Vector = tuple[float, float]
PARTS = 10**9  # accuracy: positions are rounded to this fraction of a cell


def cells_between(old: Vector, new: Vector, cell: Vector) -> Vector:
    """Return the numbers of cells, along x and y, by which the surface moves between two displacements [m]."""
    return (new[0] - old[0]) / cell[0], (new[1] - old[1]) / cell[1]


def are_whole(cells: Vector) -> bool:
    """Return True for a displacement of whole cells."""
    return all(abs(moved - round(moved)) <= SAME_PLACE for moved in cells)


class Motion(Protocol):
    """Motion of the surface, which returns its heights at a displacement [m]; collective."""

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

    Motion by whole cells is an index offset; the map is computed again when the fraction of a cell has changed.
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


WIDTH = 4  # accuracy: number of points on each side in a difference
WEIGHTS = (4 / 5, -1 / 5, 4 / 105, -1 / 280)


def friction_by_energy(
    slab: Slab, p: Array, u: Array, cell: tuple[float, float], direction: tuple[float, float], cyclic: tuple[bool, bool]
) -> float:
    """Return `-<p, du/ds>/<p, 1>` for the slope along a unit `direction`; collective. The unit of the result is the
    unit of `u` divided by the unit of `cell = (dx, dy)`. Where a box is not `cyclic`, its last columns or rows continue
    beyond the edge."""
    along_x, along_y = direction[0] / cell[0], direction[1] / cell[1]
    if along_y == 0.0:
        nothing = np.empty((0, slab.nx), u.dtype)
        above, below = nothing, nothing
    else:
        above, below = regrid.around(slab, u, WIDTH, cyclic[1])
    load, force = slab.sum(*_sums(p, u, above, below, along_x, along_y, cyclic[0]))
    return -force / load if load > 0.0 else math.nan


@loop
def _sums(p, u, above, below, along_x, along_y, cyclic):
    """Return the sums of p and of p times the slope of u; `above` and `below` are the rows next to those of this rank,
    the nearest first."""
    ny, nx = p.shape
    load, force = 0.0, 0.0
    line, slope = np.empty(nx + 2 * WIDTH), np.empty(nx)
    for j in range(ny):
        row_load = 0.0
        for i in range(nx):
            row_load += p[j, i]
        if row_load == 0.0:
            continue
        for i in range(nx):
            line[WIDTH + i] = u[j, i]
        for k in range(WIDTH):
            line[WIDTH - 1 - k] = u[j, (-1 - k) % nx] if cyclic else u[j, 0]
            line[nx + WIDTH + k] = u[j, k % nx] if cyclic else u[j, nx - 1]
        row_force, start, end = 0.0, 0, 0
        while end < nx:
            start = end
            while start < nx and p[j, start] == 0.0:
                start += 1
            end = start
            while end < nx and p[j, end] != 0.0:
                end += 1
            for i in range(start, end):
                at = i + WIDTH
                slope[i] = WEIGHTS[0] * (line[at + 1] - line[at - 1]) + WEIGHTS[1] * (line[at + 2] - line[at - 2])
                slope[i] += WEIGHTS[2] * (line[at + 3] - line[at - 3]) + WEIGHTS[3] * (line[at + 4] - line[at - 4])
                slope[i] *= along_x
            if along_y != 0.0:
                for k in range(1, WIDTH + 1):
                    weight = along_y * WEIGHTS[k - 1]
                    after = u[j + k] if j + k < ny else below[j + k - ny]
                    before = u[j - k] if j >= k else above[k - j - 1]
                    for i in range(start, end):
                        slope[i] += weight * (after[i] - before[i])
            for i in range(start, end):
                row_force += p[j, i] * slope[i]
        load += row_load
        force += row_force
    return load, force


class Shear(Protocol):
    """Friction of the contact area itself, in addition to the friction of the body."""

    def force(self, area: float, velocity: Vector) -> Vector:
        """Return the force [N] on the rigid surface that slides with `velocity` [m/s] on an area in contact [m^2]."""

    def shifted(self, factor: float) -> "Shear":
        """Return the friction at a temperature that multiplies the relaxation times of the body by `factor`."""


@dataclass(frozen=True)
class InterfaceFriction:
    """Shear stress of the contact area: `shear_stress` [Pa] is its largest value. A bell has its maximum at `velocity`
    [m/s], its `width` [decades], and the shift factor a_T (`shift`)."""

    shear_stress: float
    velocity: float | None = None
    width: float = 1.0
    shift: float = 1.0

    def stress(self, speed: float) -> float:
        """Return the shear stress [Pa] at a sliding speed [m/s]; 0 at rest."""
        if speed <= 0.0:
            return 0.0
        if self.velocity is None:
            return self.shear_stress
        decades = math.log10(speed / self.velocity) + math.log10(self.shift)
        return self.shear_stress * math.exp(-((decades / self.width) ** 2))

    def shifted(self, factor: float) -> "InterfaceFriction":
        """Return the friction with the bell shifted by the factor a_T of the bulk."""
        return replace(self, shift=self.shift * factor)

    def force(self, area: float, velocity: Vector) -> Vector:
        """See `Shear.force`."""
        speed = math.hypot(*velocity)
        size = self.stress(speed) * area / (speed or 1.0)
        return 0.0 - size * velocity[0], 0.0 - size * velocity[1]

"""Flow of a fluid through the gap of a contact.

The Reynolds equation for a fluid of viscosity eta between two bodies that touch where the gap g is zero,

    div(g^3 grad p) = 0,      flow per width  Q = -(K / 12 eta) grad p,

is solved by finite volumes: each point of the map is a cell, and the conductance of the face between two cells is
the harmonic mean of their g^3. The pressure is prescribed on two opposite ends of the map. The other two sides are
periodic or closed. Contact is impermeable. Only cells on a path from end to end are used. Their matrix is factorized
directly, as g^3 spans many decades and iterations stall. The flow follows from its dissipation, `sum c (p -
p_neighbour)^2`, which is minimal for the exact pressures, so that their errors enter squared.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ... import datafiles
from ...errors import InputError
from .elimination import Balance
from .paths import connected_from_end_to_end, critical_constriction

Map = NDArray[np.float64]
LEAST_GAP = 1e-3  # accuracy: least open gap over the largest; this changes the flow by about 1e-5
LEAST_OF_CONSTRICTION = 0.1  # accuracy: least open gap over the critical constriction
MOST_OF_CONSTRICTION = 1e3  # accuracy: largest gap over the critical constriction; wider cells resist 1e-9 of the whole


@dataclass(frozen=True)
class Flow:
    """Flow along one direction: `conductivity` is K [m^3], 0 if no path leads from end to end.

    `constriction` [m] is the smallest gap on the widest path and `position` its row and column; `imbalance` is the
    difference of outflow and of the inflow by dissipation, over the flow, a rounding error; `pressure` is the map of
    the fluid's pressure, 1 at the first and 0 at the last end, NaN where no fluid flows.
    """

    conductivity: float
    constriction: float
    position: tuple[int, int] | None
    imbalance: float
    pressure: Map = field(repr=False)

    @property
    def percolates(self) -> bool:
        return self.constriction > 0.0


def solve_flow(gap: Map, size: tuple[float, float], axis: str = "x", periodic_sides: bool = True) -> Flow:
    """Return the flow through a map of gaps [m], shape (ny, nx), on a box of `size` (lx, ly) [m] along `axis`."""
    if axis == "x":
        turned = solve_flow(gap.T, size[::-1], "y", periodic_sides)
        place = None if turned.position is None else (turned.position[1], turned.position[0])
        return replace(turned, position=place, pressure=turned.pressure.T)
    constriction, position = critical_constriction(gap, periodic_sides)
    if position is None:
        return Flow(0.0, 0.0, None, 0.0, np.full(gap.shape, np.nan))
    resistances, (ny, nx) = _resistances(gap, constriction, periodic_sides), gap.shape
    balance, given = Balance(resistances, size[0] / size[1] * ny / nx, periodic_sides), np.zeros(gap.shape)
    given[0] = balance.first
    pressure = balance.solve(given)
    power, leaving = balance.power(pressure), float(balance.last @ pressure[-1])
    conductivity = constriction**3 * power * size[1] / size[0]
    wet = np.where(np.isfinite(resistances), pressure, np.nan)
    return Flow(conductivity, constriction, position, abs(leaving / power - 1.0), wet)


def _resistances(gap: Map, constriction: float, periodic_sides: bool) -> Map:
    """Return 1/g^3 over 1/g^3 of the constriction; infinite in cells that are not used."""
    least = min(LEAST_GAP * float(gap.max()), LEAST_OF_CONSTRICTION * constriction)
    wet = connected_from_end_to_end(gap >= least, periodic_sides)
    found = np.full(gap.shape, np.inf)
    found[wet] = (constriction / np.minimum(gap[wet], MOST_OF_CONSTRICTION * constriction)) ** 3
    return found


def least_section(gap: Map, flow: Flow, size: tuple[float, float], axis: str = "x") -> float:
    """Return the smallest open section [m^2] across a flow along `axis`, over cells in which fluid flows; 0 if contact
    closes the gap. `gap` [m] has the shape (ny, nx), and `size` is (lx, ly) [m]."""
    across, width = (0, size[1]) if axis == "x" else (1, size[0])
    wet = np.where(np.isfinite(flow.pressure), gap, 0.0)
    return float(wet.mean(axis=across).min()) * width


def flow_mesh_error(
    gap: Map, flow: Flow, size: tuple[float, float], axis: str = "x", periodic_sides: bool = True
) -> float:
    """Return the relative change of K if only every second point of its gap is used, starting with the first or the
    second, whichever changes it more; NaN if contact closes the gap. The other arguments are as in `solve_flow`."""
    if not flow.percolates:
        return math.nan
    found = []
    for start in (0, 1):
        half = gap[tuple(slice(start, None, 2) if n > 1 else slice(None) for n in gap.shape)]
        found.append(abs(solve_flow(half, size, axis, periodic_sides).conductivity / flow.conductivity - 1.0))
    return max(found)


@dataclass(frozen=True)
class Leak:
    """Flow through a gap along x and along y.

    `flow_x` and `flow_y` are the conductivities K [m^3]: a pressure that falls by `dp` over the length drives `K/(12
    eta) dp/length` through each metre of width. `constriction` [m] is the smallest gap on the widest path in the
    direction that leaks more; 0 if contact closes the gap.
    """

    along_x: Flow
    along_y: Flow

    @property
    def flow_x(self) -> float:
        return self.along_x.conductivity

    @property
    def flow_y(self) -> float:
        return self.along_y.conductivity

    @property
    def constriction(self) -> float:
        return max(self.along_x.constriction, self.along_y.constriction)


def leak(gap: ArrayLike, size: Sequence[float], periodic: bool | tuple[bool, bool] = True) -> Leak:
    """Return the flow through a map of gaps [m], shape (ny, nx), on a box of `size` (lx, ly) [m], along x and along y.

    A gap of 0 or less is contact. Sides along the flow are `periodic`, or closed. Raises InputError for maps or
    sizes of another kind, and for gaps that are not finite.
    """
    try:
        given = np.asanyarray(gap)
    except ValueError:
        raise InputError("gap must be a map of numbers [m], shape (ny, nx)") from None
    if given.dtype.kind not in "iuf":
        raise InputError(f"gap must be a map of real numbers [m], shape (ny, nx), got values of type {given.dtype}")
    if masked := int(np.count_nonzero(np.ma.getmaskarray(given))):
        raise InputError(
            f"gap must be known everywhere, {masked} of {given.size} points are masked: fill or close (0) them"
        )
    gaps = np.asarray(given, dtype=float)
    if gaps.ndim != 2 or not gaps.size:
        raise InputError(f"gap must be a map [m] of shape (ny, nx), got one of shape {gaps.shape}")
    if missing := int(np.count_nonzero(~np.isfinite(gaps))):
        raise InputError(f"gap must be finite, {missing} of {gaps.size} points are not: fill or close (0) them")
    gaps, lengths = np.maximum(gaps, 0.0), _lengths(size)
    datafiles.refuse_extreme("gap", float(gaps.max()))
    along_x, along_y = periodic if isinstance(periodic, tuple) else (periodic, periodic)
    return Leak(*(solve_flow(gaps, lengths, axis, sides) for axis, sides in (("x", along_y), ("y", along_x))))


def _lengths(size: Sequence[float]) -> tuple[float, float]:
    try:
        width, height = (float(length) for length in size)
    except (TypeError, ValueError):
        raise InputError(f"size must be two lengths (lx, ly) [m], got {size!r}") from None
    if not (0.0 < width < math.inf and 0.0 < height < math.inf):
        raise InputError(f"size must be two positive lengths (lx, ly) [m], got {size!r}")
    return width, height

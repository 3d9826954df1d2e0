"""The problem of a contact solve: operators, control and bounds of pressures. Also the result of a solve, its maps and
its precision.

`Box` bounds the pressure, for contact without adhesion (p >= 0), for a counterbody that yields at its hardness H (0 <=
p <= H), or for a gap that holds a fluid of pressure q (p >= q):

    lowest <= p <= highest,    g >= 0 where p < highest,    g <= 0 where p > lowest,

with the gap `g = u - h - d`. Where p = H the rigid surface yields by -g. Each solve starts from the full heights:
earlier yielding is not remembered (A. Almqvist, F. Sahlin, R. Larsson, S. Glavatskih, Tribol. Int. 40 (2007) 574). The
mean pressure must be between the bounds. Points with a pressure between the bounds are free: they determine the
approach, and their pressures are scaled to the load.

`InterfaceLaw` lets the mean planes of two surfaces approach under a pressure, because the pressure squeezes roughness
finer than the grid. This approach, the closing c(p), rises with p, so that the problem is monotone and has one
solution:

    p >= 0,    w = A p + c(p) - h - d >= 0,    p w = 0.

A point with pressure penetrates by `h + d - c(p)`.

Directions, residuals and preconditioned residuals may be rounded to single precision: the step along a direction and
the image of the new iterate are computed in double precision. Full contact is solved by a single step; its result is
then correct to little more than single precision.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..compiled import loop
from ..errors import InputError
from ..parallel.slab import Array, Slab
from ..physics.records import Certificate

Mask = NDArray[Any]  # a map that is not 0 at the selected points


class Constraint(Protocol):
    """Conditions on pressure p and gap at each point. Maps have the shape (rows of this rank, nx)."""

    def touches(self, p: Array) -> Mask:
        """Return a map that is not 0 where the surfaces touch under an admissible pressure p, and 0 elsewhere. The map
        may be p itself."""

    def project(self, p: Array) -> None:
        """Replace p by the nearest admissible pressure."""

    def resolve(self, s: Array, h: Array, gamma: float, p: Array, reflected: Array) -> float:
        """Solve `p + gamma c(p) = s + gamma h` at each point, limit p to its bounds, and put `2 p - s` into
        `reflected`. Return the sum of `reflected` on this rank. s is the map that `splitting` iterates, and gamma is
        the parameter of `splitting` [pressure/length]."""

    def add_closing(self, u: Array, p: Array) -> Array:
        """Return `u + c(p)`, with the approach c(p) of the mean planes by roughness finer than the grid. Without such
        roughness, return the map u itself."""

    def in_units(self, pressure: float, length: float) -> "Constraint":
        """Return the constraint in the given units of pressure and length."""


@dataclass(frozen=True)
class Box:
    """Constraint `lowest <= p <= highest` [unit of p]. The default is contact without adhesion."""

    lowest: float = 0.0
    highest: float = math.inf

    def touches(self, p: Array) -> Mask:
        """Return a map that is not 0 where p is above its lower bound, also where the counterbody yields, and 0
        elsewhere."""
        return p if self.lowest == 0.0 else p > self.lowest

    def admits(self, mean: float) -> bool:
        """Return True if a prescribed mean pressure is possible: pressures within the bounds can have it."""
        return self.lowest * (1.0 - LOAD_ROUNDING) <= mean <= self.highest * (1.0 + LOAD_ROUNDING)

    def project(self, p: Array) -> None:
        """Limit p to the bounds."""
        np.clip(p, self.lowest, self.highest, out=p)

    def resolve(self, s: Array, h: Array, gamma: float, p: Array, reflected: Array) -> float:
        """Put `s + gamma h`, limited to the bounds, into p, and `2 p - s` into `reflected` (`Constraint.resolve`)."""
        return float(_resolve_bounds(s, h, gamma, self.lowest, self.highest, p, reflected))

    def add_closing(self, u: Array, p: Array) -> Array:
        """Return u: bounds of the pressure do not let the mean planes approach."""
        return u

    def in_units(self, pressure: float, length: float) -> "Box":
        """Return the bounds in the unit `pressure`. The unit `length` is not used."""
        return Box(self.lowest / pressure, self.highest / pressure)


MAX_PASSES = 20  # accuracy: largest number of passes that scale pressures to the load; 2 or 3 are usual
LOAD_ROUNDING = 1e-14  # accuracy: tolerance on the load, as a share of it, set by rounding
SNAP = 1e-12  # accuracy: pressures within this share of the range of a bound are put on the bound


def subtract_load(slab: Slab, box: Box, p: Array, excess: float, points: float) -> float:
    """Subtract `excess`, a sum of pressures, in equal parts for a number of `points` from an admissible p; collective.
    Return the sum of the result, limited to the bounds."""
    p -= excess / points
    box.project(p)
    return slab.sum(float(p.sum()))[0]


def scale_to_load(slab: Slab, box: Box, p: Array, load: float, total: float) -> None:
    """Scale an admissible p from its sum `load` to the wanted sum `total`; collective.

    At points below the upper bound, the difference between p and the lower bound is scaled. If these points cannot
    carry `total`, p is replaced by a weighted mean of p and a bound. If p is at its lower bound everywhere, p becomes
    uniform.
    """
    even, span = box.lowest * slab.points, box.highest - box.lowest
    if load <= even * (1.0 + slab.points * np.finfo(np.float64).eps):
        p.fill(total / slab.points)
    elif span == math.inf:
        _stretch(p, box.lowest, (total - even) / (load - even))
    else:
        _scale_free(slab, box, p, total - even)


def _stretch(p: Array, lowest: float, factor: float) -> None:
    """Multiply the part of p above `lowest` by a factor."""
    if lowest:
        p -= lowest
    p *= factor
    if lowest:
        p += lowest


def _scale_free(slab: Slab, box: Box, p: Array, total: float) -> None:
    """Scale free pressures until the sum of p over its lowest value is `total`; collective."""
    factor, span = 1.0, box.highest - box.lowest
    for _ in range(MAX_PASSES):
        free, held = slab.sum(*_scale_below(p, factor, box.lowest, box.highest))
        if abs(free + held - total) <= max(LOAD_ROUNDING * total, SNAP * span):
            return
        if free <= 0.0 or held >= total:
            break
        factor = (total - held) / free
    if free + held > total:
        _stretch(p, box.lowest, total / (free + held))
    else:
        p += (total - free - held) / (span * slab.points - free - held) * (box.highest - p)


@loop
def _scale_below(p, factor, lowest, highest):
    """Scale each pressure below the highest one, measured from the lowest one. Return the sums of these and of those at
    the highest one."""
    free, held, span = 0.0, 0.0, highest - lowest
    for j in range(p.shape[0]):
        row_free, row_held = 0.0, 0.0
        for i in range(p.shape[1]):
            value = (p[j, i] - lowest) * factor if p[j, i] < highest else span
            value = span if value > (1.0 - SNAP) * span else value
            value = 0.0 if value < SNAP * span else value
            yields = value >= span
            p[j, i] = highest if yields else lowest + value
            row_free += 0.0 if yields else value
            row_held += value if yields else 0.0
        free += row_free
        held += row_held
    return free, held


@loop
def _resolve_bounds(s, h, gamma, lowest, highest, p, reflected):
    """Put `s + gamma h`, limited to the bounds, into p, and `2 p - s` into `reflected`. Return the sum of the
    latter."""
    total = 0.0
    for j in range(s.shape[0]):
        row = 0.0
        for i in range(s.shape[1]):
            value = s[j, i] + gamma * h[j, i]
            value = lowest if value < lowest else value
            p[j, i] = highest if value > highest else value
            reflected[j, i] = 2.0 * p[j, i] - s[j, i]
            row += reflected[j, i]
        total += row
    return total


STEPS = 6  # accuracy: linear pieces in each interval of a table, equal in the logarithm of the pressure


@dataclass(frozen=True)
class InterfaceLaw:
    """Approach c(p) of the mean planes in an interface under a pressure, the closing: piecewise linear with c(0) = 0,
    and constant beyond the last point.

    `pressures`, shape (n,), rise from 0, and `closings`, of the same shape, do not fall. Both may have any unit.
    """

    pressures: Array
    closings: Array

    @classmethod
    def of_table(cls, pressures: Array, closings: Array) -> "InterfaceLaw":
        """Return the law through the points of a table, shape (n,), n >= 2, of rising positive pressures.

        Between the points c is a monotone cubic in log p (F. N. Fritsch, J. Butland, SIAM J. Sci. Stat. Comput. 5
        (1984) 300). Below the first point c is linear in p with the slope at this point, and c(0) = 0. Raises
        InputError for a table that does not rise.
        """
        if len(pressures) < 2 or pressures[0] <= 0.0 or np.any(np.diff(pressures) <= 0.0):
            raise InputError("an interface law needs two positive pressures or more, which rise")
        if np.any(np.diff(closings) < 0.0):
            raise InputError("an interface law needs closings that do not fall while the pressure rises")
        from scipy.interpolate import PchipInterpolator  # slow to import, and of use to few

        logs = np.log(pressures)
        count = STEPS * (len(logs) - 1) + 1
        fine = np.interp(np.linspace(0, len(logs) - 1, count), np.arange(len(logs)), logs)
        known = PchipInterpolator(logs, closings)
        values = np.maximum.accumulate(known(fine))  # removes rounding errors
        slope = float(known(logs[0], 1))  # dc/d(log p) = p dc/dp, which is c(p) - c(0) below the first point
        return cls(np.concatenate([[0.0], np.exp(fine)]), np.concatenate([[0.0], values - closings[0] + slope]))

    def in_units(self, pressure: float, length: float) -> "InterfaceLaw":
        """Return the law in the given units of pressure and length."""
        return InterfaceLaw(self.pressures / pressure, self.closings / length)

    def closing(self, p: Array) -> Array:
        """Return the approach c(p) of the mean planes, an array of the shape of p."""
        found, pressed = np.zeros(p.shape), p > 0.0
        found[pressed] = np.interp(p[pressed], self.pressures, self.closings)
        return found

    def add_closing(self, u: Array, p: Array) -> Array:
        """Return `u + c(p)`."""
        return u + self.closing(p)

    def touches(self, p: Array) -> Mask:
        """Return p: the surfaces touch where there is pressure."""
        return p

    def project(self, p: Array) -> None:
        """Put negative pressures to 0."""
        np.maximum(p, 0.0, out=p)

    def resolve(self, s: Array, h: Array, gamma: float, p: Array, reflected: Array) -> float:
        """Solve `p + gamma c(p) = s + gamma h` for p >= 0 at each point; see `Constraint.resolve`."""
        sums = self.pressures + gamma * self.closings
        return float(_resolve_closing(s, h, gamma, self.pressures, sums, p, reflected))


@loop
def _resolve_closing(s, h, gamma, pressures, sums, p, reflected):
    """Solve `p + gamma c(p) = s + gamma h` for `p >= 0` where the right side is positive, else p = 0. Put `2 p - s`
    into `reflected` and return its sum. `sums` is `pressures + gamma c` at the points of the law."""
    total, last = 0.0, sums.size - 1
    for j in range(s.shape[0]):
        row = 0.0
        for i in range(s.shape[1]):
            value = s[j, i] + gamma * h[j, i]
            if value <= 0.0:
                found = 0.0
            elif value >= sums[last]:
                found = pressures[last] + value - sums[last]
            else:
                low, high = 0, last
                while high - low > 1:
                    middle = (low + high) // 2
                    if sums[middle] <= value:
                        low = middle
                    else:
                        high = middle
                share = (value - sums[low]) / (sums[high] - sums[low])
                found = pressures[low] + share * (pressures[high] - pressures[low])
            p[j, i] = found
            reflected[j, i] = 2.0 * found - s[j, i]
            row += reflected[j, i]
        total += row
    return total


class Operator(Protocol):
    """Linear operator on maps. `out` may be the map `field` itself. Calls are collective."""

    def apply(self, field: Array, out: Array) -> Array: ...


class Operators(NamedTuple):
    """Operator A of a body on one grid, from pressure to displacement, and a preconditioner K that is close to the
    inverse of A."""

    operator: Operator
    preconditioner: Operator


@dataclass(frozen=True)
class MeanPressure:
    """Load control: the mean of p is given, the rigid approach d is unknown."""

    value: float

    @property
    def mean(self) -> float | None:
        """Return the prescribed mean pressure."""
        return self.value


@dataclass(frozen=True)
class Approach:
    """Displacement control: the rigid approach d is given, the load is unknown."""

    value: float
    mean = None


Control = MeanPressure | Approach


@dataclass(frozen=True)
class Problem:
    """Find a pressure p between the bounds of the `constraint` whose gap `g = A p - h - d` meets the conditions of the
    `constraint`.

    `operator` is A, `preconditioner` is K, which is close to the inverse of A, and `heights` is the map h. `control`
    gives the mean of p or the approach d.
    """

    operator: Operator
    preconditioner: Operator
    heights: Array
    constraint: Box
    control: Control


@dataclass(frozen=True)
class Contact:
    """Result of a solve that has converged or was given up. Maps have the shape (rows of this rank, nx).

    `p` is the array that was passed as the start. `u = A p` is an array of the solver, overwritten by the next solve.
    `d` is the approach, and `certificate` has the errors of p. `failure` is empty, or states why the tolerance was not
    reached.
    """

    p: Array
    u: Array
    d: float
    certificate: Certificate
    iterations: int
    failure: str

    @property
    def converged(self) -> bool:
        return not self.failure


VERY_LOOSE = 1e-3  # accuracy: least tolerance on a certificate with displacements in single precision
ROUNDINGS = 4.0  # accuracy: least certificate that is surely reached, over the relative rounding of the largest length
LOOSE = 1e-5  # accuracy: least tolerance on a certificate with directions in single precision


def precision_of_directions(tolerance: float, loose: float = LOOSE) -> type[np.floating]:
    """Return the floating-point type of search directions: single precision if the `tolerance` of the solver is at
    least `loose`, else double precision."""
    return np.float32 if tolerance >= loose else np.float64


def reachable_certificate(slab: Slab, lengths: Sequence[Array], p: Array, compliance: float, length: float) -> float:
    """Return the smallest error of a solve that can be stated because of rounding, with gaps divided by `length`;
    collective.

    `lengths` are maps of heights and of displacements. `compliance` is the largest displacement per pressure: a
    rounding error of p displaces the body by at most `compliance` times this error.
    """
    sizes = slab.reduce((), [float(np.abs(each).max(initial=0.0)) for each in (*lengths, p)])
    sizes[-1] *= compliance
    return ROUNDINGS * float(np.finfo(lengths[0].dtype).eps) * max(sizes) / length


class Workspace:
    """The maps that all solvers of a run share: a pressure, two displacements, a search direction, and the working set
    with one byte per point.

    A solve overwrites all maps and leaves `A p` in `displacement`, valid until the next solve. The attributes must be
    read anew at each use, since a solve may swap or replace the maps.

    Parameters:

    * tolerance: smallest tolerance of the solves, from which the type of directions follows;
    * kept: type in which displacements are stored; single precision if the operator works in single precision.
    """

    def __init__(self, slab: Slab, tolerance: float, kept: type[np.floating] = np.float64) -> None:
        self.slab = slab
        self.pressure = slab.zeros()
        self.displacement, self.other_displacement = slab.zeros(kept), slab.zeros(kept)
        self.direction = slab.zeros(precision_of_directions(tolerance))
        self.working: NDArray[Any] = slab.zeros(np.bool_)

    def swap_displacements(self) -> None:
        self.displacement, self.other_displacement = self.other_displacement, self.displacement

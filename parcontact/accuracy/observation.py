"""Input of the error budget: properties of a run, and observations of a step or of a steady state.

Spots of contact are taken as round. With S cell sides between points in contact and others, on n points of which a
share A touches, their mean radius in cells is

    r = (8/pi) min(A, 1 - A) n/S,

or the radius of the gaps between them if these are smaller. Contacts of waves, cylinders and flats are identical: they
have the same position on the grid and count as one.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from ..job import Cylinder, Flat, Job, Rough, Wave
from ..physics.measures import excess_of
from ..physics.prony import Prony

REGULAR = Cylinder | Wave | Flat  # shapes whose contacts are identical
ROUND = 8.0 / math.pi  # physics: radius of a round spot [cells] over the ratio of its cells to sides on its edge
MANY_RADIUS = 0.7  # accuracy: least resolved radius or half width [cells] of many spots: more than single cells
ONE_RADIUS = 1.3  # accuracy: the same of one spot, and of identical ones: more than five cells, or strips two wide
SPOTS_POWER = 0.25  # accuracy: power of the number of spots by which the error of their mean falls
Vector = tuple[float, float]


@dataclass(frozen=True)
class RunProperties:
    """Properties of a run that are known before it starts.

    `points` of the grid; `cell`: its sides [m]; `cells_per_wave`: longer sides of a cell per shortest wave of a
    rough surface, or None; `measured`: the surface has a map, which may lack waves on a coarse grid;
    `edges_follow_grid`: edges of contact follow it; `identical_contacts`: as those of waves; `free`: the box is
    free; `prony`: relaxation function, None for an elastic body; `folded`: bound on the error of folded branches;
    `exponential`: the integrator is exponential.
    """

    points: int
    cell: Vector = (1.0, 1.0)
    cells_per_wave: float | None = None
    measured: bool = False
    edges_follow_grid: bool = False
    identical_contacts: bool = False
    free: bool = False
    prony: Prony | None = None
    folded: float = 0.0
    exponential: bool = True

    @cached_property
    def mean_cell(self) -> float:
        """Mean of the sides of a cell, the unit of the radii of spots."""
        return 0.5 * (self.cell[0] + self.cell[1])

    @cached_property
    def excess(self) -> float:
        """Excess cells of the contact area per side of a cell on its edge."""
        return excess_of(*self.cell, self.edges_follow_grid)


@dataclass(frozen=True)
class StepObservation:
    """Observation of a step, or of a steady state.

    `complementarity` of the certificate; `penetrating`: points that penetrate without pressure, as a share of those
    in contact; `slope`: rms slope of the surface under the pressure; `friction`, and the part of an `interface`;
    `area`, counted, and `corrected`, as shares; `spared`: the correction not made at points on the edge that have
    yielded; `friction_mismatch`: difference of friction by the slopes of the rigid surface and of the body; `way`:
    direction of sliding, (0, 0) at rest.

    For steps also: `difference` of the embedded pair, and its `order`; cells (of mean sides) `slid` in `seconds`;
    the `angle` of the pair; `curved`: the displacement is quadratic in time; the `change` of friction since the step
    before, infinite after a jump; `own_error`: error by the length of the step that a body without branches
    states; `uneven`: largest minus mean pressure over the mean, at most 1.
    """

    complementarity: float
    friction: float
    area: float
    corrected: float
    slope: float = 0.0
    interface: float = 0.0
    penetrating: float = 0.0
    spared: float = 0.0
    friction_mismatch: float = 0.0
    way: Vector = (0.0, 0.0)
    difference: float = 0.0
    order: float = 2.0
    slid: float = 0.0
    seconds: float = 0.0
    angle: float = 0.0
    curved: bool = False
    change: float = 0.0
    own_error: float | None = None
    uneven: float = 1.0

    @cached_property
    def body(self) -> float:
        """Magnitude of the friction of the body."""
        return abs(self.friction - self.interface)

    @cached_property
    def correction(self) -> float:
        """The counted minus the corrected area, over the latter."""
        return (self.area - self.corrected) / self.corrected if self.corrected > 0.0 else 0.0


def properties_of(job: Job, shortest: float | None, folded: float = 0.0, prony: Prony | None = None) -> RunProperties:
    """Return the properties of a job: `shortest` is the shortest wave of its map [m], `folded` the bound on the error
    of its folded branches, and `prony` its relaxation function."""
    waves = [shape.short_wavelength for shape in job.surface if isinstance(shape, Rough)]
    waves += [shortest] if shortest is not None else []
    (nx, ny), (dx, dy) = job.grid.points, (job.grid.dx, job.grid.dy)
    cell = (dx if nx > 1 else dy, dy if ny > 1 else dx)  # a line of points has one direction
    line = 1 in job.grid.points
    return RunProperties(
        points=nx * ny,
        cell=cell,
        cells_per_wave=min(waves) / max(cell) if waves else None,
        measured=shortest is not None,
        edges_follow_grid=line or _ridges(job.surface),
        identical_contacts=line or all(isinstance(shape, REGULAR) for shape in job.surface),
        free=job.grid.boundary == "free",
        prony=prony,
        folded=folded,
        exponential=job.numerics.integrator != "backward-euler",
    )


def _ridges(shapes: Sequence[Any]) -> bool:
    """Return whether the surface consists of cylinders and waves along one axis of the grid; edges of contact then
    follow it."""
    across = {"y" if shape.axis == "x" else "x" for shape in shapes if isinstance(shape, Cylinder)}
    waves = [shape.waves for shape in shapes if isinstance(shape, Wave)]
    across |= {axis for x, y in waves for axis, count in (("x", x), ("y", y)) if count}
    return len(across) == 1 and all(isinstance(shape, REGULAR) for shape in shapes)


def radius_of(run: RunProperties, observed: StepObservation) -> float:
    """Return the radius of round spots of contact, or of smaller gaps between them, in cells of mean sides; half the
    width of straight ones; infinite without edges."""
    sides = (observed.area - observed.corrected + observed.spared) * run.points / run.excess
    if sides <= 0.0:
        return math.inf
    radius = ROUND * min(observed.area, 1.0 - observed.area) * run.points / sides
    return radius / ROUND if run.edges_follow_grid else radius


def count_spots(run: RunProperties, observed: StepObservation) -> float:
    """Return the number of spots of contact, or of smaller gaps between them; 1 for identical contacts; in full contact
    the number of half waves of the shortest length."""
    radius, share = radius_of(run, observed), min(observed.area, 1.0 - observed.area)
    if run.identical_contacts:
        return 1.0
    if run.cells_per_wave is not None:
        share = share if radius < math.inf else observed.area
        radius = min(radius, 0.5 * run.cells_per_wave * (max(run.cell) / run.mean_cell))
    one = math.pi * radius**2 * run.mean_cell**2 / (run.cell[0] * run.cell[1])
    return max(1.0, share * run.points / one) if one > 0.0 else 1.0


def resolves(run: RunProperties, observed: StepObservation) -> bool:
    """Return False if the true spots of contact may be smaller than a cell, so that no error of their area is known.
    Errors of many spots average out, except for single cells."""
    if not 0.0 < observed.area < 0.5:
        return True
    return radius_of(run, observed) >= (ONE_RADIUS if count_spots(run, observed) < 2.0 else MANY_RADIUS)


def mean_over_spots(run: RunProperties, observed: StepObservation) -> float:
    """Return the factor by which the error of the mean over all spots is smaller than that of one spot."""
    return count_spots(run, observed) ** -SPOTS_POWER


def cell_along(run: RunProperties, way: Vector) -> float:
    """Return the length of cells along a direction, in the unit of `run.cell`; the longer side at rest."""
    (dx, dy), (x, y) = run.cell, way
    length = math.hypot(x, y)
    return math.hypot(x * dx, y * dy) / length if length else max(dx, dy)

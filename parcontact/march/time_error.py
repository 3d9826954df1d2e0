"""The error of time steps, and its input: properties of a run, and observations of a step or of a steady state.

Spots of contact are taken as round. With S cell sides between points in contact and others, on n points of which a
share A touches, their mean radius in cells is

    r = (8/pi) min(A, 1 - A) n/S.

If the gaps between the spots have the smaller area, r is the radius of the gaps. Contacts of waves, cylinders and flats
are identical: they have the same position on the grid and count as one.

The error of friction by the length of a time step is estimated by a formula and by the embedded pair.

**Formula.** A linear step takes the displacement as linear in time. In a step a harmonic wave turns by an angle theta.
The force of a branch with z = dt/tau then has an error, which is theta^2/12 of the loss of a slow branch and theta^2/6
of the loss of a fast branch. The force is also delayed by L/2 of a step,

    L(z) = coth(z/2) - 2/z,      z/6 for small z, 1 for large z.

In full contact friction is the loss, with the error theta^2 (1 + <L>)/12. Here <L> = sum w L/sum w is a mean over the
branches, whose weights w = G omega tau/(1 + (omega tau)^2) are their shares of friction. theta is measured as the rms
change of the displacement divided by the standard deviation of the heights, which is the angle for a single wave.
Shorter waves turn further and contribute more to friction: the error of many waves is MANY_WAVES times as large.

If only spots of radius a are in contact, delayed forces move their edges. With x = (distance of the step)/a the error
is

    E = LINEAR_PASSING (1 - A^4) x (<L> + PASSING_LOSS x),      omega = x/dt.

A quadratic step also follows the bend of the motion. In full contact the relative error of the loss is then k theta^2
<L> + theta^4/75, with k from 0.25 to 0.33 (`prony.discrete_modulus`), and again MANY_WAVES times as large for many
waves. Edges of contact cause an error of third order, PASSING x^3.

**Embedded pair.** The pair (`controller`) also shows jumps, changes of load, and creep. The estimate for a quadratic
step is its difference to a linear step. The estimate for a linear step follows from its difference to backward Euler.
This difference is of second order in dt if all branches are slow, and of first order if some branches are fast; the
accumulated error of linear steps has the order 1.7. For steps of backward Euler, whose error is of first order, the
estimate varies as the root of this difference.

While the surface slides, the estimate is that of the formula, but at least PAIR_SHARE times that of the pair, which
also shows errors that edges do not cause. At rest the estimate is that of the pair.

If friction changes from step to step, it is delayed. The error is at most <L> times the change of friction, and
CURVED_RISE <L> times the change in quadratic steps (`error_of_rise`). Right after a jump of the load friction is 0 up
to mesh errors, as for an elastic body, so that the next change is unknown. The error of the area is a fraction of the
error of friction; the fraction becomes smaller as the share of the box that is not in contact falls.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..job import Cone, Cylinder, Flat, Job, Punch, Pyramid, Rough, Sphere, Wave
from ..physics.prony import Prony, complex_modulus
from ..physics.records import excess_of


@dataclass(frozen=True)
class Fit:
    """A fitted constant. `order` is the power with which the error falls on refinement.

    `found_by` is the script or test that compares the constant with true errors. `scatter` states the ratio of estimate
    to true error: the median and the range of 90 % of the cases, as far as known. Ratios for friction and area belong
    to the sum of all sources of error. Ratios for the solver belong to the error of the solver alone. The manual's page
    `coverage` shows how well all constants hold.
    """

    name: str
    value: float
    order: float
    found_by: str
    scatter: str


MARCHES, RISES = "scripts/march_errors.py", "tests/scenarios/test_viscoelastic.py"
PASSING = Fit(
    "quadratic step: times the cube of the way over the radius of spots",
    0.4,
    3.0,
    MARCHES,
    "2.6 in two cells, 1.5 in one",
)
MANY_WAVES = Fit("steps in full contact: error of many waves over that of one", 1.5, 0.0, MARCHES, "1.2, linear")
PAIR_SHARE = Fit("steps in a slide: of the error that the pair shows, at least", 0.3, 1.0, MARCHES, "as PASSING")
CURVED_RISE = Fit("quadratic step: times <L> of a change of friction", 0.5, 1.0, RISES, "0.7 to 4")
LINEAR_PASSING = Fit("linear step: times the way over the radius of spots, and <L>", 0.66, 1.0, MARCHES, "0.8 to 1")
LINEAR_PAIR = Fit("linear step: times the difference of the pair", 1.7, 1.7, MARCHES, "as LINEAR_PASSING")
EQUAL_DIFFERENCE = Fit(
    "linear pair at which many branches are no worse than one", 0.0072, 0.0, MARCHES, "as LINEAR_PAIR"
)
EULER = Fit("backward Euler: times a power of the difference of the pair", 1.1, 0.5, MARCHES, "0.8 to 1.7")
TIME_AREA = Fit(
    "area: of the error of friction, times a power of what is open",
    0.21,
    1.0 / 3.0,
    MARCHES,
    "2.9 in two cells, 0.4 in one",
)
EULER_AREA = Fit("area: the same of backward Euler", 0.18, 2.0, MARCHES, "1.1")

REGULAR = Cylinder | Wave | Flat  # shapes whose contacts are identical
SPOTS = Sphere | Cone | Pyramid | Punch  # shapes with one spot of contact, symmetric to its centre
NEAR = 0.06  # accuracy: cells by which the centre of a symmetric shape may be off
ROUND = 8.0 / math.pi  # physics: radius of a round spot [cells] over the ratio of its cells to sides on its edge
MANY_RADIUS = 0.7  # accuracy: least resolved radius or half width [cells] of many spots: more than single cells
ONE_RADIUS = 1.3  # accuracy: the same of one spot, and of identical ones: more than five cells, or strips two wide
SPOTS_POWER = 0.25  # fitted: power by which more spots reduce the error of the mean (`scripts/error_coverage.py`)
Vector = tuple[float, float]


@dataclass(frozen=True)
class RunProperties:
    """Properties of a run that are known before it starts.

    * `points`: number of points of the grid;
    * `cell`: sides of a cell [m];
    * `cells_per_wave`: shortest wavelength of a rough surface, divided by the longer side of a cell, or None;
    * `measured`: the surface has a map, which may lack waves on a coarse grid;
    * `edges_follow_grid`: edges of contact are parallel to lines of the grid;
    * `identical_contacts`: all contacts are equal, like the contacts of a single wave;
    * `centre`: centre of the only shape that is not flat, in cells from a point of the grid; None for other surfaces;
    * `cells_slid`: distance that the surface slides in the whole history, in cells;
    * `free`: the box is free;
    * `prony`: relaxation function; None for an elastic body;
    * `folded`: bound on the error of folded branches;
    * `exponential`: the integrator is exponential.
    """

    points: int
    cell: Vector = (1.0, 1.0)
    cells_per_wave: float | None = None
    measured: bool = False
    edges_follow_grid: bool = False
    identical_contacts: bool = False
    centre: Vector | None = None
    cells_slid: float = math.inf
    free: bool = False
    prony: Prony | None = None
    folded: float = 0.0
    exponential: bool = True

    @cached_property
    def mean_cell(self) -> float:
        """Mean of the two sides of a cell [m], the unit of the radii of spots."""
        return 0.5 * (self.cell[0] + self.cell[1])

    @cached_property
    def excess(self) -> float:
        """Excess of the counted contact area, in cells, divided by the number of cell sides on the edge of contact."""
        return excess_of(*self.cell, self.edges_follow_grid)


@dataclass(frozen=True)
class StepObservation:
    """Numbers of a step, or of a steady state, from which errors are estimated.

    * `complementarity`: the error of the solve with this name (`physics.records.Certificate`);
    * `friction`, `interface`: the friction coefficient, and the part of it that the interface causes;
    * `area`, `corrected`: the counted and the corrected contact area, as shares of the box;
    * `slope`: rms slope of the surface, weighted by the pressure;
    * `penetrating`: number of points that penetrate without pressure, divided by the number in contact;
    * `spared`: share of the box left out of the correction of the area, since points on the edge have yielded;
    * `straight`: 1 if all edges of contact follow one axis of the grid, 0 if they follow both axes equally;
    * `friction_mismatch`: friction by the slopes of the rigid surface minus friction by the slopes of the body;
    * `way`: direction of sliding, (0, 0) at rest;
    * `position`: distance of the surface from its first position along x and y, in cells.

    Steps also have:

    * `difference`, `order`, `angle`: results of the embedded pair (`controller.IntegratorDifference`);
    * `slid`, `seconds`: the distance slid in the step, in cells of mean sides, and the length of the step [s];
    * `curved`: True if the displacement is quadratic in time;
    * `change`: friction of the body minus its friction in the step before, infinite after a jump;
    * `own_error`: relative error of the time step, computed by a body that has no branches, or None;
    * `uneven`: (largest - mean)/mean pressure, at most 1.
    """

    complementarity: float
    friction: float
    area: float
    corrected: float
    slope: float = 0.0
    interface: float = 0.0
    penetrating: float = 0.0
    spared: float = 0.0
    straight: float = 0.0
    friction_mismatch: float = 0.0
    way: Vector = (0.0, 0.0)
    position: Vector = (0.0, 0.0)
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
        """The counted area minus the corrected area, divided by the corrected area."""
        return (self.area - self.corrected) / self.corrected if self.corrected > 0.0 else 0.0


def properties_of(job: Job, shortest: float | None, folded: float = 0.0, prony: Prony | None = None) -> RunProperties:
    """Return the properties of a run of a job. `shortest` is the shortest wave [m] of a measured map, or None. `folded`
    is the bound on the error that branches without a map cause. `prony` is the relaxation function of the body, None
    for an elastic body."""
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
        centre=centre_of(job),
        cells_slid=sum(math.hypot(*_over(stage.velocity, cell)) * stage.seconds for stage in job.history),
        free=job.grid.boundary == "free",
        prony=prony,
        folded=folded,
        exponential=job.numerics.integrator != "backward-euler",
    )


def _over(vector: Vector, cell: Vector) -> Vector:
    return vector[0] / cell[0], vector[1] / cell[1]


def centre_of(job: Job) -> Vector | None:
    """Return the centre of the only shape of a surface that is not flat, in cells from a point of the grid; None for
    other surfaces, and for a line of points."""
    shapes = [shape for shape in job.surface if not isinstance(shape, Flat)]
    if job.grid.is_line or len(shapes) != 1 or not isinstance(shapes[0], SPOTS):
        return None
    return _over(shapes[0].center or (job.grid.lx / 2, job.grid.ly / 2), (job.grid.dx, job.grid.dy))


def is_symmetric(centre: Vector | None, position: Vector = (0.0, 0.0)) -> bool:
    """Return True if a shape has the symmetry of the grid: along both axes its centre is on a line of points, or
    halfway between two. `centre` is where the job puts the shape, and `position` the way it has moved since [cells]."""
    if centre is None:
        return False
    halves = (2.0 * (start + moved) for start, moved in zip(centre, position, strict=True))
    return all(abs(half - round(half)) <= 2.0 * NEAR for half in halves)


def _ridges(shapes: Sequence[Any]) -> bool:
    """Return whether the surface consists of cylinders and waves along one axis of the grid; edges of contact then
    follow it."""
    across = {"y" if shape.axis == "x" else "x" for shape in shapes if isinstance(shape, Cylinder)}
    waves = [shape.waves for shape in shapes if isinstance(shape, Wave)]
    across |= {axis for x, y in waves for axis, count in (("x", x), ("y", y)) if count}
    return len(across) == 1 and all(isinstance(shape, REGULAR) for shape in shapes)


def radius_of(run: RunProperties, observed: StepObservation) -> float:
    """Return the mean radius of the spots of contact, or of the gaps between the spots if the gaps have the smaller
    area.

    The unit is the mean side of a cell. If edges follow the grid, the spots or gaps are strips, and the result is half
    their mean width. Without edges of contact the radius is infinite.
    """
    sides = (observed.area - observed.corrected + observed.spared) * run.points / run.excess
    if sides <= 0.0:
        return math.inf
    radius = ROUND * min(observed.area, 1.0 - observed.area) * run.points / sides
    return radius / ROUND if run.edges_follow_grid else radius


def count_spots(run: RunProperties, observed: StepObservation) -> float:
    """Return the number of spots of contact, or of the gaps between the spots if the gaps have the smaller area. In
    full contact, return the number of half waves of the shortest length in the box. Identical contacts count as 1."""
    radius, share = radius_of(run, observed), min(observed.area, 1.0 - observed.area)
    if run.identical_contacts:
        return 1.0
    if run.cells_per_wave is not None:
        share = share if radius < math.inf else observed.area
        radius = min(radius, 0.5 * run.cells_per_wave * (max(run.cell) / run.mean_cell))
    one = math.pi * radius**2 * run.mean_cell**2 / (run.cell[0] * run.cell[1])
    return max(1.0, share * run.points / one) if one > 0.0 else 1.0


def resolves(run: RunProperties, observed: StepObservation) -> bool:
    """Return False if the true spots of contact may be smaller than a cell, so that the error of the contact area is
    unknown.

    A single spot must have a radius of ONE_RADIUS cells or more to be resolved. The mean radius of many spots may be as
    small as MANY_RADIUS cells, since the errors of many spots average out. Contacts of half of the box or more are
    always resolved.
    """
    if not 0.0 < observed.area < 0.5:
        return True
    return radius_of(run, observed) >= (ONE_RADIUS if count_spots(run, observed) < 2.0 else MANY_RADIUS)


def mean_over_spots(run: RunProperties, observed: StepObservation) -> float:
    """Return the error of the mean over all spots, divided by the error of one spot."""
    return count_spots(run, observed) ** -SPOTS_POWER


def cell_along(run: RunProperties, way: Vector) -> float:
    """Return the length of a cell along the direction `way`, in the unit of `run.cell`. At rest, return the longer side
    of a cell."""
    (dx, dy), (x, y) = run.cell, way
    length = math.hypot(x, y)
    return math.hypot(x * dx, y * dy) / length if length else max(dx, dy)


PASSING_LOSS = 0.19  # fitted: relative error of the loss in a linear step over x (`scripts/march_errors.py`)
SLOW = 1e-3  # rounding: z below which L is computed by its series
LEAST_POWER = 0.25  # fitted: least difference of the orders of error and of a linear pair (`scripts/march_errors.py`)
FULL_POWER = 4  # fitted: power of the area that weights the error in full contact (`scripts/march_errors.py`)
FIXED_EDGES = 0.9  # fitted: share of the error of a linear pair that edges cause (`scripts/march_errors.py`)


def time_error(run: RunProperties, observed: StepObservation) -> float:
    """Return the relative error of friction by the length of a time step, also at rest; at most 1."""
    if observed.own_error is not None:
        return observed.own_error
    if not run.exponential:
        return EULER.value * observed.difference**EULER.order
    pair = _error_by_pair(observed)
    if not observed.slid or run.prony is None:
        return pair
    full, late = observed.area**FULL_POWER, _late(run.prony, observed.angle, observed.seconds)
    x, angle = _share_passed(run, observed), observed.angle
    if observed.curved:
        passing, turning = PASSING.value * x**3, 0.3 * late * angle**2 + angle**4 / 75.0
        least = PAIR_SHARE.value
    else:
        passing = LINEAR_PASSING.value * x * (_late(run.prony, x, observed.seconds) + PASSING_LOSS * x)
        turning = angle**2 * (1.0 + late) / 12.0
        least = full + (1.0 - full) * PAIR_SHARE.value
    return min(1.0, max((1.0 - full) * passing + full * MANY_WAVES.value * turning, least * pair))


def _error_by_pair(observed: StepObservation) -> float:
    """Return the error by the embedded pair. For linear steps it has the order LINEAR_PAIR.order, the difference
    `order`."""
    if observed.curved:
        return observed.difference
    power = max(LEAST_POWER, LINEAR_PAIR.order / max(observed.order, 1.0) - 1.0)
    fixed = 1.0 - FIXED_EDGES * observed.area**2
    more = (observed.difference / EQUAL_DIFFERENCE.value) ** power
    return min(1.0, fixed * LINEAR_PAIR.value * observed.difference * more)


def error_of_rise(run: RunProperties, observed: StepObservation) -> float:
    """Return the relative error of friction that a change of friction since the step before causes, such as a rise
    after rest. Friction is delayed by <L> of a step. After a jump the change is unknown. It is then estimated as the
    product of the rms slope of the surface, the sine of the body's loss angle, and `uneven`."""
    if run.prony is None or not run.exponential or not observed.slid or observed.body <= 0.0:
        return 0.0
    x = max(_share_passed(run, observed), observed.angle)
    if x == 0.0:
        return 0.0
    change = observed.change
    if math.isinf(change):
        modulus = complex_modulus(np.array(x / observed.seconds), *run.prony)
        change = observed.uneven * observed.slope * float(modulus.imag / abs(modulus))
    late = _late(run.prony, x, observed.seconds) * (CURVED_RISE.value if observed.curved else 1.0)
    return late * abs(change) / observed.body


def share_of_area(run: RunProperties, observed: StepObservation) -> float:
    """Return the error of the area by the time steps, divided by the error of friction by the time steps."""
    open_share = 1.0 - observed.area
    if run.exponential:
        return TIME_AREA.value * open_share**TIME_AREA.order
    return EULER_AREA.value * open_share**EULER_AREA.order + observed.correction


def order_of_time_error(integrator: str, curved: bool) -> float:
    """Return the power of the step length with which the time error grows. `curved` is True if the displacement is
    quadratic in time."""
    if integrator == "backward-euler":
        return 1.0
    return PASSING.order if integrator == "exponential" and curved else LINEAR_PAIR.order


def _share_passed(run: RunProperties, observed: StepObservation) -> float:
    """Return the distance slid in a step over the radius of spots."""
    radius = radius_of(run, observed)
    return observed.slid / radius if radius > 0.0 else 0.0


def _late(prony: Prony, angle: float, seconds: float) -> float:
    """Return the delay of forces over half a step, <L>, averaged over the branches that cause friction."""
    z = seconds / prony.relaxation_times
    slow = np.maximum(z, SLOW)
    late = np.where(z > SLOW, 1.0 / np.tanh(0.5 * slow) - 2.0 / slow, z / 6.0)
    lost = prony.moduli * angle * z / (z**2 + angle**2)
    total = float(lost.sum())
    return float((lost * late).sum()) / total if total > 0.0 else 0.0

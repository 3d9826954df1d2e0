"""How wrong friction and the contact area are by the mesh, part of the error budget (`budget`), from what a step shows.

Friction is wrong by the cells along the sliding, and little by those across it: of c and c' cells per shortest wave

    ALONG (4/c)^p + ACROSS (4/c')^p,      p = 2.5,

and of the cells per radius of the spots of contact in the same proportion, with p = 2.3. Spots are small under small
loads whatever the waves; many of them average it out, and where little is open there are few edges. On squares the two
add up to what was found there by experiment; the share of those across is from 16 meshes of ten surfaces
(`job.checks.cells`). The corrected area is wrong by a share of its correction, by each direction as its cells are long,
and by chance, as spots lie on the grid: the area of a spot with a radius of r cells by 0.25 r^-1.6, the standard
deviation of 860 spheres of 4 to 32 cells from Hertz's theory, and that of many by less, as chance averages out.

In steady sliding friction by energy has BY_ENERGY_WAVES of what waves make. A rough surface has all of its waves on any
grid, and in full contact each has its loss: there it goes with the root of what is open, of one cell at least. Of 180
other states with 2 to 4 cells per shortest wave, or with half to full contact, 99 % have an estimate of half of the
error at least, 0.4 in the worst. A map may lack waves on another grid than its own: in full contact friction is then
wrong by 2 % at 2 to 4 cells per shortest wave, and by 5 to 40 % below 2. So all of it counts below 3 cells.

Edges of contact lose power in waves that are shorter than the cells, too: `edge_loss` says how much. Where a body
relaxes before the surface has slid by a cell, this is most of the error, and it falls with the first power of the cell
only. Friction by energy lacks it, and the two views of friction differ by it, but where they happen to agree.
"""

import math

from .edge_loss import lost_in_short_waves
from .time_error import RunProperties, StepObservation, Vector, count_spots, radius_of, spot_radius

# accuracy: these constants are fitted to true errors, as the text above says
WAVES_FRICTION, WAVES_ORDER = 0.05, 2.5  # at 4 cells per shortest wave
BY_ENERGY_WAVES = 0.2  # of that, in steady sliding
FEW_WAVES = 6.0  # power of 4 cells over those of the shortest wave of a map, with which that share rises to all of it
SPOTS_FRICTION, SPOTS_ORDER = 0.13, 2.3  # at a contact spot of a radius of one cell
SPOTS_POWER = 0.25  # of the number of spots, by which they average errors out
LOST, FREE_LOST = 2.0, 6.0  # times s m^k of `edge_loss`; of steady sliding in free boxes, with sampled coefficients
GAPS = 2.0  # times what is open, in steady sliding: from half contact on radii are those of gaps, with fewer edges
STEADY_POWER, MARCH_POWER = 1.0, 2.0  # k; in marches the cells per wave make enough of what is fast
STRAIGHT_POWER = 0.5  # k along edges that follow the grid, which move by whole cells
ACROSS = 0.06  # of these errors, on squares: that of the cells across the sliding
EDGES, STRAIGHT_EDGES = 0.25, 3.0  # of the correction of the area; along edges that follow the grid
SMALL_SPOTS = 0.6  # of the square of the correction, which is large where spots of contact are a few cells wide
CHANCE, CHANCE_POWER = 0.25, 1.6  # of the area of a round spot at a place by chance, over the radius in cells


def friction_by_mesh(run: RunProperties, observed: StepObservation, points: int, steady: bool) -> tuple[float, float]:
    """Return the relative errors of friction by the cells along the sliding and across it; at rest all of it by the
    longer ones, which is said to be along. Of what waves make, `steady` sliding has a share."""
    share = _share_of_waves(run, observed, points) if steady else 1.0
    cells = cells_along_and_across(run, observed.way)
    if not any(observed.way):
        return share * _by_waves(run, cells[0]) + _by_spots(run, observed, points, cells[0]), 0.0
    along, across = (share * _by_waves(run, cell) + _by_spots(run, observed, points, cell) for cell in cells)
    return (1.0 - ACROSS) * along, ACROSS * across


def lost_at_edges(run: RunProperties, observed: StepObservation, points: int, steady: bool) -> float:
    """Return the share of friction that edges of contact lose in waves shorter than the cells along the sliding, at
    most; 0 at rest, and of an elastic body."""
    if run.prony is None or not any(observed.way):
        return 0.0
    cell = cells_along_and_across(run, observed.way)[0]
    size = radius_of(run, observed, points) * (run.mean_cell / cell)
    share, slow = lost_in_short_waves(run.prony, size, math.hypot(*observed.way) / cell, run.straight)
    power = STRAIGHT_POWER if run.straight else STEADY_POWER if steady else MARCH_POWER
    few = min(1.0, GAPS * (1.0 - observed.area)) if steady else 1.0 - observed.area
    return min(1.0, (FREE_LOST if run.free and steady else LOST) * few * share * slow**power)


def area_by_mesh(run: RunProperties, observed: StepObservation, points: int) -> tuple[float, float]:
    """Return the same of the corrected area, which is counted in cells."""
    error = STRAIGHT_EDGES * observed.correction
    if not run.straight:
        error = EDGES * observed.correction + SMALL_SPOTS * observed.correction**2 + _by_chance(run, observed, points)
    error = max(error, 1.0 / (points * observed.area)) if observed.area > 0.0 else error
    along, across = cells_along_and_across(run, observed.way)
    return (error * along / (along + across), error * across / (along + across)) if any(observed.way) else (error, 0.0)


def _by_chance(run: RunProperties, observed: StepObservation, points: int) -> float:
    """Return the error of the area that comes from where spots, or the gaps between them, lie on the grid."""
    radius, smaller = spot_radius(run, observed, points), min(observed.area, 1.0 - observed.area)
    if not 0.0 < radius < math.inf:
        return 0.0
    count = max(1.0, smaller * points * run.cells / (math.pi * radius**2))
    return min(1.0, CHANCE / radius**CHANCE_POWER) / count**0.5 * smaller / observed.area


def cells_along_and_across(run: RunProperties, way: Vector) -> tuple[float, float]:
    """Return the lengths of cells along a way and across it, in the unit of `run.cell`; at rest the longer one."""
    (dx, dy), (x, y) = run.cell, way
    length = math.hypot(x, y)
    if not length:
        return max(dx, dy), max(dx, dy)
    return math.hypot(x * dx, y * dy) / length, math.hypot(y * dx, x * dy) / length


def _share_of_waves(run: RunProperties, observed: StepObservation, points: int) -> float:
    """Return the share of what waves make that counts in steady sliding."""
    if not run.measured:
        return BY_ENERGY_WAVES * math.sqrt(max(1.0 - observed.area, 1.0 / points))
    return min(max(1.0, 4.0 / (run.cells_per_wave or 4.0)) ** FEW_WAVES * BY_ENERGY_WAVES, 1.0)


def _by_waves(run: RunProperties, cell: float) -> float:
    """Return the error of friction on squares of cells of this length, by the shortest wave."""
    if run.cells_per_wave is None:
        return 0.0
    return WAVES_FRICTION * (4.0 * (cell / max(run.cell)) / run.cells_per_wave) ** WAVES_ORDER


def _by_spots(run: RunProperties, observed: StepObservation, points: int, cell: float) -> float:
    """Return the same by the radius of the spots of contact."""
    radius = spot_radius(run, observed, points) * (run.mean_cell / cell)
    one = min(1.0, SPOTS_FRICTION / radius**SPOTS_ORDER) if radius > 0.0 else 0.0
    return (1.0 - observed.area) * one / count_spots(run, observed, points) ** SPOTS_POWER

"""Measures of one instant of a contact; the module loads nothing, so that tables are read at once."""

import math
from dataclasses import astuple, dataclass

LONG_CELLS = 0.1  # power of the ratio of the sides of a cell, by which a side has less in excess: see `excess_of`
SIDE = (math.pi - 1.0 + math.log(2.0)) / 24.0  # physics: cells in excess per side of a cell on the edge of contact


def excess_of(dx: float, dy: float, edges_follow_grid: bool = False) -> float:
    """Return how many cells are in excess per side on the edge of contact, of cells with these sides.

    On squares it is SIDE. Where cells are long edges of contact are rather along their longer sides, and fewer cells
    are in excess: with sides of 4 : 1 0.80 of it where the surface slides along the shorter ones, 0.91 of elastic
    bodies at rest; with 8 : 1 0.70 and 0.86 (14 rough surfaces of 2 to 91 % contact, against meshes up to eight times
    as fine). The power LONG_CELLS of the ratio is between both. Edges that are `straight` along the grid have none of
    this.
    """
    return SIDE if edges_follow_grid else SIDE * (min(dx, dy) / max(dx, dy)) ** LONG_CELLS


@dataclass(frozen=True)
class Measures:
    """One instant: pressures [Pa], forces [N] on the rigid surface, lengths [m]; area as a share of the nominal.

    `contact_area` counts the points with pressure; `contact_area_corrected` takes off what that counts too many along
    the edges of contact. It holds in the mean over edges in all directions that are smooth on the scale of a cell:
    spheres and rough surfaces whose shortest wave has 4 cells or more. The edge of the box is no edge of contact.
    `spared` is the share by which less is taken off, as points on the edge have yielded.
    `at_edge` says that an isolated contact reaches it. Forces and `friction` hold what an interface adds, which is
    `force_interface`, against the sliding, and `friction_interface`. Friction is 0 where no load presses.
    """

    pressure: float = 0.0
    force_x: float = 0.0
    force_y: float = 0.0
    friction: float = 0.0
    contact_area: float = 0.0
    approach: float = 0.0
    mean_gap: float = 0.0
    max_pressure: float = 0.0
    contact_area_corrected: float = 0.0
    at_edge: bool = False
    normal_force: float = 0.0
    friction_interface: float = 0.0
    force_interface: float = 0.0
    spared: float = 0.0

    @property
    def finite(self) -> bool:
        return all(map(math.isfinite, astuple(self)))

    @property
    def friction_x(self) -> float:
        """Tangential over normal force along x, positive where it opposes motion along +x: `-force_x/normal force`.

        Unlike `friction` it changes its sign with the direction of sliding; 0 at zero load.
        """
        force = math.hypot(self.force_x, self.force_y)
        return 0.0 - self.friction * (self.force_x / force) if force > 0.0 else 0.0

"""How well a contact is solved, in numbers; it loads nothing, so that tables are read at once."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Certificate:
    """How well a returned pressure meets the contact conditions, all computed from it.

    complementarity: `sum(p |g|) / sum(p)`, the gap where there is pressure, weighted by it, over the `length`;
    penetration: `max(-g, 0)` over all points, over the `length`;
    load: `|mean(p)/P0 - 1|` (0 with a given approach);
    members: points with pressure or penetration, as a share of all;
    length: by how much the displacement u varies within the contact, its standard deviation there, weighted by the
    pressure,

        L^2 = <p, u^2>/<p> - (<p, u>/<p>)^2,

    and at least LEAST_SHARE of the mean `<p, u>/<p>`, for contacts of a point or two, but at most the height of the
    surface. Unlike that height it belongs to the contact, not to the box: for a sphere it is 0.13 of the approach, in
    full contact the rms height.
    Of the lengths tried (the surface's height, `<p, u>/<p>`, `<p, u^2>/<p>`) it tells the most of the error: over a
    sphere, a cylinder, rough surfaces from 0.4 % to full contact, starts and jumps of velocity, the relative error of
    the contact area is 0.9 times the complementarity, to a factor of 2.2 (one standard deviation), and that of friction
    0.6 times, to a factor of 3.5; more where friction is far less than the slopes that make it, up to 9 times. A solve
    ends with a complementarity of a fifth to a half of the tolerance. So with the tolerance 5e-3 areas and friction are
    wrong by 1e-3 or less as a rule, and by 1e-2 at most.
    """

    complementarity: float
    penetration: float
    load: float
    length: float = math.nan
    members: float = 0.0

    @property
    def worst(self) -> float:
        total = self.complementarity + self.penetration + self.load
        return total if math.isnan(total) else max(self.complementarity, self.penetration, self.load)

"""Errors of a solved contact. This module imports no other, so that tables are read quickly."""

import math
from dataclasses import dataclass, replace
from functools import cached_property


@dataclass(frozen=True)
class Certificate:
    """Errors of a returned pressure, all computed from it and without unit.

    * complementarity: `sum(p |g|)/(L sum(p))`;
    * penetration: `max(-g, 0)/L` over all points;
    * load: `|mean(p)/P0 - 1|`, 0 under a given approach;
    * members: share of points with pressure or penetration;
    * length: L, the standard deviation of the displacement u in the contact, weighted by the pressure,

        L^2 = <p, u^2>/<p> - (<p, u>/<p>)^2,

    at least LEAST_SHARE of the mean `<p, u>/<p>`, for contacts of one or two points, and at most the height of the
    surface. It does not depend on the size of the box. In steady sliding along lines of points, waves that do not vary
    along the lines may have a far lower modulus, and most of the displacement (`iterate.Lines`).
    """

    complementarity: float
    penetration: float
    load: float
    length: float = math.nan
    members: float = 0.0

    @cached_property
    def worst(self) -> float:
        total = self.complementarity + self.penetration + self.load
        return total if math.isnan(total) else max(self.complementarity, self.penetration, self.load)

    def shortened(self, share: float) -> "Certificate":
        """Return the certificate with gaps over `share` times the length."""
        gaps = self.complementarity / share, self.penetration / share
        return replace(self, complementarity=gaps[0], penetration=gaps[1], length=share * self.length)

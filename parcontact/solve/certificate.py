"""How well a contact is solved, in numbers; it loads nothing, so that tables are read at once."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Certificate:
    """How well a returned pressure meets the contact conditions, all three computed from it.

    complementarity: `sum(p |g|) / sum(p)`, the gap where there is pressure, weighted by it, over the surface's height;
    penetration: `max(-g, 0)` over all points, over the surface's height;
    load: `|mean(p)/P0 - 1|` (0 with a given approach).
    """

    complementarity: float
    penetration: float
    load: float

    @property
    def worst(self) -> float:
        total = self.complementarity + self.penetration + self.load
        return total if math.isnan(total) else max(self.complementarity, self.penetration, self.load)

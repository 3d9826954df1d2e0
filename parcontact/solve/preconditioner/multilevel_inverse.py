"""An inverse of a stiffness K without transforms: sums over cells of all lengths, each times how soft its waves are.

With I_l the linear interpolation from cells of 2^l points a side to points, and a wave of length 2 a yielding A(a),

    M = sum_l w_l I_l I_l',    w_l = CELLS (A(a_l) - A(a_(l-1)))/n_l,    w_0 = POINTS A(a_0),

for cells of the length a_l and of n_l points (J. H. Bramble, J. E. Pasciak, J. Xu, Math. Comp. 55 (1990) 1). A wave
that is much longer than cells passes I_l' and I_l times n_l; one that is shorter hardly passes. So M makes of each wave
what A makes of it, to about a factor of two. It costs far less than a transform, and conjugate gradients over gaps take
hardly more iterations than with A itself. Maps of cells are in single precision: enough for a preconditioner.
"""

import math
from collections.abc import Callable

import numpy as np

from ...parallel.slab import Array, Slab
from .extension import pairs_for
from .levels import cell_levels, interpolate, interpolate_back

Compliance = Callable[[Array], Array]  # displacement over pressure of waves, over their wavenumbers
POINTS, CELLS = 1.5, 2.5  # tuning: with them M is near A: most waves yield 0.9 to 1.5 of what they should
SQUARE = 1.5  # tuning: longest side over the shortest, of cells that count as square
STIFFER = 0.1  # tuning: of the softest waves: where longer ones are stiffer by more, they need another inverse


class MultilevelInverse:
    """M on one grid; a map in single precision on each grid of larger cells, and a byte for each point or cell."""

    def __init__(self, slab: Slab, pairs: int, weights: list[float]) -> None:
        self._weights, self._levels = weights, cell_levels(slab, pairs)
        grids = [level.coarse for level in self._levels]
        self._cells = [grid.empty(np.float32) for grid in grids]
        self._known = [grid.zeros(np.bool_) for grid in [slab, *grids]]  # interpolation replaces no point

    @classmethod
    def on(cls, slab: Slab, size: tuple[float, float], compliance: Compliance) -> "MultilevelInverse | None":
        """Return M for a body of that compliance, or None where it is no good: on lines, on cells that no pairs make
        nearly square, and where long waves are stiffer than shorter ones, as on incompressible layers."""
        weights = _weights(slab.nx, slab.ny, size, compliance)
        return cls(slab, pairs_for(size[0] / slab.nx, size[1] / slab.ny), weights) if weights else None

    def apply(self, c: Array, out: Array) -> None:
        """Put `M c` into another map; collective."""
        interpolate_back(self._levels, self._known, [c, *self._cells])
        np.multiply(c, self._weights[0], out=out)
        for weight, cells in zip(self._weights[1:], self._cells, strict=True):
            cells *= np.float32(weight)
        interpolate(self._levels, self._known, [out, *self._cells])


def _weights(nx: int, ny: int, size: tuple[float, float], compliance: Compliance) -> list[float]:
    """Return w of points and of the cells of each larger grid; none where M is no good."""
    dx, dy = size[0] / nx, size[1] / ny
    pairs = pairs_for(dx, dy)
    if min(nx, ny) == 1 or not dy / SQUARE < dx * 2**pairs < dy * SQUARE:
        return []
    along_x, along_y = max(pairs, 0), max(-pairs, 0)
    count = abs(pairs) + math.ceil(math.log2(max(math.ceil(nx / 2**along_x), math.ceil(ny / 2**along_y))))
    softer = compliance(np.pi / (min(dx * 2.0**along_y, dy) * 2.0 ** np.arange(count + 1)))
    steps = np.diff(softer)
    if steps.min() < -STIFFER * softer.max():
        return []
    points = [2.0 ** (2 * level - min(level, abs(pairs))) for level in range(1, count + 1)]
    return [POINTS * float(softer[0]), *(CELLS * np.maximum(steps, 0.0) / points).tolist()]

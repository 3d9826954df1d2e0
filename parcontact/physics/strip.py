"""Influence coefficients of a half space on which a box is periodic along x and free along y.

The displacement under a unit pressure on one cell and its images, at the distances m Lx along x, is for a shear
modulus of 1 (`love`: one cell, with the integral I of 1/r)

    A(x, y) = (1 - nu)/(2 pi) sum_m I(x + m Lx, y).

The sum diverges: a load that does not vary along x is one of plane strain, and moves the surface by the logarithm of
the distance across (K. L. Johnson, Contact Mechanics, 1985, Sec. 2.2). Displacements are relative to those of such a
load at the distance Ly, the width of the box:

    A = (1 - nu)/pi (dx dy/Lx) ln(Ly/|y|)    for |y| >> Lx.

So each load within the box moves every point of it downwards, and pressures do positive work. Under a prescribed
load pressures and gaps do not depend on this choice; the approach does.
"""

import numpy as np

from ..parallel.slab import Array
from .love import over_cell

NEAREST = 12  # accuracy: images summed on each side; the rest by the Euler-Maclaurin formula, to 1e-9
GAUSS = 0.5 / np.sqrt(3.0)  # nodes of two points over a cell [cells]


def strip_coefficients(x: Array, y: Array, dx: float, dy: float, *, size: tuple[float, float], poisson: float) -> Array:
    """Return the displacement [length] at (x, y) from the centre of a `dx x dy` cell and its images, under a unit
    pressure on each of them, for G = 1; |x| <= lx/2 for the box of `size = (lx, ly)`."""
    total = sum(np.asarray(over_cell(x + m * size[0], y, dx, dy)) for m in range(-NEAREST, NEAREST + 1))
    nodes = [(a * GAUSS * dx, b * GAUSS * dy) for a in (-1, 1) for b in (-1, 1)]
    rest = sum(_far_images(x + a, y + b, size) for a, b in nodes) / len(nodes)
    return np.asarray((total + dx * dy * rest) * (1.0 - poisson) / (2 * np.pi))


def _far_images(x: Array, y: Array, size: tuple[float, float]) -> Array:
    """Return the sum of 1/r over the images beyond `NEAREST`, minus that of a uniform line at the distance Ly. Midpoint
    rule of Euler and Maclaurin from s = NEAREST + 1/2 on: the integral, + f'/24 - 7 f'''/5760."""
    lx, ly = size
    found = 2.0 * np.log(ly) / lx + np.zeros(np.broadcast(x, y).shape)
    for side in (1, -1):
        a = (NEAREST + 0.5) * lx + side * x
        r = np.hypot(a, y)
        found -= np.log(a + r) / lx
        found -= lx * a / (24 * r**3)
        found -= 7 * lx**3 * (9 * a / r**5 - 15 * a**3 / r**7) / 5760
    return found

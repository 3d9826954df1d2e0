"""Love's coefficients: the displacement of the half space under a pressure that is constant on one cell.

For a shear modulus of 1 (A. E. H. Love, Phil. Trans. R. Soc. A 228 (1929) 377; paper, Eq. 2)

    A(x, y) = (1 - nu)/(2 pi) int_cell dx' dy' / sqrt((x - x')^2 + (y - y')^2).
"""

import math

import numpy as np

from ..compiled import pointwise
from ..parallel.fft import FFT
from ..parallel.slab import Array
from .convolution import ALL, wavenumbers

NEAR = 4.0  # accuracy: distance [cells] up to which Love's primitive is used; beyond it six Gauss points
GAUSS_NODES, GAUSS_WEIGHTS = (tuple(values / 2) for values in np.polynomial.legendre.leggauss(6))


def love(x: Array, y: Array, dx: float, dy: float, poisson: float = 0.5) -> Array:
    """Return the displacement [length] at (x, y) from the centre of a `dx x dy` cell under unit pressure, for G = 1.
    The relative error is below 2e-14 at any distance."""
    return np.asarray(over_cell(x, y, dx, dy)) * (1.0 - poisson) / (2 * np.pi)


@pointwise
def over_cell(x, y, dx, dy):  # type: ignore[no-untyped-def]  # numba finds the types itself
    """Return the integral of 1/r over a `dx x dy` cell at distance (x, y).

    Near the cell, these are differences of the primitive `x asinh(y/|x|) + y asinh(x/|y|)` at the four corners. Far
    away they cancel: there the integral is in closed form along the nearer direction and numerical along the other.
    """
    x, y = abs(x), abs(y)
    if x * dy < y * dx:
        x, y, dx, dy = y, x, dy, dx
    total = 0.0
    if x < NEAR * dx:
        for i in (-1, 1):
            a = x + 0.5 * i * dx
            for j in (-1, 1):
                b = y + 0.5 * j * dy
                if a != 0.0:
                    total += i * j * a * math.asinh(b / abs(a))
                if b != 0.0:
                    total += i * j * b * math.asinh(a / abs(b))
        return total
    low, high = y - 0.5 * dy, y + 0.5 * dy
    for node, weight in zip(GAUSS_NODES, GAUSS_WEIGHTS):  # noqa: B905  # numba has no strict zip
        a = x + node * dx
        if low > 0.0:
            line = 2.0 * math.atanh(dy / (math.sqrt(a**2 + low**2) + math.sqrt(a**2 + high**2)))
        else:
            line = math.asinh(high / a) - math.asinh(low / a)
        total += weight * line
    return total * dx


def cell_factor(fft: FFT, size: tuple[float, float], rows: slice = ALL) -> Array:
    """Return the compliance of cell-constant pressure over that of a sampled wave, for each wavenumber; to 14 digits.

    `size` is the size of the box, `rows` are rows of a spectrum. A wave of cell-constant pressures contains all aliases
    of its wavenumber, each with the form factor of the cell: `|q| sum_Q sinc((qx+Qx) dx/2) sinc((qy+Qy) dy/2) /
    |q+Q|` over the reciprocal lattice Q of the grid. With

        1/|q| = 2/sqrt(pi) int_0^inf exp(-q^2 t^2) dt

    the sums over Qx and Qy separate, and the integral is one product of matrices. Double exponential quadrature (H.
    Takahasi and M. Mori, Publ. RIMS 9 (1974) 721) starts far inside a cell and ends far outside the box.
    """
    qx, qy = wavenumbers(fft, size, rows)
    dx, dy = size[0] / fft.mx, size[1] / fft.my
    shortest, longest = min(dx, dy) / 16, max(size)
    u = np.arange(-3.7, math.log(2.0 * longest / shortest), 0.1)
    t = shortest * np.exp(u - np.exp(-u))
    weight = 0.2 / math.sqrt(math.pi) * t * (1.0 + np.exp(-u))
    along_x, along_y = _blurred_cell(qx.ravel() * dx / 2, t / dx), _blurred_cell(qy.ravel() * dy / 2, t / dy)
    q = np.hypot(qx, qy)
    return np.where(q > 0.0, q * ((weight[:, None] * along_y).T @ along_x), 1.0)


def _blurred_cell(b: Array, width: Array) -> Array:
    """Return `sum_n sinc(b_n) exp(-(2 b_n width)^2)`, b_n = b + pi n: the sampled wave of a cell blurred by `width`
    [cells].

    Shape (width, b). The sum over aliases converges fast for wide blurs. Narrow ones use the sum over cells, with
    the share of the blurred cell in each (Poisson's summation).
    """
    from scipy.special import erf  # slow to import, and of use to few

    result = np.zeros((width.size, b.size))
    wide = width > 0.25
    for n in range(-5, 6):
        alias = b + np.pi * n
        result[wide] += np.sinc(alias / np.pi) * np.exp(-((2 * width[wide, None] * alias) ** 2))
    for cell in range(-4, 5):
        edges = [erf((cell + side) / (2 * width[~wide, None])) for side in (-0.5, 0.5)]
        result[~wide] += (edges[1] - edges[0]) / 2 * np.cos(2 * cell * b)
    return result

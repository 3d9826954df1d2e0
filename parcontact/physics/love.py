"""Influence coefficients of isolated contacts, of boxes periodic along x, and of sliding contacts with their wake.

Love's coefficients are the displacement of the half space under a pressure that is constant on one cell.

For a shear modulus of 1 (A. E. H. Love, Phil. Trans. R. Soc. A 228 (1929) 377; paper, Eq. 2)

    A(x, y) = (1 - nu)/(2 pi) int_cell dx' dy' / sqrt((x - x')^2 + (y - y')^2).

A box that is periodic along x and free along y has images of each cell at the distances m Lx. With the integral I of
1/r over one cell, the displacement under a unit pressure on the cell and its images is, for a shear modulus of 1,

    A(x, y) = (1 - nu)/(2 pi) sum_m I(x + m Lx, y).

The sum diverges: a load that does not vary along x causes plane strain, and moves the surface by the logarithm of the
distance y (K. L. Johnson, Contact Mechanics, 1985, Sec. 2.2). Displacements are therefore relative to the displacement
of such a load at the distance Ly, the width of the box:

    A = (1 - nu)/pi (dx dy/Lx) ln(Ly/|y|)    for |y| >> Lx.

So each load within the box moves every point of the box downwards, and pressures do positive work. Under a prescribed
load this choice changes only the approach, not pressures and gaps.

In an isolated contact that slides at the velocity v, a body point that is now at x was at `x + v t` a time t ago. With
the creep function

    J(t) = J_g + sum J_i (1 - exp(-t/l_i)),

the influence coefficients are Love's A(x) plus, for each term, an integral along the wake (for G = 1):

    K(x) = J_g A(x) + sum J_i int_0^inf exp(-t/l_i)/l_i A(x + v t) dt.
"""

import math

import numpy as np

from ..compiled import loop, pointwise
from ..parallel.fft import FFT
from ..parallel.slab import Array
from .convolution import ALL, wavenumbers
from .prony import CreepSpectrum

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
    away these differences lose digits: there the integral is in closed form along the nearer direction and numerical
    along the other.
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
    """Return the compliance for cell-constant pressure divided by the compliance for a sampled wave, for each
    wavenumber; to 14 digits.

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


NEAREST = 12  # accuracy: images summed on each side; the rest by the Euler-Maclaurin formula, to 1e-9
GAUSS = 0.5 / np.sqrt(3.0)  # nodes of two points over a cell [cells]


def strip_coefficients(x: Array, y: Array, dx: float, dy: float, *, size: tuple[float, float], poisson: float) -> Array:
    """Return the displacement [length] at (x, y) from the centre of a `dx x dy` cell and its images, under a unit
    pressure on the cell and each image, for G = 1; |x| <= lx/2 for the box of `size = (lx, ly)`."""
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


Vector = tuple[float, float]
WAKE_GAUSS = np.polynomial.legendre.leggauss(6)
LOCAL = 1e-4  # accuracy: creep length over a cell below which creep is instantaneous
NEAR_WAKE = 2.0  # accuracy: distance [cells] below which panels resolve the edge of the loaded cell
FAR = 16.0  # accuracy: distance [cells] beyond which two terms of the expansion of A are used; error 1e-7
DECAYED = 40.0  # accuracy: distance over creep length at which integrals end, exp(-40)


def wake(x: Array, y: Array, dx: float, dy: float, velocity: Vector, creep: CreepSpectrum) -> Array:
    """Return K(x, y) of the module for a `dx x dy` cell under unit pressure, with nu = 1/2; x and y broadcast."""
    speed = float(np.hypot(*velocity))
    lengths = speed * creep.retardation_times
    short = lengths <= LOCAL * min(dx, dy)
    local = creep.glass + float(creep.compliances[short].sum())
    near = local * love(x, y, dx, dy)
    if np.all(short):
        return near
    direction = (velocity[0] / speed, velocity[1] / speed)
    weights, lasting = creep.compliances[~short], lengths[~short]
    if velocity[1] == 0.0 and x.shape[0] == y.shape[1] == 1:
        order = np.argsort(direction[0] * x[0], kind="stable")
        ahead = direction[0] * x[0, order]
        if np.allclose(np.diff(ahead), dx, rtol=1e-6):
            along = np.empty((y.size, x.size))
            along[:, order] = _sweep(ahead, y[:, 0], dx, dy, weights, lasting)
            return near + along
    x, y = np.broadcast_arrays(x, y)
    return near + _over_memory(np.ascontiguousarray(x), np.ascontiguousarray(y), dx, dy, direction, weights, lasting)


def _over_memory(x: Array, y: Array, dx: float, dy: float, direction: Vector, weights: Array, lengths: Array) -> Array:
    out = np.empty(x.shape)
    _integrate(x, y, dx, dy, direction, weights, lengths, *WAKE_GAUSS, out)
    return out


def _sweep(x: Array, y: Array, dx: float, dy: float, weights: Array, lengths: Array) -> Array:
    """Return the integrals along +x for rising x at distances dx and for all y, from the last cell back to the first:

        K(x) = int_0^dx exp(-s/l)/l A(x + s) ds + exp(-dx/l) K(x + dx).

    This evaluates A at a few points per cell; separate integrals would need hundreds.
    """
    shortest = float(lengths.min())
    near, near_shares = _within_cell(dx, shortest, edge=True)
    far, far_shares = _within_cell(dx, shortest, edge=False)
    rate = (weights / lengths)[:, None]
    near_memory, far_memory = (
        shares * np.exp(-s / lengths[:, None]) * rate for s, shares in ((near, near_shares), (far, far_shares))
    )
    ends = np.empty((lengths.size, y.size))
    last, rows = np.full((y.size, 1), x[-1]), np.ascontiguousarray(y.reshape(-1, 1))
    for k in range(lengths.size):
        ends[k] = _over_memory(last, rows, dx, dy, (1.0, 0.0), weights[k : k + 1], lengths[k : k + 1])[:, 0]
    out = np.empty((y.size, x.size))
    _recur(x, y, dx, dy, near, far, near_memory, far_memory, np.exp(-dx / lengths), ends, out)
    return out


def _within_cell(dx: float, shortest: float, edge: bool) -> tuple[Array, Array]:
    """Return Gauss points and weights on (0, dx). Panels grow from the shortest memory and, with `edge`, shrink towards
    dx/2, where the slope of A has a logarithm at the edge of the loaded cell."""
    ends = shortest * 2.0 ** np.arange(max(math.ceil(math.log2(dx / shortest)), 0))
    if edge:
        steps = 0.5 * dx * 4.0 ** -np.arange(4.0)
        ends = np.concatenate([ends, [0.5 * dx], 0.5 * dx - steps, 0.5 * dx + steps])
    edges = np.unique([0.0, *ends[ends < dx], dx])
    half = 0.5 * np.diff(edges)[:, None]
    return (edges[:-1, None] + half * (1.0 + WAKE_GAUSS[0])).ravel(), (half * WAKE_GAUSS[1]).ravel()


@loop
def _recur(x, y, dx, dy, near, far, near_memory, far_memory, decay, ends, out):  # type: ignore[no-untyped-def]
    """Make the recursion of `_sweep` from the values at the last x; `near` are the nodes close to the loaded cell."""
    for j in range(y.size):
        kept = ends[:, j].copy()
        out[j, -1] = kept.sum()
        for i in range(x.size - 2, -1, -1):
            close = abs(x[i]) < NEAR_WAKE * dx and abs(y[j]) < NEAR_WAKE * dy
            nodes, memory = (near, near_memory) if close else (far, far_memory)
            kept *= decay
            for n in range(nodes.size):
                there = _love(x[i] + nodes[n], y[j], dx, dy)
                for k in range(kept.size):
                    kept[k] += memory[k, n] * there
            out[j, i] = kept.sum()


@loop
def _integrate(x, y, dx, dy, direction, weights, lengths, nodes, shares, out):  # type: ignore[no-untyped-def]
    """Put the integral over s > 0 of `sum weights/lengths exp(-s/lengths) A(x + s direction)`, nu = 1/2, into `out`.

    Gauss panels are no longer than the scale of the integrand: the shortest memory length, later s itself; and half
    the distance from the cell, or its edge.
    """
    cell = min(dx, dy)
    shortest, end = lengths.min(), DECAYED * lengths.max()
    for j in range(x.shape[0]):
        for i in range(x.shape[1]):
            total, s = 0.0, 0.0
            while s < end:
                distance = np.hypot(x[j, i] + s * direction[0], y[j, i] + s * direction[1])
                step = min(max(shortest, s), 0.1 * cell + 0.5 * max(distance - cell, 0.0), end - s)
                for node, share in zip(nodes, shares):  # noqa: B905  # numba has no strict zip
                    t = s + 0.5 * step * (1.0 + node)
                    memory = 0.0
                    for k in range(lengths.size):
                        memory += weights[k] / lengths[k] * np.exp(-t / lengths[k])
                    there = _love(x[j, i] + t * direction[0], y[j, i] + t * direction[1], dx, dy)
                    total += 0.5 * step * share * memory * there
                s += step
            out[j, i] = total


@loop
def _love(x, y, dx, dy):  # type: ignore[no-untyped-def]
    """Return Love's displacement for nu = 1/2; far away the first two terms of its expansion in the size of
    the cell."""
    r2 = x * x + y * y
    if r2 > FAR**2 * max(dx, dy) ** 2:
        r = np.sqrt(r2)
        correction = (dx * dx * (3 * x * x - r2) + dy * dy * (3 * y * y - r2)) / (24 * r2 * r2)
        return dx * dy / r * (1.0 + correction) / (4 * np.pi)
    return over_cell(x, y, dx, dy) / (4 * np.pi)

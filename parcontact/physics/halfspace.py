"""Operators of a half space between pressure and normal displacement of the surface, at rest and in sliding.

An elastic half space of shear modulus 1 under the pressure p moves by the Boussinesq integral (paper, Eq. 1)

    u(x) = (1 - nu)/(2 pi) int p(x') / |x - x'| d2x',       in Fourier space   u^(q) = (1 - nu)/|q| p^(q).

Displacements of a body of modulus G are these displacements divided by G. Lengths have any unit; the unit of
displacements is this unit times pressure/modulus. The kernel `spectral` uses this symbol; the kernel `love` takes the
pressure as constant on each cell, and the displacement at cell centres. The mean displacement of a periodic half space
is arbitrary and set to 0. For another body, the symbol is multiplied by the ratio of its compliance to that of the half
space (`Response`).

A pressure wave `exp(i q x)` that moves with the surface at the velocity vector v loads a point of a viscoelastic
body at the angular frequency `-q v`. In the frame of the surface,

    u^(q) = (1 - nu)/(|q| G*(-q v)) p^(q).

Love's coefficients A are the displacement of a free half space of shear modulus 1 under a unit pressure on one cell
(A. E. H. Love, Phil. Trans. R. Soc. A 228 (1929) 377; paper, Eq. 2):

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

The wake of an isolated contact that slides is not periodic. At the velocity vector v, a body point that is now at x
was at `x + v t` a time t ago. With the creep function of glassy compliance J_g and retardation times l_i,

    J(t) = J_g + sum J_i (1 - exp(-t/l_i)),

the influence coefficients K are Love's A(x), multiplied by J_g, plus an integral along the wake for each term:

    K(x) = J_g A(x) + sum J_i int_0^inf exp(-t/l_i)/l_i A(x + v t) dt.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, cached_property, partial
from typing import Any, Literal

import numpy as np
from numpy.typing import DTypeLike

from ..compiled import loop, pointwise
from ..errors import InputError
from ..parallel.fft import FFT, Cosines, Spectrum
from ..parallel.slab import Array, Tally
from .convolution import (
    ALL,
    LONGEST_CELL,
    Convolution,
    MirroredConvolution,
    TileConvolution,
    TileOperator,
    Tiles,
    free_operator,
    padded_lengths,
    table_transform,
    tabulate,
    tile_inverse,
    travelling_wavenumbers,
    wavenumbers,
)
from .prony import CreepSpectrum, Prony, complex_modulus, creep_spectrum

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
    """Return the factor by which the kernel `love` multiplies the symbol of the kernel `spectral`, for each wavenumber
    of `rows` of a spectrum; accurate to 14 digits.

    A wave of pressures that are constant on each cell contains all aliases of its wavenumber, each with the form factor
    of the cell. So the factor is `|q| sum_Q sinc((qx+Qx) dx/2) sinc((qy+Qy) dy/2) / |q+Q|` over the reciprocal lattice
    Q of the grid on the box of `size`. With

        1/|q| = 2/sqrt(pi) int_0^inf exp(-q^2 t^2) dt

    the sums over Qx and Qy separate, and the integral is one product of matrices. Double exponential quadrature (H.
    Takahasi and M. Mori, Publ. RIMS 9 (1974) 721) covers t from far below a cell to far beyond the box.
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
    """Return the displacement [length] at (x, y) from the centre of a `dx x dy` cell, under a unit pressure on this
    cell and on each of its images, for G = 1. The box of `size = (lx, ly)` is periodic along x only; |x| must not
    exceed lx/2."""
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


LEAST_SYMBOL = 1e-6  # accuracy: least compliance of a wave in a table, over that of a half space
UNIFORM = 2.113  # tuning: wavenumber times side of a square whose waves are as stiff as the square on average


@dataclass(frozen=True)
class Response:
    """Response of the surface of a body of shear modulus 1 to pressure, here of a half space; effects may return a
    subclass for another body (`effects.effect.Effect`). Wavenumbers q are in 1/length; arrays have any shape."""

    thickness: float = math.inf
    poisson: float = field(default=0.5, kw_only=True)

    @property
    def mean_compliance(self) -> float:
        """Displacement of the surface of a periodic box divided by a uniform pressure."""
        return 0.0

    def compliance_ratio(self, q: Array) -> Array | float:
        """Return the displacement under waves of pressure, divided by that of a half space."""
        return 1.0

    def compliance(self, q: Array) -> Array:
        """Return the ratio of displacement to pressure of waves on a periodic body, 0 for q = 0. The factor of the
        kernel `love` is not included."""
        with np.errstate(divide="ignore"):
            found = np.where(q > 0.0, (1.0 - self.poisson) / q, 0.0)
        found *= self.compliance_ratio(q)
        return found

    def stiffness(self, q: Array) -> Array:
        """Return the ratio of pressure to displacement of waves, q > 0, for a preconditioner."""
        return np.asarray(q / (1.0 - self.poisson))

    def coefficient(self, x: Array, y: Array, dx: float, dy: float) -> Array:
        """Return the displacements at distances (x, y) from a `dx x dy` cell under unit pressure, in a free box."""
        return love(x, y, dx, dy, self.poisson)

    def reach(self, size: Vector) -> float:
        """Return the distance [length] beyond which points of a box hardly act on each other."""
        return math.inf

    def preconditioner(self, size: Vector) -> Callable[..., Any] | None:
        """Return None if a preconditioner with the symbol `stiffness` suffices in the box. Otherwise return a function
        of a slab and a `contact.preconditioner.ExtendedPreconditioner`, which returns a better preconditioner."""
        return None


@dataclass(frozen=True)
class HalfSpace:
    """A half space of shear modulus 1, loaded inside a box of `size = (lx, ly)` [any unit of length].

    The box is periodic, with the `kernel`, unless it is `free`. Nothing surrounds a free box, and the coefficients are
    Love's; a free box that `repeats_along_x` is periodic along x only. `other` is the response of a body that is no
    half space. `factors` is None for a linear body, or a function that returns two factors for each wavenumber: on the
    storage and on the loss modulus in steady sliding. The argument `fft` of methods is the transform of maps: operators
    compute in its precision, and symbols have the shape of its spectrum, or of the requested `rows`. A free half space
    makes a padded transform for each operator.
    """

    size: Vector
    poisson: float = 0.5
    kernel: Literal["spectral", "love"] = "spectral"
    free: bool = False
    other: Response | None = None
    repeats_along_x: bool = False
    factors: Callable[[Array], tuple[Array, Array]] | None = None

    @cached_property
    def response(self) -> Response:
        """Response of the body: `other`, or that of a half space."""
        return self.other or Response(poisson=self.poisson)

    @property
    def moves_in_the_mean(self) -> bool:
        """True if a uniform pressure moves the surface. False for a periodic half space and a periodic incompressible
        body."""
        return self.free or self.response.mean_compliance > 0.0

    # -- elastic ------------------------------------------------------------------------------------------------------

    def symbol(self, fft: FFT, rows: slice = ALL) -> Array:
        """Return the ratio of displacement to pressure of each wave of a periodic body, `(1 - nu)/|q|` on a half
        space."""
        q = np.hypot(*wavenumbers(fft, self.size, rows))
        symbol = self.response.compliance(q)
        symbol[q == 0.0] = self.response.mean_compliance
        return symbol * cell_factor(fft, self.size, rows) if self.kernel == "love" else symbol

    def inverse_symbol(self, fft: FFT, rows: slice = ALL) -> Array:
        """Return pressure divided by displacement of each wave, `|q|/(1 - nu)` on a half space, for either kernel. At q
        = 0, where a periodic half space has no inverse, the ratio at the wavenumber of the box makes the symbol
        positive."""
        q = np.hypot(*wavenumbers(fft, self.size, rows))
        q[q == 0.0] = 2 * np.pi / max(self.size)
        return self.response.stiffness(q)

    def _mirrored_inverse_symbol(self, cosines: Cosines, rows: slice) -> Spectrum:
        """Return pressure over displacement of each half wave of a free box, `(|q| + UNIFORM/L)/(1 - nu)`. This is
        exact for a uniform pressure on a square, whose mean displacement is `(1 - nu) L/UNIFORM`."""
        symbol = np.empty((len(range(cosines.my)[rows]), cosines.fft.shape[1]), np.complex128)
        for (along_x, along_y), place in zip(cosines.modes, (symbol.real, symbol.imag), strict=True):
            q = np.pi * np.hypot(along_x / self.size[0], along_y[rows] / self.size[1])
            place[...] = self.response.stiffness(q + UNIFORM / max(self.size))
        return symbol

    @property
    def largest_compliance(self) -> float:
        """Ratio of displacement to pressure of a wave as long as the box."""
        return (1.0 - self.poisson) * max(self.size) / (2 * np.pi)

    def own_lengths(self, points: tuple[int, int]) -> tuple[int, int] | None:
        """Return the lengths along x and y of an operator's padded transform for maps of `points = (nx, ny)`; None if
        the operator uses the transform of the maps."""
        if not self.free:
            return None
        lengths = padded_lengths(*points)
        return (points[0], lengths[1]) if self.repeats_along_x else lengths

    def operator(self, fft: FFT) -> Convolution:
        """Return the operator from pressure to displacement; collective where the half space is free.

        A free box is padded with zeros to twice its size, so that the cyclic convolution with Love's coefficients
        equals the linear convolution (paper, reference [12]). The coefficients are computed at the first use; the
        transforms are planned at once.
        """
        if not self.free:
            return Convolution(fft, partial(self.symbol, fft), fft.dtype)
        padded = FFT(fft.slab, self.own_lengths((fft.slab.nx, fft.slab.ny)), fft.dtype, fft.measured)
        table_transform(padded, inside=True)

        @cache
        def table() -> Spectrum:
            if self.repeats_along_x:
                images = partial(strip_coefficients, size=self.size, poisson=self.poisson)
                return tabulate(padded, self.size, images, even=True, inside=True, symmetric=False)
            return tabulate(padded, self.size, self.response.coefficient, self.other is None, inside=True)

        return Convolution(padded, lambda rows: table()[rows].real, fft.dtype, later=True)

    def inverse(self, fft: FFT) -> Convolution | MirroredConvolution:
        """Return the operator from displacement to pressure.

        For the periodic half space with the spectral kernel the operator is exact except for the mean. Otherwise the
        operator is only approximate, for use as a preconditioner. In a free box displacements are continued mirrored at
        the edges, so that they have no jump there.
        """
        if self.free and not self.repeats_along_x:
            cosines = Cosines(fft)
            return MirroredConvolution(cosines, partial(self._mirrored_inverse_symbol, cosines))
        return Convolution(fft, partial(self.inverse_symbol, fft), fft.dtype)

    def works_on_tiles(self, nx: int, ny: int) -> bool:
        """Return True if operators on squares of the grid (tiles) exist: for a half space in a free box whose cells are
        not long."""
        dx, dy = self.size[0] / nx, self.size[1] / ny
        return (
            self.free and not self.repeats_along_x and self.other is None and max(dx, dy) <= LONGEST_CELL * min(dx, dy)
        )

    def on_tiles(self, tiles: Tiles, tally: Tally) -> tuple[TileOperator, TileConvolution]:
        """Return the operator of a free half space on some squares of its grid (tiles), and a preconditioner for it."""
        operator = free_operator(tiles, self.size, self.poisson, self.response.coefficient, tally)
        return operator, tile_inverse(tiles, self.size, self.poisson, tally)

    # -- under tractions along the surface ----------------------------------------------------------------------------

    def gap_operators(self, fft: FFT) -> tuple[Convolution, Convolution, float, float]:
        """Return two operators and two numbers for solvers that find the gap; collective where the half space is
        free.

        The first operator takes pressure to displacement. The second operator is the inverse of the first, but takes a
        uniform displacement to 0. The first number is the displacement under a uniform unit pressure, which is 0 for
        some bodies. The second number is the displacement that the first operator uses instead: the first number, or a
        positive value if the first number is 0. A free body is replaced by a periodic body with the same influence
        coefficients up to half the box.
        """
        if self.free:
            table = tabulate(fft, self.size, self.response.coefficient, self.other is None).real
            symbol = table.__getitem__
            owns_mean = fft.columns.start == 0 < fft.columns.stop
            least = mean = fft.slab.sum(float(table[0, 0]) if owns_mean else 0.0)[0]
        else:
            symbol, mean = partial(self.symbol, fft), self.response.mean_compliance
            least = mean or self.largest_compliance

        def positive(rows: slice, inverted: bool) -> Array:
            q = np.hypot(*wavenumbers(fft, self.size, rows))
            smallest = LEAST_SYMBOL * (1.0 - self.poisson) / np.where(q == 0.0, np.inf, q)
            values = np.where(q == 0.0, least, np.maximum(symbol(rows), smallest))
            return np.where(q == 0.0, 0.0, 1.0 / values) if inverted else values

        operator, inverse = (Convolution(fft, partial(positive, inverted=way), fft.dtype) for way in (False, True))
        return operator, inverse, mean, least

    # -- under a surface that slides steadily -------------------------------------------------------------------------

    def frequencies(self, fft: FFT, velocity: Vector, rows: slice = ALL) -> Array:
        """Return the angular frequency `q v` of each wave under a surface that slides at this velocity [length/s],
        shape `fft.shape`. Nyquist wavenumbers count as 0."""
        qx, qy = travelling_wavenumbers(fft, self.size, rows)
        return np.asarray(qx * velocity[0] + qy * velocity[1])

    def sliding_moduli(self, fft: FFT, velocity: Vector, prony: Prony) -> Callable[[slice], Spectrum]:
        """Return a function that takes rows of the spectrum and returns, for each wave there, the modulus G*(-q v)
        times the `factors`. At a Nyquist wavenumber, which has two signs, the modulus is the mean for both signs.

        The moduli broadcast to the rows: without factors, and under a surface that slides along x, all rows are equal
        and the function returns one row.
        """
        if velocity[1]:
            return lambda rows: self._with_factors(fft, self._linear_modulus(fft, velocity, prony, rows), rows)
        of_a_row = self._linear_modulus(fft, velocity, prony, slice(0, 1))
        return lambda rows: self._with_factors(fft, of_a_row, rows)

    def _with_factors(self, fft: FFT, found: Spectrum, rows: slice) -> Spectrum:
        """Return the modulus of a linear body on rows times the `factors`."""
        if self.factors is None:
            return found
        storage, loss = self.factors(np.hypot(*wavenumbers(fft, self.size, rows)))
        return np.asarray(storage * found.real + 1j * (loss * found.imag))

    def _linear_modulus(self, fft: FFT, velocity: Vector, prony: Prony, rows: slice) -> Spectrum:
        qx, qy = wavenumbers(fft, self.size, rows)
        at_x, at_y = 2 * np.abs(fft.modes[0]) == fft.mx, 2 * np.abs(fft.modes[1][rows]) == fft.my
        result = np.zeros((len(qy), fft.shape[1]), dtype=np.complex128)
        for sign_x, sign_y in ((1, 1), (-1, 1), (1, -1), (-1, -1)):
            along_x, along_y = np.where(at_x, sign_x * qx, qx), np.where(at_y, sign_y * qy, qy)
            result += 0.25 * complex_modulus(-(along_x * velocity[0] + along_y * velocity[1]), *prony)
        return result

    def sliding_operator(self, fft: FFT, velocity: Vector, prony: Prony) -> Convolution:
        """Return the operator from pressure to displacement of a viscoelastic body; collective where the half space is
        free. Raises InputError for a free body that flows, as its wake never ends."""
        if self.free:
            return self._along_wake(fft, velocity, _creep(prony), fft.dtype)
        moduli = self.sliding_moduli(fft, velocity, prony)

        def part(rows: slice) -> Spectrum:
            symbol, modulus = self.symbol(fft, rows), moduli(rows)
            return np.divide(symbol, modulus, out=np.zeros(symbol.shape, np.complex128), where=symbol != 0.0)

        return Convolution(fft, part, fft.complex, even=not velocity[1])

    def sliding_inverse(self, fft: FFT, velocity: Vector, prony: Prony) -> Convolution:
        """Return the operator from displacement to pressure of a viscoelastic body in sliding; see `inverse`."""
        moduli = self.sliding_moduli(fft, velocity, prony)

        def part(rows: slice) -> Spectrum:
            return np.asarray(self.inverse_symbol(fft, rows) * moduli(rows))

        return Convolution(fft, part, fft.complex, even=not velocity[1])

    def branch_operator(self, fft: FFT, velocity: Vector, prony: Prony, k: int) -> Convolution:
        """Return the operator from pressure to the map h_k of branch `k` of `prony`, of a free body; collective.

        In the Laplace domain `h_k = G_k s tau_k/(1 + s tau_k) u`, which has the poles of the creep function only: each
        term i of the creep function is multiplied by the response of the branch at `s = -1/l_i`.
        """
        creep, modulus, tau = _creep(prony), float(prony.moduli[k]), float(prony.relaxation_times[k])
        ratio = -tau / creep.retardation_times
        shares = creep.compliances * modulus * ratio
        distinct = ratio != -1.0  # equal to rounding only for a branch of negligible modulus
        shares = np.divide(shares, 1.0 + ratio, out=np.zeros_like(shares), where=distinct)
        own = CreepSpectrum(modulus * creep.glass, shares, creep.retardation_times, 0.0)
        return self._along_wake(fft, velocity, own, np.float64)

    def _along_wake(self, fft: FFT, velocity: Vector, creep: CreepSpectrum, dtype: DTypeLike) -> Convolution:
        padded = FFT(fft.slab, padded_lengths(fft.slab.nx, fft.slab.ny), dtype)

        def coefficient(x: Array, y: Array, dx: float, dy: float) -> Array:
            return wake(x, y, dx, dy, velocity, creep) * (2.0 * (1.0 - self.poisson))

        table = tabulate(padded, self.size, coefficient)
        return Convolution(padded, table.__getitem__, padded.complex, even=not velocity[1])


def _creep(prony: Prony) -> CreepSpectrum:
    creep = creep_spectrum(*prony)
    if creep.fluidity > 0.0:
        raise InputError("material: a body without long-term modulus leaves an endless wake; give it modulus_inf > 0")
    return creep

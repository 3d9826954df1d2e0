"""Operators of the half space: pressure -> normal displacement of the surface, and back.

An elastic half space of shear modulus 1 under the pressure p moves by the Boussinesq integral (paper, Eq. 1)

    u(x) = (1 - nu)/(2 pi) int p(x') / |x - x'| d2x',       in Fourier space   u^(q) = (1 - nu)/|q| p^(q).

With a modulus G divide by G. Lengths may be in any unit: the result is in that unit times the pressure over the modulus.
`spectral` takes this symbol as it is; `love` takes the pressure as constant on each cell (A. E. H. Love, Phil. Trans. R.
Soc. A 228 (1929) 377; paper, Eq. 2) and the displacement at cell centres. The mean displacement of a periodic half
space is arbitrary and set to 0.
"""

import math
from collections.abc import Callable

import numba
import numpy as np
import pyfftw
from numpy.typing import DTypeLike, NDArray

from ..parallel.fft import FFT
from ..parallel.slab import Array, Slab


class Convolution:
    """A linear operator given by its symbol on the wavenumbers of a transform, shape `fft.shape`."""

    def __init__(self, fft: FFT, symbol: Array) -> None:
        self.fft = fft
        scale = 1.0 / (fft.mx * fft.my)
        self.symbol = np.multiply(symbol, scale).astype(fft.dtype if np.isrealobj(symbol) else fft.complex)
        fft.slab.tally["map bytes"] += self.symbol.nbytes

    def apply(self, field: Array, out: Array) -> Array:
        """Collective."""
        self.fft.slab.tally["operator"] += 1
        return self.fft.convolve(field, self.symbol, out)


class Narrowed:
    """An operator applied in single precision to double precision maps: half the time and messages, 7 digits."""

    def __init__(self, operator: Convolution) -> None:
        self.operator = operator
        slab = operator.fft.slab
        self._field, self._out = slab.empty(np.float32), slab.empty(np.float32)

    def apply(self, field: Array, out: Array) -> Array:
        """Collective."""
        self._field[...] = field
        out[...] = self.operator.apply(self._field, self._out)
        return out


def wavenumbers(fft: FFT, size: tuple[float, float]) -> tuple[Array, Array]:
    """Angular wavenumbers `(qx, qy)` of a spectrum of a box of `size = (lx, ly)`; they broadcast to its shape."""
    along_x, along_y = fft.modes
    return 2 * np.pi / size[0] * along_x, 2 * np.pi / size[1] * along_y


def periodic(fft: FFT, size: tuple[float, float], poisson: float = 0.5, kernel: str = "spectral") -> Convolution:
    """Pressure -> displacement of a periodic half space of shear modulus 1; a pressure's mean moves nothing."""
    qx, qy = wavenumbers(fft, size)
    q = np.hypot(qx, qy)
    with np.errstate(divide="ignore"):
        symbol = np.where(q > 0.0, (1.0 - poisson) / q, 0.0)
    if kernel == "love":
        symbol *= _cell_factor(fft, size)
    return Convolution(fft, symbol)


def inverse(fft: FFT, size: tuple[float, float], poisson: float = 0.5) -> Convolution:
    """Displacement -> pressure, `|q|/(1 - nu)`: exact for the spectral periodic half space, a preconditioner for others.

    At q = 0, where a periodic half space has no inverse, the value of the smallest wavenumber keeps it positive; it
    acts on mean values only.
    """
    q = np.hypot(*wavenumbers(fft, size))
    q[q == 0.0] = 2 * np.pi / max(size)
    return Convolution(fft, q / (1.0 - poisson))


def free(slab: Slab, size: tuple[float, float], poisson: float = 0.5, dtype: DTypeLike = np.float64) -> Convolution:
    """Pressure -> displacement of an unbounded half space loaded inside the box only: Love's coefficients, zero padded.

    Padding to twice the box makes the cyclic convolution a linear one (paper, reference [12]); nobody outside sees it.
    """
    lengths = pyfftw.next_fast_len(2 * slab.nx), pyfftw.next_fast_len(2 * slab.ny)
    fft = FFT(slab, lengths, dtype)
    return Convolution(fft, tabulate(fft, size, lambda *cell: love(*cell, poisson)).real)


def tabulate(fft: FFT, size: tuple[float, float], coefficient: Callable[..., Array]) -> NDArray[np.complexfloating]:
    """Symbol on the padded transform `fft` of `coefficient(x, y, dx, dy)`, the displacement at distance (x, y) [length]
    that a unit pressure on one cell causes; collective, and no rank holds the whole table.
    """
    slab = fft.slab
    dx, dy = size[0] / slab.nx, size[1] / slab.ny
    padded = slab.resized(fft.mx, fft.my)
    x, y = (step * _distances(count) for step, count in ((dx, fft.mx), (dy, fft.my)))
    table = np.ascontiguousarray(coefficient(x[None, :], y[padded.rows, None], dx, dy))
    return FFT(padded).forward(table).copy()


def _distances(count: int) -> NDArray[np.int64]:
    index = np.arange(count)
    return np.where(2 * index <= count, index, index - count)


def love(x: Array, y: Array, dx: float, dy: float, poisson: float = 0.5) -> Array:
    """Displacement [length] at distance (x, y) from the centre of a `dx x dy` cell under unit pressure, shear modulus 1.

    Love (1929): `(1 - nu)/(2 pi)` times the integral of 1/r over the cell, from the primitive
    `x asinh(y/|x|) + y asinh(x/|y|)` at its four corners.
    """
    result = np.zeros(np.broadcast_shapes(x.shape, y.shape))
    for sign_x in (1, -1):
        for sign_y in (1, -1):
            a, b = x + sign_x * dx / 2, y + sign_y * dy / 2
            result += sign_x * sign_y * (a * np.arcsinh(b / np.abs(a)) + b * np.arcsinh(a / np.abs(b)))
    return result * (1.0 - poisson) / (2 * np.pi)


def _cell_factor(fft: FFT, size: tuple[float, float]) -> Array:
    """Compliance of cell-constant pressure over that of a sampled wave, for each wavenumber.

    A wave of pressures constant on cells contains all aliases of its wavenumber, each with the cell's form factor:
    `|q| sum_Q sinc((qx+Qx) dx/2) sinc((qy+Qy) dy/2) / |q+Q|` over the reciprocal lattice Q of the grid.
    """
    qx, qy = (q.ravel() for q in wavenumbers(fft, size))
    return np.asarray(_alias_sum(qx, qy, size[0] / fft.mx, size[1] / fft.my, _taper(10)))


def _taper(reach: int) -> Array:
    """Weights of the terms 0, 1, ... of an alternating series: binomial tails make its truncation error tiny."""
    steps = np.array([math.comb(reach, k) for k in range(reach + 1)]) / 2.0**reach
    return np.concatenate([np.ones(reach), 1.0 - np.cumsum(steps)[:-1]])


@numba.njit(cache=True)
def _alias_sum(qx: Array, qy: Array, dx: float, dy: float, weights: Array) -> Array:
    factor = np.ones((qy.size, qx.size))
    reach = weights.size - 1
    for j in range(qy.size):
        reach_y = reach if qy[j] != 0.0 else 0  # every other alias of a constant has form factor 0
        for i in range(qx.size):
            reach_x = reach if qx[i] != 0.0 else 0
            total = 0.0
            for n in range(-reach_y, reach_y + 1):
                by = 0.5 * qy[j] * dy + np.pi * n
                fy = weights[abs(n)] * (np.sin(by) / by if by != 0.0 else 1.0)
                for m in range(-reach_x, reach_x + 1):
                    bx = 0.5 * qx[i] * dx + np.pi * m
                    fx = weights[abs(m)] * (np.sin(bx) / bx if bx != 0.0 else 1.0)
                    if bx != 0.0 or by != 0.0:
                        total += fx * fy / np.hypot(2 * bx / dx, 2 * by / dy)
            q = np.hypot(qx[i], qy[j])
            if q > 0.0:
                factor[j, i] = q * total
    return factor

"""Operator from tractions along the surface of a half space to the displacements along it.

A wave of tractions t, two components, moves the surface of an elastic half space of shear modulus 1 by

    u^(q) = 1/|q| (I - nu q q^T/q^2) t^(q).

Tractions along q have the compliance of a pressure, `(1 - nu)/|q|`, tractions across q the compliance `1/|q|`. In an
incompressible half space (nu = 1/2) tractions do not move the surface along its normal, and pressures do not move it
along itself (K. L. Johnson, Contact Mechanics, 1985, section 3.6).

The mean displacement of a periodic half space is 0. In a free box tractions are constant on each cell, and the
displacement at a distance (x, y) from the centre of a cell is the integral over it of Cerruti's solution

    u_x = t_x ((1 - nu)/r + nu x^2/r^3)/(2 pi) + t_y nu x y/r^3/(2 pi),

and u_y with x and y exchanged. It follows from the integrals over the cell of 1/r (`love.over_cell`), of `x^2/r^3`,
with the primitive `y asinh(x/|y|)`, and of `x y/r^3`, with the primitive -r.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from ...compiled import loop
from ...parallel.fft import FFT, Spectrum
from ...parallel.slab import Array, Slab, allocate
from ...physics.convolution import padded_lengths, tabulate, travelling_wavenumbers, wavenumbers
from ...physics.love import love

Vector = tuple[float, float]


def stacked(slab: Slab) -> Slab:
    """Return the slab of maps with two components: on each rank the rows of the first, then those of the second."""
    return Slab(slab.comm, slab.nx, 2 * slab.ny, slab.tally, lambda rank: _twice(slab.rows_of(rank)))


def _twice(rows: slice) -> slice:
    return slice(2 * rows.start, 2 * rows.stop)


def components(field: Array) -> tuple[Array, Array]:
    """Return the maps of both components of a stacked map, in its memory."""
    rows = len(field) // 2
    return field[:rows], field[rows:]


class ShearOperator:
    """Operator from tractions to displacements on a half space of shear modulus 1, loaded inside a box of `size` [any
    unit of length]; with `free`, nothing surrounds the box. `short` is the compliance of the shortest waves across
    their direction. The constructor and `apply` are collective."""

    def __init__(self, fft: FFT, size: Vector, poisson: float, free: bool) -> None:
        slab = fft.slab
        self.free, self.short = free, min(size[0] / slab.nx, size[1] / slab.ny) / np.pi
        self.fft = FFT(slab, padded_lengths(slab.nx, slab.ny), measured=fft.measured) if free else fft
        self._other = allocate(self.fft.shape, self.fft.complex, slab.tally)
        self._symbols = [allocate(self.fft.shape, np.float64, slab.tally) for _ in range(3)]
        if not slab.only_counts:
            self._fill(size, poisson, free)

    def _fill(self, size: Vector, poisson: float, free: bool) -> None:
        """Make the symbols of u_x over t_x, u_y over t_y and u_y over t_x."""
        if free:
            for symbol, coefficient in zip(self._symbols, _coefficients(poisson), strict=True):
                symbol[...] = tabulate(self.fft, size, coefficient).real
            return
        (qx, qy), (along_x, along_y) = wavenumbers(self.fft, size), travelling_wavenumbers(self.fft, size)
        q = np.hypot(qx, qy)
        q[q == 0.0] = np.inf
        for symbol, product in zip(self._symbols, (qx * qx, qy * qy, along_x * along_y), strict=True):
            symbol[...] = -poisson * product / q**3
        for symbol in self._symbols[:2]:
            symbol += 1.0 / q

    def apply(self, field: Array, out: Array) -> Array:
        """Put the displacements of stacked tractions into `out`; collective. It counts as two operators."""
        self.fft.slab.tally["operator"] += 2
        (t_x, t_y), (u_x, u_y) = components(field), components(out)
        first: Spectrum = self._other
        first[...] = self.fft.forward(t_x)
        second = self.fft.forward(t_y)
        _mix(first, second, *self._symbols)
        self.fft.backward(second, u_y)
        self.fft.backward(first, u_x)
        return out


def _coefficients(poisson: float) -> tuple[Callable[..., Array], ...]:
    """Return three functions for the displacement at a distance (x, y) from a cell under a unit traction: along x by a
    traction along x, along y by one along y, and along y by one along x."""
    along = partial(_along, poisson=poisson)
    return along, lambda x, y, dx, dy: along(y, x, dy, dx), partial(_across, poisson=poisson)


def _along(x: Array, y: Array, dx: float, dy: float, poisson: float) -> Array:
    """Return the displacement along x of a unit traction along x on a cell."""
    total = np.zeros(np.broadcast_shapes(x.shape, y.shape))
    for i, j in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        a, b = x + 0.5 * i * dx, y + 0.5 * j * dy
        ratio = np.divide(a, np.abs(b), out=np.zeros(total.shape), where=b != 0.0)
        total += i * j * b * np.arcsinh(ratio)
    return love(x, y, dx, dy, poisson) + poisson / (2.0 * np.pi) * total


def _across(x: Array, y: Array, dx: float, dy: float, poisson: float) -> Array:
    """Return the displacement along y of a unit traction along x on a cell."""
    corners = ((i, j, np.hypot(x + 0.5 * i * dx, y + 0.5 * j * dy)) for i in (-1, 1) for j in (-1, 1))
    return np.asarray(sum(-i * j * r for i, j, r in corners) * (poisson / (2.0 * np.pi)))


@loop
def _mix(first, second, along_x, along_y, across):  # type: ignore[no-untyped-def]  # numba finds the types itself
    """Replace the spectra of tractions by the spectra of displacements."""
    for j in range(first.shape[0]):
        for i in range(first.shape[1]):
            x, y = first[j, i], second[j, i]
            first[j, i] = along_x[j, i] * x + across[j, i] * y
            second[j, i] = across[j, i] * x + along_y[j, i] * y

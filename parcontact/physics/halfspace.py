"""Operators of a half space between pressure and normal displacement of the surface, at rest and in sliding.

An elastic half space of shear modulus 1 under the pressure p moves by the Boussinesq integral (paper, Eq. 1)

    u(x) = (1 - nu)/(2 pi) int p(x') / |x - x'| d2x',       in Fourier space   u^(q) = (1 - nu)/|q| p^(q).

For a modulus G divide by G. Lengths have any unit; the unit of displacements is this unit times pressure/modulus. The
kernel `spectral` uses this symbol; the kernel `love` takes the pressure as constant on each cell (`physics.love`) and
the displacement at cell centres. The mean displacement of a periodic half space is arbitrary and set to 0. Another body
multiplies the symbol by its compliance ratio (`Response`).

A pressure wave `exp(i q x)` that moves with the surface at the velocity v loads a point of a viscoelastic body at
the angular frequency `-q v`, so that in the frame of the surface

    u^(q) = (1 - nu)/(|q| G*(-q v)) p^(q).

The wake of an isolated contact is not periodic: influence coefficients are integrals along the wake (`physics.love`).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, cached_property, partial
from typing import Any, Literal

import numpy as np
from numpy.typing import DTypeLike

from ..errors import InputError
from ..parallel.fft import FFT, Cosines, Spectrum
from ..parallel.slab import Array, Tally
from . import love
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
from .love import cell_factor, wake
from .love import love as love_love
from .prony import CreepSpectrum, Prony, complex_modulus, creep_spectrum

Vector = tuple[float, float]
LEAST_SYMBOL = 1e-6  # accuracy: least compliance of a wave in a table, over that of a half space
UNIFORM = 2.113  # tuning: wavenumber times side of a square whose waves are as stiff as the square on average


@dataclass(frozen=True)
class Response:
    """Response of the surface of a body of shear modulus 1 to pressure, here of a half space; effects may return that
    of another body (`effects.effect.Effect`). Wavenumbers q and lengths have one unit; arrays have any shape."""

    thickness: float = math.inf
    poisson: float = field(default=0.5, kw_only=True)

    @property
    def mean_compliance(self) -> float:
        """Displacement per unit of uniform pressure in a periodic box."""
        return 0.0

    def compliance_ratio(self, q: Array) -> Array | float:
        """Return the ratio of the displacement under waves of pressure to that of a half space."""
        return 1.0

    def compliance(self, q: Array) -> Array:
        """Return the ratio of displacement to pressure of waves on a periodic body, without the kernel; 0 for q = 0."""
        with np.errstate(divide="ignore"):
            found = np.where(q > 0.0, (1.0 - self.poisson) / q, 0.0)
        found *= self.compliance_ratio(q)
        return found

    def stiffness(self, q: Array) -> Array:
        """Return the ratio of pressure to displacement of waves, q > 0, for a preconditioner."""
        return np.asarray(q / (1.0 - self.poisson))

    def coefficient(self, x: Array, y: Array, dx: float, dy: float) -> Array:
        """Return the displacements at distances (x, y) from a `dx x dy` cell under unit pressure, in a free box."""
        return love_love(x, y, dx, dy, self.poisson)

    def reach(self, size: Vector) -> float:
        """Return the distance beyond which points in a box hardly interact."""
        return math.inf

    def preconditioner(self, size: Vector) -> Callable[..., Any] | None:
        """Return a function that makes a preconditioner from a slab and the `contact.preconditioner` of a half space,
        for a box in which `stiffness` does not suffice; else None."""
        return None


@dataclass(frozen=True)
class HalfSpace:
    """A half space of shear modulus 1, loaded inside a box of `size = (lx, ly)` [any unit of length].

    If `free`, nothing surrounds the box, and the coefficients are Love's; with `repeats_along_x` the box is periodic
    along x only (`physics.love`). Otherwise the box is periodic, with the `kernel`. The argument `fft` of methods is
    the transform of maps: operators compute in its precision, and symbols have its shape, or the shape of the requested
    rows. A free half space makes a padded transform for each operator. `factors` multiply the storage and the loss
    modulus of waves in steady sliding, by wavenumber; None for a linear body. `other` is the response of a body that is
    no half space.
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
        """True if a uniform pressure moves the surface: not on a periodic half space, nor on another body that is
        incompressible."""
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
        """Return pressure divided by displacement of each wave, `|q|/(1 - nu)` on a half space, without the kernel.

        At q = 0, where a periodic half space has no inverse, the ratio is the value of the smallest wavenumber, which
        keeps it positive.
        """
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
        """Return the lengths of an operator's padded transform for maps with `points`; None if the operator uses the
        transform of the maps."""
        if not self.free:
            return None
        lengths = padded_lengths(*points)
        return (points[0], lengths[1]) if self.repeats_along_x else lengths

    def operator(self, fft: FFT) -> Convolution:
        """Return the operator from pressure to displacement; collective where the half space is free.

        A free box is padded with zeros to twice its size, which makes the cyclic convolution with Love's coefficients a
        linear one (paper, reference [12]). The coefficients are computed at the first use; the transforms are planned
        at once.
        """
        if not self.free:
            return Convolution(fft, partial(self.symbol, fft), fft.dtype)
        padded = FFT(fft.slab, self.own_lengths((fft.slab.nx, fft.slab.ny)), fft.dtype, fft.measured)
        table_transform(padded, inside=True)

        @cache
        def table() -> Spectrum:
            if self.repeats_along_x:
                images = partial(love.strip_coefficients, size=self.size, poisson=self.poisson)
                return tabulate(padded, self.size, images, even=True, inside=True, symmetric=False)
            return tabulate(padded, self.size, self.response.coefficient, self.other is None, inside=True)

        return Convolution(padded, lambda rows: table()[rows].real, fft.dtype, later=True)

    def inverse(self, fft: FFT) -> Convolution | MirroredConvolution:
        """Return the operator from displacement to pressure.

        The operator is exact for the periodic half space with the spectral kernel, except for the mean; otherwise, and
        for another body, it is a preconditioner. In a free box displacements are continued mirrored at the edges, so
        that they have no jump there.
        """
        if self.free and not self.repeats_along_x:
            cosines = Cosines(fft)
            return MirroredConvolution(cosines, partial(self._mirrored_inverse_symbol, cosines))
        return Convolution(fft, partial(self.inverse_symbol, fft), fft.dtype)

    def works_on_tiles(self, nx: int, ny: int) -> bool:
        """Return True if operators on tiles exist: for a half space in a free box whose cells are not long."""
        dx, dy = self.size[0] / nx, self.size[1] / ny
        return (
            self.free and not self.repeats_along_x and self.other is None and max(dx, dy) <= LONGEST_CELL * min(dx, dy)
        )

    def on_tiles(self, tiles: Tiles, tally: Tally) -> tuple[TileOperator, TileConvolution]:
        """Return the operator of a free half space on tiles of its grid, and a preconditioner for it."""
        operator = free_operator(tiles, self.size, self.poisson, self.response.coefficient, tally)
        return operator, tile_inverse(tiles, self.size, self.poisson, tally)

    # -- of contacts that stick -------------------------------------------------------------------------------------

    def gap_operators(self, fft: FFT) -> tuple[Convolution, Convolution, float, float]:
        """Return the operators of the gap solver; collective where the half space is free.

        The first operator takes pressure to displacement, and the second is its inverse, 0 for mean values. Two numbers
        follow: the displacement per unit of uniform pressure, and a factor for mean values that is always positive. A
        free body is replaced by a periodic one with the same influence coefficients up to half the box.
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
        """Return a function of rows that returns the moduli G*(-q v) of their waves, times `factors`; at a Nyquist
        wavenumber, which has two signs, the mean of both.

        The moduli broadcast to the rows: without factors all rows are equal under a surface that slides along x, and
        one is made.
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
        """Return the operator from pressure to the map h_k of branch k of a free body; collective.

        In the Laplace domain `h_k = G_k s tau_k/(1 + s tau_k) u`, which has the poles of the creep function only: each
        term i of the creep function is weighted by the response of the branch at the rate -1/l_i.
        """
        creep, modulus, tau = _creep(prony), float(prony.moduli[k]), float(prony.relaxation_times[k])
        ratio = -tau / creep.retardation_times
        shares = creep.compliances * modulus * ratio
        distinct = ratio != -1.0  # equal to rounding only for a branch of negligible modulus
        shares = np.divide(shares, 1.0 + ratio, out=np.zeros_like(shares), where=distinct)
        own = CreepSpectrum(modulus * creep.glass, shares, creep.retardation_times, 0.0)
        return self._along_wake(fft, velocity, own, np.float64)

    def _along_wake(self, fft: FFT, velocity: Vector, creep: CreepSpectrum, dtype: DTypeLike) -> Convolution:
        padded = _padded(fft, dtype)

        def coefficient(x: Array, y: Array, dx: float, dy: float) -> Array:
            return wake(x, y, dx, dy, velocity, creep) * (2.0 * (1.0 - self.poisson))

        table = tabulate(padded, self.size, coefficient)
        return Convolution(padded, table.__getitem__, padded.complex, even=not velocity[1])


def _padded(fft: FFT, dtype: DTypeLike, measured: bool = True) -> FFT:
    """Return a transform of at least twice the box of another one."""
    return FFT(fft.slab, padded_lengths(fft.slab.nx, fft.slab.ny), dtype, measured)


def _creep(prony: Prony) -> CreepSpectrum:
    creep = creep_spectrum(*prony)
    if creep.fluidity > 0.0:
        raise InputError("material: a body without long-term modulus leaves an endless wake; give it modulus_inf > 0")
    return creep

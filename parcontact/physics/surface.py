"""Heights of the rigid surface at any position, and the tangential force of a pressure on it.

Periodic parts given by waves (roughness, single waves, files) are stored as one transform and moved by a phase
`exp(-i q s)`. This is exact for any fraction of a cell in any direction, except at the Nyquist wavenumber, which is
taken as a standing wave. Shapes in closed form are evaluated at each position. Every move starts from the original.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..parallel.fft import FFT, Spectrum
from ..parallel.slab import Array, Slab
from . import loops
from .convolution import wavenumbers
from .lowest import rows_of
from .shapes import Shape

Indices = NDArray[np.intp]


@dataclass
class Surface:
    """A sum of waves and shapes on a box of `size = (lx, ly)` [m].

    `waves` is this rank's part of the transform of the periodic heights, or of its lowest waves (`lowest`), or None.
    `periodic` wraps the shapes around the box along x and y; `scale` converts m to the unit of heights; heights are
    relative to `datum` [m].
    """

    slab: Slab
    fft: FFT
    size: tuple[float, float]
    waves: Spectrum | None = None
    shapes: Sequence[Shape] = ()
    periodic: tuple[bool, bool] = (True, True)
    scale: float = 1.0
    datum: float = 0.0

    @property
    def cell(self) -> tuple[float, float]:
        return self.size[0] / self.slab.nx, self.size[1] / self.slab.ny

    def rescale(self, unit: float) -> None:
        """Change the unit of heights to `unit` [m]."""
        if self.waves is not None:
            self.waves *= 1.0 / unit / self.scale
        self.scale = 1.0 / unit

    def level(self) -> None:
        """Make heights relative to the mean of the waves, as a large constant costs digits; collective."""
        if self.waves is not None:
            owner = self.fft.columns.start == 0 < self.fft.columns.stop
            mean = self.slab.sum(float(self.waves[0, 0].real) if owner else 0.0)[0] / (self.fft.mx * self.fft.my)
            self.datum += mean / self.scale
            if owner:
                self.waves[0, 0] = 0.0

    def heights(self, shift: tuple[float, float], out: Array) -> Array:
        """Return the heights of the surface moved by `shift` [m], on the rows of this rank; collective."""
        if self.slab.only_counts:
            return out
        if self.waves is None:
            out.fill(0.0)
        else:
            loops.displace(self.waves, self._rows, *self._shift_factors(shift), self.fft.spectrum)
            self.fft.backward(self.fft.spectrum, out)
        for shape in self.shapes:
            out += self.scale * shape.height(*self._distances(shape, shift))
        return out

    def forces(self, pressure: Array, shift: tuple[float, float]) -> list[float]:
        """Return the sums over all points of pressure times slope along x and y; collective. This is Eq. 10 of the
        paper over the area of a cell; slopes are in the unit of heights over m."""
        along_x, along_y = 0.0, 0.0
        if self.waves is not None:
            transform = self.fft.forward(pressure)
            factors = *self._shift_factors(shift), *self._slope_symbols, self.fft.multiplicity.ravel()
            sums = loops.tangential(transform, self.waves, self._rows, *factors)
            along_x, along_y = (value / (self.fft.mx * self.fft.my) for value in sums)
        if self.shapes:
            points = np.nonzero(pressure)
            loads = pressure[points].astype(np.float64)
            for shape in self.shapes:
                slope_x, slope_y = self._slopes(shape, shift, *points)
                along_x += self.scale * float(loads @ slope_x)
                along_y += self.scale * float(loads @ slope_y)
        return self.slab.sum(along_x, along_y)

    # -- waves --------------------------------------------------------------------------------------------------------

    @cached_property
    def _rows(self) -> NDArray[np.int64]:
        """Rows of a spectrum that the waves have."""
        assert self.waves is not None
        return rows_of(len(self.waves), self.fft.my)

    def _shift_factors(self, shift: tuple[float, float]) -> tuple[Spectrum, Spectrum]:
        """Return the factors along x and y that move a transform by `shift`; at the Nyquist wavenumber
        their real part."""
        factors = []
        for (q, nyquist), length, s in zip(self._wavenumbers, self.size, shift, strict=True):
            phase = np.exp(-1j * q * math.fmod(s, length))
            phase[nyquist] = phase[nyquist].real
            factors.append(phase)
        return factors[0], factors[1]

    @cached_property
    def _wavenumbers(self) -> list[tuple[Array, Indices]]:
        """Wavenumbers of this rank along x and y, and the indices of the Nyquist wavenumber."""
        counts = self.fft.mx, self.fft.my
        return [
            (q.ravel(), np.flatnonzero(2 * np.abs(mode) == count))
            for q, mode, count in zip(wavenumbers(self.fft, self.size), self.fft.modes, counts, strict=True)
        ]

    @cached_property
    def _slope_symbols(self) -> tuple[Array, Array]:
        """Symbols of the slope: the wavenumber, and 0 at that of Nyquist, whose slope vanishes on the grid."""
        symbols = []
        for q, nyquist in self._wavenumbers:
            symbol = q.copy()
            symbol[nyquist] = 0.0
            symbols.append(symbol)
        return symbols[0], symbols[1]

    # -- shapes -------------------------------------------------------------------------------------------------------

    def _distances(self, shape: Shape, shift: tuple[float, float]) -> tuple[Array, Array]:
        """Return the distances from the moved centre of a shape, (1, nx) and (ny_loc, 1); from the nearest image if
        periodic."""
        rows = self.slab.rows
        x = np.arange(self.slab.nx) * self.cell[0] - shape.centre[0] - shift[0]
        y = np.arange(rows.start, rows.stop) * self.cell[1] - shape.centre[1] - shift[1]
        for distances, length, wraps in zip((x, y), self.size, self.periodic, strict=True):
            distances -= wraps * length * np.round(distances / length)
        return x[None, :], y[:, None]

    def _slopes(self, shape: Shape, shift: tuple[float, float], rows: Indices, columns: Indices) -> tuple[Array, Array]:
        """Return the slopes of a shape at given points of this rank."""
        x, y = self._distances(shape, shift)
        return shape.slope(x[0, columns], y[rows, 0])


def single_wave(fft: FFT, amplitude: float, waves: tuple[int, int], phase: float) -> Spectrum:
    """Return this rank's part of the transform of `amplitude cos(2 pi (wx x/lx + wy y/ly) + phase)`."""
    spectrum = np.zeros(fft.shape, dtype=np.complex128)
    half = 0.5 * amplitude * fft.mx * fft.my * np.exp(1j * phase)
    for sign, value in ((1, half), (-1, half.conjugate())):
        column, row = sign * waves[0] % fft.mx - fft.columns.start, sign * waves[1] % fft.my
        if 0 <= column < fft.shape[1]:
            spectrum[row, column] += value
    return spectrum

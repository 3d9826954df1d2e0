"""The rigid surface: heights at any position, motion, and tangential forces of the contact.

Periodic parts given by waves (roughness, single waves, files) are stored as one transform and moved by a phase
`exp(-i q s)`. This is exact for any fraction of a cell in any direction, except at the Nyquist wavenumber, which is
taken as a standing wave. Shapes in closed form are evaluated at each position. Each motion starts from the heights at
displacement 0, so that errors do not add up.

The heights of the rigid surface at the time t are `h(x, t) = h0(x - s(t))`, with s the displacement of the surface
[m].

Friction is computed in two ways. The force on the rigid surface is `-<p, dh/ds>` (paper, Eq. 10); the force of the
pressure on the surface of the body is `-<p, du/ds>`.

In the continuum both forces are equal, as the gap and its slope are 0 where there is pressure. On a mesh the
difference of both forces measures the mesh error of friction. On an elastic body the force on the body is exactly 0, as
the operator A is symmetric and any antisymmetric difference along s commutes with A.

Slopes are differences of the eighth order,

    du/dx = sum_k c_k (u(x + k dx) - u(x - k dx))/dx,      c = 4/5, -1/5, 4/105, -1/280,

with an error of 0.03 % for a wave of 8 cells and 3 % for a wave of 4. Unlike slopes of a Fourier series, these
differences need only points near the contact, in periodic and in free boxes.

The contact area itself causes friction, too: a shear stress tau opposes sliding on all points in contact. With the
contact area A_c and the velocity v, the force is

    F = -tau A_c v/|v|,    with tau constant, or    tau(v) = tau_0 exp(-(log10(a_T |v|/v_0)/w)^2).

The second form is a bell-shaped function of the logarithm of the velocity with its maximum at v_0, shifted by
temperature like the bulk. The paper B. Lorenz, Y. R. Oh, S. K. Nam, S. H. Jeon, B. N. J. Persson, J. Chem. Phys. 142
(2015) 194701 has c for 1/w^2. Shear does not move an incompressible half space along its normal (nu = 1/2), so that
this friction is added without a coupled solve.
"""

import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol, TextIO

import h5py
import numpy as np
from numpy.typing import NDArray

from .. import text_tables
from ..compiled import loop
from ..errors import InputError
from ..job.history import SAME_PLACE
from ..parallel import regrid
from ..parallel.fft import FFT, Spectrum
from ..parallel.slab import Array, Slab
from . import loops
from .body import MovedHeights
from .convolution import wavenumbers
from .loops import rows_of


class Shape(Protocol):
    """Heights and slopes at distances (x, y) from the centre of the shape; all lengths have one unit."""

    @property
    def centre(self) -> tuple[float, float]: ...

    def height(self, x: Array, y: Array) -> Array: ...

    def slope(self, x: Array, y: Array) -> tuple[Array, Array]: ...


def _circle(r2: Array, radius: float) -> tuple[Array, Array]:
    """Return height and slope factor of a circle; beyond the radius the height is the height of the equator."""
    inside = np.minimum(r2, radius**2)
    rest = np.sqrt(radius**2 - inside)
    inverse = np.divide(-1.0, rest, out=np.zeros_like(rest), where=rest > 0.0)
    return -inside / (radius + rest), inverse


def _inverse(distance: Array) -> Array:
    """Return the inverse of a distance, 0 at the centre."""
    return np.divide(1.0, distance, out=np.zeros_like(distance), where=distance > 0.0)


@dataclass(frozen=True)
class Conical:
    """A cone with its tip at the centre, where the height is 0; `steepness` is the slope of its side."""

    steepness: float
    centre: tuple[float, float]

    def height(self, x: Array, y: Array) -> Array:
        return -self.steepness * np.hypot(x, y)

    def slope(self, x: Array, y: Array) -> tuple[Array, Array]:
        factor = -self.steepness * _inverse(np.hypot(x, y))
        return factor * x, factor * y


@dataclass(frozen=True)
class Pyramidal:
    """A square pyramid with its tip at the centre, where the height is 0, and sides along x and y. `steepness` is the
    slope of its faces; on the edges between two faces the slope is the mean of the slopes of both."""

    steepness: float
    centre: tuple[float, float]

    def height(self, x: Array, y: Array) -> Array:
        return -self.steepness * np.maximum(np.abs(x), np.abs(y))

    def slope(self, x: Array, y: Array) -> tuple[Array, Array]:
        along_x = 0.5 * (1.0 + np.sign(np.abs(x) - np.abs(y)))
        return -self.steepness * along_x * np.sign(x), -self.steepness * (1.0 - along_x) * np.sign(y)


@dataclass(frozen=True)
class FlatEnded:
    """A round punch: a flat face of height 0 and of this `radius`, and around the face a parabola of curvature radius
    `edge`."""

    radius: float
    edge: float
    centre: tuple[float, float]

    def height(self, x: Array, y: Array) -> Array:
        beyond = np.maximum(np.hypot(x, y) - self.radius, 0.0)
        return -(beyond**2) / (2.0 * self.edge)

    def slope(self, x: Array, y: Array) -> tuple[Array, Array]:
        distance = np.hypot(x, y)
        factor = -np.maximum(distance - self.radius, 0.0) / self.edge * _inverse(distance)
        return factor * x, factor * y


@dataclass(frozen=True)
class Round:
    """A sphere, or a cylinder along x or y, with its top at the centre, where the height is 0. The profile is a
    parabola of curvature radius `radius`, or a circle if `exact`."""

    radius: float
    centre: tuple[float, float]
    along: tuple[float, float] = (1.0, 1.0)  # which coordinates the profile depends on
    exact: bool = False

    def _profile(self, x: Array, y: Array) -> tuple[Array, Array]:
        r2 = self.along[0] * x**2 + self.along[1] * y**2
        if self.exact:
            return _circle(r2, self.radius)
        return -r2 / (2.0 * self.radius), np.full_like(r2, -1.0 / self.radius)

    def height(self, x: Array, y: Array) -> Array:
        return self._profile(x, y)[0]

    def slope(self, x: Array, y: Array) -> tuple[Array, Array]:
        factor = self._profile(x, y)[1]
        return self.along[0] * x * factor, self.along[1] * y * factor


Indices = NDArray[np.intp]


@dataclass
class Surface:
    """A sum of waves and shapes on a box of `size = (lx, ly)` [m].

    `waves` is this rank's part of the transform of the periodic heights, or of the lowest waves of this transform
    (`loops.lowest`); None without periodic heights. If `periodic` along x or y, the shapes repeat in this direction
    with the length of the box. `scale` converts m to the unit of heights; heights are relative to `datum` [m].
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
        """Shift the datum of heights to the mean of the waves, because a large mean would cost digits of the heights;
        collective."""
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
        """Return the sums over all points of pressure times slope, along x and along y; collective. The sums are the
        forces on the rigid surface (paper, Eq. 10) divided by the area of a cell: a positive sum pushes the surface
        along +x or +y. Slopes are in the unit of heights per m."""
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


LONGEST_NUMBER = 1000  # tuning: characters in a line of text for each number
Values = NDArray[Any]  # of any type, as in the file


def read_heights(path: Path, dataset: str, slab: Slab, scale: float = 1.0) -> Array:
    """Return this rank's rows of a map of shape (ny, nx) in a .npy, .h5 or text file, times `scale`; collective.

    Raises InputError on every rank if a rank cannot read its rows, the shape differs, or a value is not a finite
    real number.
    """
    rows, problem = _attempt(path, dataset, slab)
    problem = next((text for text in slab.from_all(problem) if text), "")
    if not problem:
        wrong, largest = slab.reduce(
            [float(np.count_nonzero(~np.isfinite(rows)))], [float(np.abs(rows, dtype=np.float64).max(initial=0.0))]
        )
        problem = f"{path}: {wrong:.0f} of its {slab.points} heights are not finite numbers" if wrong else ""
    if problem:
        raise InputError(problem)
    text_tables.refuse_extreme(path, largest * abs(scale))
    heights = rows.astype(np.float64)
    heights *= scale
    return heights


def _attempt(path: Path, dataset: str, slab: Slab) -> tuple[Values, str]:
    """Return the rows of this rank, or a sentence on an error."""
    try:
        rows = _rows(path, dataset, slab)
        text_tables.refuse_no_numbers(path, rows.dtype)
    except InputError as error:
        return np.empty(0), str(error)
    except Exception as error:  # numpy evaluates headers; every rank must report any error
        number = getattr(error, "errno", None)
        reason = os.strerror(number) if number else str(error).partition("\n")[0]
        return np.empty(0), f"{path} cannot be read: {reason}"
    return rows, ""


def _rows(path: Path, dataset: str, slab: Slab) -> Values:
    if path.suffix == ".npy":
        whole = text_tables.open_numbers(path)
        _check(path, whole.shape, slab)
        return whole[slab.rows]
    if path.suffix == ".h5":
        with h5py.File(path) as file:
            found = file.get(dataset)
            if not isinstance(found, h5py.Dataset):
                raise InputError(f"{path} has no dataset {dataset!r}; it has {', '.join(file) or 'none'}")
            _check(path, found.shape, slab)
            return np.asarray(found[slab.rows])
    return _text(path, slab)


def _text(path: Path, slab: Slab) -> Values:
    """Read the rows of this rank from a text file with one row per line, see `text_tables`."""
    mine, count = np.empty(slab.shape), 0
    with text_tables.open_text(path) as file:
        head, rows = text_tables.number_rows(path, _short_lines(path, file, slab.nx))
        if wrong := [line for line in head if text_tables.COMMENT.sub("", line).strip()]:
            raise InputError(f"{path}: {slab.nx} numbers a line were expected, got {wrong[0].strip()[:60]!r}")
        for number, row in rows:
            if len(row) != slab.nx:
                raise InputError(f"{path}:{number} has {len(row)} numbers, but the grid has nx = {slab.nx}")
            if slab.rows.start <= count < slab.rows.stop:
                mine[count - slab.rows.start] = row
            count += 1
    _check(path, (count, slab.nx), slab)
    return mine


def _short_lines(path: Path, file: TextIO, count: int) -> Iterator[str]:
    """Yield the lines of a file. Raises InputError for a line too long for `count` numbers."""
    longest = LONGEST_NUMBER * (1 + count)
    for number, line in enumerate(iter(lambda: file.readline(longest), ""), 1):
        if len(line) == longest:
            raise InputError(f"{path}:{number} has {longest} characters or more; {count} numbers were expected")
        yield line


def _check(path: Path, shape: tuple[int, ...], slab: Slab) -> None:
    if shape != (slab.ny, slab.nx):
        raise InputError(f"{path} has shape {shape}, but the grid has (ny, nx) = {slab.ny, slab.nx}")


Vector = tuple[float, float]
PARTS = 10**9  # accuracy: positions are rounded to this fraction of a cell


def cells_between(old: Vector, new: Vector, cell: Vector) -> Vector:
    """Return the numbers of cells along x and y, not always whole, by which the surface moves from the displacement
    `old` to `new` [m]; negative for motion along -x or -y."""
    return (new[0] - old[0]) / cell[0], (new[1] - old[1]) / cell[1]


def are_whole(cells: Vector) -> bool:
    """Return True for a displacement of whole cells."""
    return all(abs(moved - round(moved)) <= SAME_PLACE for moved in cells)


class Motion(Protocol):
    """Motion of the surface, which returns its heights at a displacement [m]; collective."""

    def at(self, displacement: tuple[float, float]) -> MovedHeights: ...


class AnyFraction:
    """Motion by any fraction of a cell in any direction: the heights are computed again after each motion."""

    def __init__(self, surface: Surface) -> None:
        self._surface = surface
        self._where = (0.0, 0.0)
        self._map = surface.heights(self._where, surface.slab.empty())

    def at(self, displacement: tuple[float, float]) -> MovedHeights:
        if displacement != self._where:
            self._surface.slab.tally["shift"] += 1
            self._surface.heights(displacement, self._map)
            self._where = displacement
        return MovedHeights(self._map)


class AlongX:
    """Motion along x on a periodic box, rounded to multiples of 1/`parts` of a cell: `parts` is 1 for whole cells, or
    PARTS.

    Motion by whole cells is an index offset; the map is computed again only when the remaining fraction of a cell has
    changed.
    """

    def __init__(self, surface: Surface, parts: int = 1) -> None:
        self._surface, self._parts, self._part = surface, parts, 0
        self._map = surface.heights((0.0, 0.0), surface.slab.empty())

    def at(self, displacement: tuple[float, float]) -> MovedHeights:
        cell = self._surface.cell[0]
        whole, part = divmod(round(displacement[0] / cell * self._parts), self._parts)
        if part != self._part:
            self._surface.slab.tally["shift"] += 1
            self._surface.heights((part / self._parts * cell, 0.0), self._map)
            self._part = part
        return MovedHeights(self._map, whole % self._surface.slab.nx)


WIDTH = 4  # accuracy: number of points on each side in a difference
WEIGHTS = (4 / 5, -1 / 5, 4 / 105, -1 / 280)


def friction_by_energy(
    slab: Slab, p: Array, u: Array, cell: tuple[float, float], direction: tuple[float, float], cyclic: tuple[bool, bool]
) -> float:
    """Return the coefficient of friction `-<p, du/ds>/<p, 1>`, where s is the coordinate along the unit vector
    `direction`; collective. Heights u and lengths of `cell = (dx, dy)` may have different units; the unit of the result
    is the unit of u divided by the unit of lengths. Beyond an edge where the box is not `cyclic`, u keeps its value at
    the edge."""
    along_x, along_y = direction[0] / cell[0], direction[1] / cell[1]
    if along_y == 0.0:
        nothing = np.empty((0, slab.nx), u.dtype)
        above, below = nothing, nothing
    else:
        above, below = regrid.around(slab, u, WIDTH, cyclic[1])
    load, force = slab.sum(*_sums(p, u, above, below, along_x, along_y, cyclic[0]))
    return -force / load if load > 0.0 else math.nan


@loop
def _sums(p, u, above, below, along_x, along_y, cyclic):  # type: ignore[no-untyped-def]  # numba finds the types itself
    """Return the sums of p and of p times the slope of u; `above` and `below` are the rows next to those of this rank,
    the nearest first."""
    ny, nx = p.shape
    load, force = 0.0, 0.0
    line, slope = np.empty(nx + 2 * WIDTH), np.empty(nx)
    for j in range(ny):
        row_load = 0.0
        for i in range(nx):
            row_load += p[j, i]
        if row_load == 0.0:
            continue
        for i in range(nx):
            line[WIDTH + i] = u[j, i]
        for k in range(WIDTH):
            line[WIDTH - 1 - k] = u[j, (-1 - k) % nx] if cyclic else u[j, 0]
            line[nx + WIDTH + k] = u[j, k % nx] if cyclic else u[j, nx - 1]
        row_force, start, end = 0.0, 0, 0
        while end < nx:
            start = end
            while start < nx and p[j, start] == 0.0:
                start += 1
            end = start
            while end < nx and p[j, end] != 0.0:
                end += 1
            for i in range(start, end):
                at = i + WIDTH
                slope[i] = WEIGHTS[0] * (line[at + 1] - line[at - 1]) + WEIGHTS[1] * (line[at + 2] - line[at - 2])
                slope[i] += WEIGHTS[2] * (line[at + 3] - line[at - 3]) + WEIGHTS[3] * (line[at + 4] - line[at - 4])
                slope[i] *= along_x
            if along_y != 0.0:
                for k in range(1, WIDTH + 1):
                    weight = along_y * WEIGHTS[k - 1]
                    after = u[j + k] if j + k < ny else below[j + k - ny]
                    before = u[j - k] if j >= k else above[k - j - 1]
                    for i in range(start, end):
                        slope[i] += weight * (after[i] - before[i])
            for i in range(start, end):
                row_force += p[j, i] * slope[i]
        load += row_load
        force += row_force
    return load, force


class Shear(Protocol):
    """Friction of the contact area itself, in addition to the friction of the body."""

    def force(self, area: float, velocity: Vector) -> Vector:
        """Return the force [N] on the rigid surface that slides with `velocity` [m/s] on an area in contact [m^2]."""

    def shifted(self, factor: float) -> "Shear":
        """Return the friction at a temperature that multiplies the relaxation times of the body by `factor`."""


@dataclass(frozen=True)
class InterfaceFriction:
    """Shear stress of the contact area. If `velocity` is None, the stress is `shear_stress` [Pa] at any speed.
    Otherwise the stress is the bell of the module, with the maximum `shear_stress` at `velocity` [m/s], the `width` w
    [decades], and the factor `shift` (a_T)."""

    shear_stress: float
    velocity: float | None = None
    width: float = 1.0
    shift: float = 1.0

    def stress(self, speed: float) -> float:
        """Return the shear stress [Pa] at a sliding speed [m/s]; 0 at rest."""
        if speed <= 0.0:
            return 0.0
        if self.velocity is None:
            return self.shear_stress
        decades = math.log10(speed / self.velocity) + math.log10(self.shift)
        return self.shear_stress * math.exp(-((decades / self.width) ** 2))

    def shifted(self, factor: float) -> "InterfaceFriction":
        """Return the friction with the bell shifted by the factor a_T of the bulk."""
        return replace(self, shift=self.shift * factor)

    def force(self, area: float, velocity: Vector) -> Vector:
        """Return the force [N]; see `Shear.force`."""
        speed = math.hypot(*velocity)
        size = self.stress(speed) * area / (speed or 1.0)
        return 0.0 - size * velocity[0], 0.0 - size * velocity[1]

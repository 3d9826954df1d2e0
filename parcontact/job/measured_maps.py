"""Measured maps that are prepared for the box and the grid of a job, and measured spectra.

A map is read, cut to the box, treated (levelled, filled, made periodic), and resampled to the grid. Heights are arrays
[m] of shape (ny, nx), with NaN at missing points.

A measured spectrum describes an isotropic surface. It is a table of C2D, the spectrum of the surface, or of C1D, the
one-sided spectrum of profiles, at wavenumbers q = 2 pi/wavelength. Its columns are `q[1/m] C2D[m^4]` or `q[1/m]
C1D[m^3]`, or the same in mm, um or nm. As in `physics.roughness`, the mean square of the heights h is

    <h^2> = int C2D d2q = int_0^inf C1D dq,

and the density Phi of `physics.roughness`, by which random surfaces are made, is

    Phi = 4 pi^2 C2D,    C2D(k) = -1/(2 pi) int_k^inf C1D'(q)/sqrt(q^2 - k^2) dq    (Abel's equation).

A profile, on one row or column of points, has the C1D of the table, and Phi = 2 pi C1D.

SurfaceTopography and contact.engineering write pi C1D and 4 pi^2 C2D (T. D. B. Jacobs, T. Junge, L. Pastewka, Surf.
Topogr.: Metrol. Prop. 5 (2017) 013001): `normalisation: surface_topography` divides by these factors.

Between its points a spectrum is a power law. For Abel's integral, C1D is extrapolated beyond the last point as q^-(1 +
2 hurst) with the given Hurst exponent, or else by the power law of the last decade.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from ..errors import InputError
from ..parallel.slab import Array
from ..text_tables import read_named_columns
from . import Grid, RoughSpectrum, Topography, map_files
from .map_files import UNITS, Map

OUTLIER = 16.0  # accuracy: deviation of a height from its neighbours that makes an outlier, over the median deviation
SWEEPS = 200  # accuracy: most sweeps of the relaxation that fills missing points
TERMS = {"none": 0, "mean": 1, "tilt": 3, "curvature": 6}  # number of terms of 1, x, y, x^2, x y, y^2


@dataclass(frozen=True)
class Treated:
    """A map after `treat`: its heights [m], the number of missing points that were filled, and a mask of outliers."""

    heights: Array
    missing: int
    outliers: NDArray[np.bool_]


def treat(heights: Array, detrend: str, periodic: str, clip: bool = False) -> Treated:
    """Return a map that is levelled, filled and made periodic. If `clip` is True, outliers are replaced by the median
    of their neighbours.

    `detrend`, a key of `TERMS`, chooses the trend that is removed. `periodic` is `smooth` (`make_periodic`), `mirror`
    (the map and its mirror images, twice as long in both directions) or `none`.
    """
    known = np.isfinite(heights)
    filled = fill(remove_trend(heights, known, detrend), known)
    odd, around = find_outliers(filled)
    if clip and odd.any():
        filled = remove_trend(np.where(odd, around, filled), np.ones_like(known), detrend)
    if periodic == "smooth":
        filled = make_periodic(filled)
    elif periodic == "mirror":
        filled = np.pad(filled, [(0, count if count > 1 else 0) for count in filled.shape], mode="symmetric")
    return Treated(filled, int((~known).sum()), odd)


def remove_trend(heights: Array, known: NDArray[np.bool_], detrend: str) -> Array:
    """Return a map minus its trend, which is a constant, a plane or a paraboloid. `detrend`, a key of `TERMS`, chooses
    the kind of trend. The trend is fitted by least squares to the points in the mask `known`."""
    y, x = np.meshgrid(*(np.linspace(-1.0, 1.0, n) if n > 1 else np.zeros(1) for n in heights.shape), indexing="ij")
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y])[: TERMS[detrend]]
    trend = np.linalg.lstsq(terms[:, known].T, heights[known], rcond=None)[0]
    return heights - np.tensordot(trend, terms, 1)


def fill(heights: Array, known: NDArray[np.bool_]) -> Array:
    """Return a map whose missing points are filled by a harmonic surface through the known points around them.

    The surface is found by relaxation, which begins with the nearest known heights and takes about n^2 sweeps for a
    hole n points wide.
    """
    if known.all():
        return heights
    depth, nearest = scipy.ndimage.distance_transform_edt(~known, return_indices=True)
    found, weights = heights[tuple(nearest)], 0.25 * np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    for _ in range(min(SWEEPS, 4 * int(np.ceil(depth.max())) ** 2 + 4)):
        found = np.where(known, heights, scipy.ndimage.convolve(found, weights, mode="nearest"))
    return np.asarray(found)


def find_outliers(heights: Array) -> tuple[NDArray[np.bool_], Array]:
    """Return a mask of outliers, and a map of medians: at each point, the median of the heights of this point and its
    neighbours.

    Outliers are points whose height differs from this median by more than `OUTLIER` times the median of all such
    differences. At its edges the map is continued with the same slope.
    """
    around = scipy.ndimage.median_filter(np.pad(heights, 1, mode="reflect", reflect_type="odd"), 3)[1:-1, 1:-1]
    deviation = np.abs(heights - around)
    typical = float(np.median(deviation[deviation > 0.0])) if deviation.any() else np.inf
    return np.asarray(deviation > OUTLIER * typical), around


def is_periodic(heights: Array) -> bool:
    """Return True if, along both directions, the rms difference between opposite edges of a map is at most the largest
    rms difference between neighbouring lines of points inside the map."""
    for rows in (heights, heights.T):
        jumps = np.sqrt(np.mean((np.roll(rows, -1, axis=0) - rows) ** 2, axis=1))
        if jumps[-1] > jumps[:-1].max(initial=0.0):
            return False
    return True


def make_periodic(heights: Array) -> Array:
    """Return the map minus its harmonic part, the smoothest map with the same jumps from edge to opposite edge.

    The harmonic part is large only at the edges, so that slopes inside hardly change (L. Moisan, J. Math. Imaging Vis.
    39 (2011) 161).
    """
    jumps = np.zeros_like(heights)
    for edges, rows in ((jumps, heights), (jumps.T, heights.T)):
        edges[0] += rows[0] - rows[-1]
        edges[-1] -= rows[0] - rows[-1]
    y, x = scipy.fft.fftfreq(heights.shape[0])[:, None], scipy.fft.rfftfreq(heights.shape[1])
    symbol = 2.0 * np.cos(2 * np.pi * y) + 2.0 * np.cos(2 * np.pi * x) - 4.0
    symbol[0, 0] = np.inf
    return np.asarray(heights + scipy.fft.irfft2(scipy.fft.rfft2(jumps) / symbol, s=heights.shape))


def resample(
    heights: Array, shape: tuple[int, int], joined: bool = True, most: tuple[float, float] | None = None
) -> Array:
    """Return a map on a grid of `shape` (ny, nx) by its Fourier series.

    Waves that the grid does not resolve, and Nyquist waves of an even grid, are removed. If `most` is given, only waves
    within an ellipse of wave numbers are kept: its half axes are the numbers of waves `most` along y and along x. A map
    that is not `joined` does not continue across its edges: its harmonic part (`make_periodic`) is resampled by
    splines.
    """
    old = heights.shape
    if old == shape and most is None:
        return heights
    periodic = heights if joined else make_periodic(heights)
    spectrum, kept = scipy.fft.fft2(periodic), np.zeros(shape, dtype=complex)
    (ky, kx) = (np.arange(-((min(pair) - 1) // 2), (min(pair) - 1) // 2 + 1) for pair in zip(old, shape, strict=True))
    ky = ky[:, None]
    inside = (ky / most[0]) ** 2 + (kx / most[1]) ** 2 <= 1.0 if most else True
    kept[ky, kx] = np.where(inside, spectrum[ky, kx], 0.0)
    made = scipy.fft.ifft2(kept).real * (kept.size / spectrum.size)
    if not joined:
        places = np.meshgrid(*(np.arange(new) * n / new for n, new in zip(old, shape, strict=True)), indexing="ij")
        made += scipy.ndimage.map_coordinates(heights - periodic, places, order=3, mode="nearest")
    return np.asarray(made)


SLACK = 1e-6  # rounding: relative excess of the box over the map that is ignored


@dataclass(frozen=True)
class Prepared:
    """A measured map that is prepared for a box: its heights [m] on the grid, of shape (ny, nx) and zero mean.

    `part` is the shape in the job, `whole` the map in the file, `cut` the heights [m] of the part of the map that lies
    in the box, `treated` these heights after treatment, and `size` [m] the size of this part along x and y.
    """

    heights: Array
    part: Topography
    whole: map_files.Map
    cut: Array
    treated: Treated
    size: tuple[float, float]


def prepare(part: Topography, grid: Grid, found: map_files.Map) -> Prepared:
    """Return the measured map `found` on the grid of the job, after the treatment that the shape `part` asks for. Root
    only. Raises InputError for a map that is smaller than the box."""
    periodic = part.periodic or ("smooth" if any(grid.cyclic) else "none")
    copies = part.copies
    rows, columns = (
        _range(part, axis, grid.size[axis] / copies, found.size[axis], found.heights.shape[1 - axis], grid.points[axis])
        for axis in (1, 0)
    )
    cut, size = found.heights[rows, columns], (grid.lx / copies, grid.ly / copies)
    if np.isnan(cut).any() and not part.fill:
        raise InputError(f"{part.path}: {int(np.isnan(cut).sum())} of its points are missing; give fill: true")
    done, short = treat(cut, part.detrend, periodic, part.outliers == "clip"), part.short_wavelength
    most = (grid.ly / short * (1.0 + SLACK), grid.lx / short * (1.0 + SLACK)) if short else None
    joined = periodic != "none" or (all(grid.cyclic) and is_periodic(done.heights))
    heights = resample(done.heights, (grid.ny, grid.nx), joined, most)
    return Prepared(heights - heights.mean(), part, found, cut, done, size)


def _range(part: Topography, axis: int, length: float, available: float, count: int, points: int) -> slice:
    """Return the range of points of the map along an axis that is as long as the box with its `points`."""
    name = "xy"[axis]
    if length > available * (1.0 + SLACK):
        raise InputError(
            f"{part.path}: the box is {length:.6g} m along {name}, but the map only {available:.6g} m; use a smaller "
            "grid.size, or periodic: mirror, which needs half the length"
        )
    wanted = min(count, max(1, round(count * length / available)))
    if wanted < 2 <= points:
        raise InputError(
            f"{part.path}: the box is {length:.3g} m along {name}, below the spacing of points of the map, "
            f"{available / count:.3g} m; use a larger grid.size, or a finer map"
        )
    if part.centre is None:
        first = (count - wanted) // 2
        return slice(first, first + wanted)
    first = round(part.centre[axis] / available * count - wanted / 2)
    if not 0 <= first <= count - wanted:
        raise InputError(
            f"{part.path}: a box of {length:.6g} m around {part.centre[axis]:.6g} m along {name} leaves the map of "
            f"{available:.6g} m; a centre of {length / 2:.6g} to {available - length / 2:.6g} m was expected"
        )
    return slice(first, first + wanted)


POWERS = {"C1D": 3, "C2D": 4}  # power of the length in the unit of a spectrum
LARGER = {3: np.pi, 4: 4 * np.pi**2}  # factors in SurfaceTopography's spectra, by the power of their unit
BINS = 10  # tuning: bins per decade of wavenumbers of a line scan
FEWEST_OF_LINE = 32  # tuning: least points of a line scan
FEWEST_RINGS = 3  # accuracy: least rows of a spectrum
ABEL_POINTS = 20_001  # accuracy: points of the trapezoidal rule for Abel's integral
ABEL_DECADES = 4.0  # accuracy: decades of q beyond the last point, over which C1D' falls by more than 8 decades
NOTHING = 1e-20  # rounding: smallest C2D, over the largest one: (relative rounding error of heights)^2
EDGE = 1e-9  # rounding: relative difference below which wavelengths are the same
WAVE_UNITS = "1/{}", "rad/{}", "{}^-1", "{}-1"
FORMS = "q[1/m] C2D[m^4] or q[1/m] C1D[m^3] (or mm, um, nm)"


@dataclass(frozen=True)
class MeasuredSpectrum:
    """The spectrum of an isotropic surface or of a profile. `phi` is its density [m^4 for a surface, m^3 for a profile]
    at rising wavenumbers `q` [rad/m], both of shape (n,). Beyond the last wavenumber the density falls with the power
    -`fall` of q, or is 0 if `fall` is 0."""

    q: Array
    phi: Array
    fall: float

    def __call__(self, k: Array) -> Array:
        """Return Phi at wavenumbers `k` [rad/m]."""
        inside = (k >= self.q[0] * (1 - EDGE)) & ((k <= self.q[-1] * (1 + EDGE)) | (self.fall > 0.0))
        with np.errstate(divide="ignore"):
            log = np.interp(np.log(k), np.log(self.q), np.log(self.phi))
            log -= self.fall * np.maximum(np.log(k / self.q[-1]), 0.0)
        return np.where(inside, np.exp(log), 0.0)


def read_spectrum(part: RoughSpectrum, line: bool) -> tuple[MeasuredSpectrum, tuple[float, float]]:
    """Return the spectrum of a job's surface, or of a profile if `line` is True, and its longest and shortest
    wavelengths [m]. Raises InputError for an unreadable table. If `line` is True, a table of C2D, which belongs to a
    surface, also raises InputError."""
    q, values, power = _read(part.spectrum)
    if part.normalisation == "surface_topography":
        values = values / LARGER[power]
    if line and power == POWERS["C2D"]:
        raise InputError(
            f"{part.spectrum}: C2D is the spectrum of a surface, and the job has one row of points; give the spectrum "
            "C1D of a profile along the row, or several rows of points"
        )
    if not line and power == POWERS["C1D"]:
        q, values = _over_directions(part.spectrum, q, values, part.hurst)
    fall = 2.0 * (1.0 + part.hurst) - line if part.hurst is not None else 0.0
    longest, shortest = 2 * np.pi / q[0], 2 * np.pi / q[-1]
    wanted = part.long_wavelength or longest, part.short_wavelength or shortest
    if wanted[0] > longest * (1 + EDGE):
        raise InputError(f"{part.spectrum}: long_wavelength is {wanted[0]:.6g} m, but the data end at {longest:.6g} m")
    if wanted[1] < shortest * (1 - EDGE) and part.hurst is None:
        raise InputError(
            f"{part.spectrum}: short_wavelength is {wanted[1]:.6g} m, but the data end at {shortest:.6g} m; give hurst "
            "to extrapolate them by a power law"
        )
    return MeasuredSpectrum(q, _density(values, line), fall), wanted


def _density(values: Array, line: bool) -> Array:
    """Return Phi from C1D of a line, or from C2D."""
    return (2.0 * np.pi if line else 4.0 * np.pi**2) * values


def of_scan(part: Topography, scan: Map, line: bool) -> tuple[MeasuredSpectrum, tuple[float, float]]:
    """Return the spectrum of an isotropic surface from a line scan, or of a profile if `line` is True, and its longest
    and shortest wavelengths [m].

    C1D of the levelled scan is computed with Hann's window, and averaged over `BINS` parts of each decade of
    wavenumbers. Raises InputError.
    """
    heights, length = scan.heights, scan.size[0]
    if heights.size < FEWEST_OF_LINE or np.nanmin(heights) == np.nanmax(heights):
        raise InputError(f"{part.path}: a line scan of at least {FEWEST_OF_LINE} points, not flat, was expected")
    level = remove_trend(heights, np.isfinite(heights), part.detrend)[0]
    known = np.isfinite(level)
    places = np.arange(level.size)
    level = np.interp(places, places[known], level[known])
    window = np.sin(np.pi * (places + 0.5) / level.size) ** 2
    level -= np.average(level, weights=window)
    power = np.abs(np.fft.rfft(level * window) / level.size) ** 2 / np.mean(window**2)
    waves = np.arange(2, (level.size + 1) // 2)  # the window does not distinguish one wave from the mean
    bins = np.floor(BINS * np.log10(waves / 2)).astype(int)
    q, c1 = (
        (np.bincount(bins, values) / np.maximum(np.bincount(bins), 1))[np.unique(bins)]
        for values in (2 * np.pi / length * waves, length / np.pi * power[waves])
    )
    kept, values = (q, c1) if line else _over_directions(part.path, q, c1, None)
    ends = 2 * np.pi / kept[0], part.short_wavelength or 2 * np.pi / kept[-1]
    return MeasuredSpectrum(kept, _density(values, line), 0.0), ends


def _read(path: Path) -> tuple[Array, Array, int]:
    """Return wavenumbers [rad/m], the spectrum [m^3 or m^4], and the power of m in its unit."""
    table = read_named_columns(path, f"a table of {FORMS}", FORMS, {"q", *POWERS}, _are_enough)
    if not _are_enough(set(table.columns)):
        named = ", ".join(table.columns) or "none of them"
        raise InputError(f"{path}: {FORMS} were expected, with q = 2 pi/wavelength; the first lines name {named}")
    if len(table.lines) < FEWEST_RINGS:
        raise InputError(f"{path} has {len(table.lines)} rows of numbers; at least {FEWEST_RINGS} were expected")
    (kind,) = POWERS.keys() & table.columns
    power = POWERS[kind]
    q, values = np.array(table.columns["q"]), np.array(table.columns[kind])
    if (wrong := np.flatnonzero((q <= 0.0) | (values <= 0.0))).size:
        raise InputError(f"{path}:{table.lines[wrong[0]]}: two positive numbers were expected")
    if (wrong := np.flatnonzero(np.diff(q) <= 0.0)).size:
        raise InputError(f"{path}:{table.lines[wrong[0] + 1]}: q must rise from line to line")
    waves = {form.format(unit): 1.0 / size for unit, size in UNITS.items() for form in WAVE_UNITS}
    powers = {form.format(unit, power): size**power for unit, size in UNITS.items() for form in ("{}^{}", "{}{}")}
    return q * table.unit("q", waves), values * table.unit(kind, powers), power


def _are_enough(names: set[str]) -> bool:
    """Return True if names are those of a spectrum: q, and one of C1D and C2D."""
    return "q" in names and len(names & POWERS.keys()) == 1


def _over_directions(path: Path, q: Array, c1: Array, hurst: float | None) -> tuple[Array, Array]:
    """Return wavenumbers and C2D from C1D, between the first and the last positive value of C2D.

    Where C2D is negative between them (C1D rises or scatters) it is set to NOTHING times its maximum.
    """
    log_q, log_c = np.log(q), np.log(c1)
    last = log_q >= log_q[-1] - np.log(10.0)
    last[-2:] = True
    fall = 1.0 + 2.0 * hurst if hurst is not None else -float(np.polyfit(log_q[last], log_c[last], 1)[0])
    if fall <= 0.0:
        raise InputError(f"{path}: C1D rises in its last decade; profiles of isotropic surfaces have a falling C1D")
    slopes = np.append(np.diff(log_c) / np.diff(log_q), -fall)
    c2 = np.array([_abel(k, log_q, log_c, slopes) for k in log_q])
    good = c2 > 0.0
    if good.sum() < FEWEST_RINGS:
        raise InputError(f"{path}: C1D does not fall with q; profiles of isotropic surfaces have a falling C1D")
    used = slice(np.flatnonzero(good)[0], np.flatnonzero(good)[-1] + 1)
    return q[used], np.where(good, c2, NOTHING * c2.max())[used]


def _abel(log_k: float, log_q: Array, log_c: Array, slopes: Array) -> float:
    """Return -1/(2 pi) int C1D'(k cosh t) dt, for power laws between the points, by the trapezoidal rule in t."""
    t = np.linspace(0.0, log_q[-1] - log_k + ABEL_DECADES * np.log(10.0), ABEL_POINTS)
    log = log_k + np.log(np.cosh(t))
    piece = np.clip(np.searchsorted(log_q, log, "right") - 1, 0, None)
    derivative = slopes[piece] * np.exp(log_c[piece] + slopes[piece] * (log - log_q[piece]) - log)
    return -float(np.trapezoid(derivative, t)) / (2 * np.pi)

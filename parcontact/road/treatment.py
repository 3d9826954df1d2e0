"""Treatment of a measured map before it is pressed on a body: filled, levelled, made periodic, resampled.

Maps are arrays of shape (ny, nx), x last; missing points are NaN.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage

from ..parallel.slab import Array

Detrend = Literal["none", "mean", "tilt", "curvature"]
Periodic = Literal["none", "smooth", "window", "mirror"]
OUTLIER = 16.0  # accuracy: times the median deviation of heights from their neighbours: further off gets a warning
TAPER = 0.1  # tuning: share of each side over which a window falls to 0
SWEEPS = 200  # accuracy: of relaxation that fill holes smoothly, on each of the coarser maps


@dataclass(frozen=True)
class Treated:
    """A map without missing points, and what was done to it: how many points were missing, which are outliers,
    the plane or paraboloid taken off (coefficients of 1, x, y, x^2, x y, y^2 over the box from -1 to 1, in units of
    height), by which factor a window has `enlarged` what is inside."""

    heights: Array
    missing: int
    outliers: NDArray[np.bool_]
    trend: tuple[float, ...]
    enlarged: float


def treat(heights: Array, detrend: Detrend, periodic: Periodic) -> Treated:
    """Fill, level and make periodic; `mirror` doubles the map along both directions."""
    known = np.isfinite(heights)
    trend = find_trend(heights, known, detrend)
    level = heights - surface_of(trend, heights.shape)
    filled = fill(level, known)
    odd = find_outliers(filled)
    make = {"smooth": make_periodic, "window": taper, "mirror": mirror}.get(periodic)
    made = np.ascontiguousarray(make(filled) if make else filled)
    enlarged = 1.0 / _window(made.shape)[1] if periodic == "window" else 1.0
    return Treated(made, int((~known).sum()), odd, tuple(map(float, trend)), enlarged)


def repeated(heights: Array) -> tuple[float, int]:
    """Return a height that occurs several times, further from all others than these are from each other, and how often;
    (0, 0) if there is none. So it is with a number that stands for missing points."""
    for height in (np.nanmin(heights), np.nanmax(heights)):
        others = heights[np.isfinite(heights) & (heights != height)]
        count = int(np.count_nonzero(heights == height))
        if count > 1 and others.size and np.abs(others - height).min() > np.ptp(others):
            return float(height), count
    return 0.0, 0


def _terms(shape: tuple[int, ...], detrend: Detrend) -> Sequence[Array]:
    y, x = (np.linspace(-1.0, 1.0, n) if n > 1 else np.zeros(n) for n in shape)
    one, x, y = np.ones(shape), np.broadcast_to(x, shape), np.broadcast_to(y[:, None], shape)
    terms = [one, x, y, x * x, x * y, y * y]
    return terms[: {"none": 0, "mean": 1, "tilt": 3, "curvature": 6}[detrend]]


def find_trend(heights: Array, known: NDArray[np.bool_], detrend: Detrend) -> Array:
    """The coefficients of a plane or paraboloid nearest to the known heights, by least squares."""
    terms = _terms(heights.shape, detrend)
    if not terms:
        return np.zeros(0)
    columns = np.stack([term[known] for term in terms], axis=1)
    return np.asarray(np.linalg.lstsq(columns, heights[known], rcond=None)[0])


def surface_of(trend: Array, shape: tuple[int, ...]) -> Array:
    """The trend as a map."""
    names: dict[int, Detrend] = {0: "none", 1: "mean", 3: "tilt", 6: "curvature"}
    terms = _terms(shape, names[len(trend)])
    return np.asarray(sum((c * term for c, term in zip(trend, terms, strict=True)), np.zeros(shape)))


def fill(heights: Array, known: NDArray[np.bool_]) -> Array:
    """Missing points filled by the harmonic surface through the known ones around them (a soap film).

    Relaxed from the nearest known height, so that a hole of n points across needs some n^2 sweeps.
    """
    if known.all():
        return heights
    nearest = ndimage.distance_transform_edt(~known, return_distances=False, return_indices=True)
    found = heights[tuple(nearest)]
    depth = int(np.ceil(ndimage.distance_transform_edt(~known).max()))
    weights = np.array([[0.0, 0.25, 0.0], [0.25, 0.0, 0.25], [0.0, 0.25, 0.0]])
    for _ in range(min(SWEEPS, 4 * depth**2 + 4)):
        found = np.where(known, heights, ndimage.convolve(found, weights, mode="nearest"))
    return np.asarray(found)


def find_outliers(heights: Array) -> NDArray[np.bool_]:
    """Return which points stick out of the median of their neighbours by far more than the median deviation; beyond the
    edges slopes go on."""
    padded = np.pad(heights, 1, mode="reflect", reflect_type="odd")
    apart = np.abs(heights - ndimage.median_filter(padded, 3)[1:-1, 1:-1])
    typical = float(np.median(apart[apart > 0.0])) if np.any(apart > 0.0) else 0.0
    return np.asarray(apart > OUTLIER * max(typical, np.finfo(float).tiny))


def make_periodic(heights: Array) -> Array:
    """The periodic part of a map: what is left without the smoothest map that has the same jumps across its edges.

    It differs from the map by a harmonic function of the jumps, which is strong at the edges only: inside, slopes and
    curvatures stay as they are. (L. Moisan, J. Math. Imaging Vis. 39 (2011) 161.)
    """
    ny, nx = heights.shape
    jumps = np.zeros_like(heights)
    across = heights[0] - heights[-1]
    jumps[0] += across
    jumps[-1] -= across
    along = heights[:, 0] - heights[:, -1]
    jumps[:, 0] += along
    jumps[:, -1] -= along
    symbol = 2.0 * np.cos(2 * np.pi * np.arange(ny) / ny)[:, None] + 2.0 * np.cos(2 * np.pi * fft.rfftfreq(nx)) - 4.0
    symbol[0, 0] = 1.0
    spectrum = fft.rfft2(jumps) / symbol
    spectrum[0, 0] = 0.0
    return np.asarray(heights + fft.irfft2(spectrum, s=heights.shape))


def taper(heights: Array) -> Array:
    """The map less its mean, taken to 0 at the edges by cosines, and enlarged so that its mean square stays."""
    weight, rms = _window(heights.shape)
    return np.asarray((heights - heights.mean()) * weight / rms)


def _window(shape: tuple[int, ...]) -> tuple[Array, float]:
    """Return a window that is 1 inside, and its root mean square."""
    along_y, along_x = map(_cosines, shape)
    weight = np.asarray(along_y[:, None] * along_x)
    return weight, float(np.sqrt(np.mean(weight**2)))


def _cosines(count: int) -> Array:
    distance = np.minimum(np.arange(count), np.arange(count)[::-1]) + 0.5
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.minimum(distance / max(TAPER * count, 1.0), 1.0)))


def mirror(heights: Array) -> Array:
    """The map and its mirror images, twice as long along both directions (but not along one with a single point)."""
    for axis, count in enumerate(heights.shape):
        if count > 1:
            heights = np.concatenate([heights, np.flip(heights, axis)], axis)
    return heights


def resample(heights: Array, shape: tuple[int, int]) -> Array:
    """A periodic map on a grid of (ny, nx) points, by its Fourier series; waves that the grid has not are left out.

    Nothing is left at the Nyquist wavenumber of an even grid, where a wave has no direction.
    """
    if heights.shape == shape:
        return heights
    old, spectrum = heights.shape, fft.fft2(heights)
    kept = np.zeros(shape, dtype=complex)
    rows, columns = (_shared(a, b) for a, b in zip(old, shape, strict=True))
    kept[np.ix_(rows % shape[0], columns % shape[1])] = spectrum[np.ix_(rows % old[0], columns % old[1])]
    return np.asarray(fft.ifft2(kept).real * (shape[0] * shape[1] / (old[0] * old[1])))


def _shared(old: int, new: int) -> NDArray[np.intp]:
    """Wavenumbers that both grids have, below the Nyquist wavenumber of either."""
    highest = (min(old, new) - 1) // 2
    return np.arange(-highest, highest + 1)


def resample_open(heights: Array, shape: tuple[int, int]) -> Array:
    """A map that is not periodic on another grid: its periodic part by Fourier series, the smooth rest by splines."""
    if heights.shape == shape:
        return heights
    periodic = make_periodic(heights)
    rest = heights - periodic
    axes = [np.arange(new) * old / new for old, new in zip(heights.shape, shape, strict=True)]
    smooth = ndimage.map_coordinates(rest, np.meshgrid(*axes, indexing="ij"), order=3, mode="nearest")
    return np.asarray(resample(periodic, shape) + smooth)

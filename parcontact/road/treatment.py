"""Treat a measured map: level, fill, make periodic, resample. Maps have the shape (ny, nx); missing points are NaN."""

from dataclasses import dataclass

import numpy as np
import scipy  # its parts are imported when they are used
from numpy.typing import NDArray

from ..parallel.slab import Array

OUTLIER = 16.0  # accuracy: deviation of a height from its neighbours that makes an outlier, over the median deviation
SWEEPS = 200  # accuracy: most sweeps of the relaxation that fills missing points
TERMS = {"none": 0, "mean": 1, "tilt": 3, "curvature": 6}  # number of terms of 1, x, y, x^2, x y, y^2


@dataclass(frozen=True)
class Treated:
    """A map without missing points, how many were `missing`, and which are `outliers`."""

    heights: Array
    missing: int
    outliers: NDArray[np.bool_]


def treat(heights: Array, detrend: str, periodic: str, clip: bool = False) -> Treated:
    """Level and fill a map, optionally clip outliers, and make it periodic by `smooth`, by `mirror` (doubles its length
    along both directions) or not (`none`)."""
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
    """Return a map without its mean, plane or paraboloid, by least squares over known points."""
    y, x = np.meshgrid(*(np.linspace(-1.0, 1.0, n) if n > 1 else np.zeros(1) for n in heights.shape), indexing="ij")
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y])[: TERMS[detrend]]
    trend = np.linalg.lstsq(terms[:, known].T, heights[known], rcond=None)[0]
    return heights - np.tensordot(trend, terms, 1)


def fill(heights: Array, known: NDArray[np.bool_]) -> Array:
    """Fill missing points by the harmonic surface through their neighbours, relaxed from the nearest known height in
    about n^2 sweeps for a hole n points wide."""
    if known.all():
        return heights
    depth, nearest = scipy.ndimage.distance_transform_edt(~known, return_indices=True)
    found, weights = heights[tuple(nearest)], 0.25 * np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    for _ in range(min(SWEEPS, 4 * int(np.ceil(depth.max())) ** 2 + 4)):
        found = np.where(known, heights, scipy.ndimage.convolve(found, weights, mode="nearest"))
    return np.asarray(found)


def find_outliers(heights: Array) -> tuple[NDArray[np.bool_], Array]:
    """Return the mask of points that differ from the median of their neighbours by more than OUTLIER median deviations,
    and these medians; beyond the edges slopes are extrapolated."""
    around = scipy.ndimage.median_filter(np.pad(heights, 1, mode="reflect", reflect_type="odd"), 3)[1:-1, 1:-1]
    deviation = np.abs(heights - around)
    typical = float(np.median(deviation[deviation > 0.0])) if deviation.any() else np.inf
    return np.asarray(deviation > OUTLIER * typical), around


def is_periodic(heights: Array) -> bool:
    """Return True if the rms jump across opposite edges of a map is at most the largest rms increment inside it, along
    both directions."""
    for rows in (heights, heights.T):
        jumps = np.sqrt(np.mean((np.roll(rows, -1, axis=0) - rows) ** 2, axis=1))
        if jumps[-1] > jumps[:-1].max(initial=0.0):
            return False
    return True


def make_periodic(heights: Array) -> Array:
    """Return the map minus the smoothest map with the same jumps across its edges.

    This harmonic part is large at the edges only, so slopes inside stay (L. Moisan, J. Math. Imaging Vis. 39 (2011)
    161).
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
    """Return a map on a grid of (ny, nx) points by its Fourier series.

    Waves that the grid does not resolve, Nyquist waves of an even grid, and waves beyond the ellipse of `most` waves
    along y and x are removed. The harmonic part of a map that is not `joined` at its edges is resampled by splines.
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

"""Statistics of a map: spectra, rms values, Nayak's parameter, the Hurst exponent of a self-affine range.

    C2(q) = <|h^(q)|^2>/(Lx Ly)/(4 pi^2)   over directions, with h^ = int h exp(-i q x) d2x,   <h^2> = int C2 d2q,
    C1(q) along one direction, one-sided: <h^2> = int_0^inf C1 dq.

(B. N. J. Persson et al., J. Phys.: Condens. Matter 17 (2005) R1; P. R. Nayak, J. Lubr. Technol. 93 (1971) 398;
T. D. B. Jacobs, T. Junge, L. Pastewka, Surf. Topogr.: Metrol. Prop. 5 (2017) 013001, whose C2 is 4 pi^2 times ours.)
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import fft

from ..parallel.slab import Array

BINS = 12  # tuning: per decade of wavenumbers
FEWEST = 5  # accuracy: bins that a Hurst exponent is fitted to
WHOLE = 0.99  # accuracy: share of the square slope up to which waves belong to a surface
NARROWEST = math.log(3.0)  # of a range of wavenumbers
STEADY = 0.3  # accuracy: rms of the logarithm around a power law above which a range is not self-affine
FLAT, STEEP = -2.0, -4.2  # physics: slopes of Hurst exponents 0, and 1 with scatter; beyond, nothing is self-affine


@dataclass(frozen=True)
class Statistics:
    """Statistics of a periodic map of (ny, nx) points on (lx, ly) [m]: rms height [m], slope [-], and curvature [1/m],
    half of the Laplacian; Nayak's parameter; `q`, shape (n,) [1/m], with `psd_2d` [m^4] and the spectra along x
    and y, `psd_x`, `psd_y` [m^3] at `qx`, `qy`; `hurst`, with the standard error `hurst_error` of its fit, is NaN where
    no power law holds."""

    rms_height: float
    rms_slope: float
    rms_curvature: float
    nayak: float
    q: Array
    psd_2d: Array
    qx: Array
    psd_x: Array
    qy: Array
    psd_y: Array
    hurst: float
    hurst_error: float


def surface_statistics(heights: Array, size: tuple[float, float]) -> Statistics:
    """Return the statistics of a map, from its Fourier series."""
    ny, nx = heights.shape
    power = np.abs(fft.fft2(heights - heights.mean()) / (nx * ny)) ** 2
    qx, qy = (2 * np.pi * fft.fftfreq(n, length / n) for n, length in zip((nx, ny), size, strict=True))
    square = qx**2 + qy[:, None] ** 2
    m0, m2, m4 = (float(np.sum(power * square**k)) for k in range(3))
    q, psd, _ = _over_directions(np.sqrt(square), power, size)
    windowed = np.abs(fft.fft2(_under_window(heights)) / (nx * ny)) ** 2
    along_x, along_y = (_along(power.sum(axis=axis), length) for axis, length in ((0, size[0]), (1, size[1])))
    nayak = 1.5 * m0 * m4 / m2**2 if m2 > 0.0 else math.nan  # isotropic: m0 m4/m2^2 of profiles
    hurst = _fit_hurst(*_over_directions(np.sqrt(square), windowed, size))
    return Statistics(math.sqrt(m0), math.sqrt(m2), 0.5 * math.sqrt(m4), nayak, q, psd, *along_x, *along_y, *hurst)


def _under_window(heights: Array) -> Array:
    """Return a map under a Hann window, without its mean there: what joins its edges, a jump or a smooth part that was
    taken off, has no share in its spectrum."""
    along = [np.hanning(n + 1)[:-1] if n > 1 else np.ones(1) for n in heights.shape]
    window = along[0][:, None] * along[1]
    return np.asarray((heights - (window * heights).sum() / window.sum()) * window / math.sqrt((window**2).mean()))


def _over_directions(q: Array, power: Array, size: tuple[float, float]) -> tuple[Array, Array, Array]:
    """Means over rings of wavenumbers, and the number of waves in each, which have an area 4 pi^2/(Lx Ly)."""
    cell = 4 * np.pi**2 / (size[0] * size[1])
    known = q > 0.0
    if not known.any():
        return np.empty(0), np.empty(0), np.empty(0)
    low, high = float(q[known].min()), float(q.max())
    count = max(2, math.ceil(BINS * math.log10(high / low))) if high > low else 1
    edges = np.geomspace(low * (1 - 1e-9), high * (1 + 1e-9), count + 1)
    place = np.digitize(q[known], edges) - 1
    number = np.bincount(place, minlength=count)
    full = number > 0
    sums = [np.bincount(place, weights=values, minlength=count)[full] for values in (np.log(q[known]), power[known])]
    return np.exp(sums[0] / number[full]), sums[1] / number[full] / cell, number[full].astype(float)


def _along(power: Array, length: float) -> tuple[Array, Array]:
    """Wavenumbers above 0 and the one-sided spectrum along one direction."""
    highest = (power.size - 1) // 2
    both = power[1 : highest + 1] + power[-1 : -highest - 1 : -1]
    return 2 * np.pi / length * np.arange(1, highest + 1), both * length / (2 * np.pi)


def _fit_hurst(q: Array, psd: Array, number: Array) -> tuple[float, float]:
    """Return the exponent from the slope of log C2 over log q, -2 (1 + H), in the widest range that is a power law, and
    its standard error. Rings count by their `number` of waves, as the mean over n waves scatters by n^-1/2.

    Waves beyond those that make up the slopes are what an instrument, a filter or an edge has left.
    """
    slopes = np.cumsum(psd * q**4)  # of rings as wide as their wavenumbers, as these are spaced
    used = (psd > 0.0) & (slopes <= WHOLE * slopes[-1:].sum())
    x, y, weights = np.log(q[used]), np.log(psd[used]), number[used]
    best, found = 0.0, (math.nan, math.nan)
    for first in range(x.size - FEWEST):
        for last in range(first + FEWEST, x.size + 1):
            if x[last - 1] - x[first] <= max(best, NARROWEST):
                continue
            part = slice(first, last)
            slope, error, rms = _fit_line(x[part], y[part], weights[part])
            if rms < STEADY and STEEP < slope < FLAT:
                best, found = float(x[last - 1] - x[first]), (-slope / 2.0 - 1.0, error / 2.0)
    return found


def _fit_line(x: Array, y: Array, weights: Array) -> tuple[float, float, float]:
    """Return the slope of a weighted straight line, its standard error from what is left (H. White, Econometrica 48
    (1980) 817), and the rms of that."""
    x, y = x - np.average(x, weights=weights), y - np.average(y, weights=weights)
    moment = float((weights * x * x).sum())
    slope = float((weights * x * y).sum()) / moment
    left = y - slope * x
    error = math.sqrt(float(((weights * x * left) ** 2).sum()) * x.size / (x.size - 2)) / moment
    return slope, error, math.sqrt(float(np.mean(left**2)))

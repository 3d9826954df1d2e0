"""Statistics of a map: spectra, rms values, Nayak's parameter, the Hurst exponent of a self-affine range.

    C2(q) = <|h^(q)|^2>/(Lx Ly)/(4 pi^2)   averaged over directions, with h^ = int h exp(-i q x) d2x,
    C1(q) along one direction, one-sided,  so that <h^2> = int C2 d2q = int_0^inf C1 dq.

(B. N. J. Persson et al., J. Phys.: Condens. Matter 17 (2005) R1; P. R. Nayak, J. Lubr. Technol. 93 (1971) 398; T. D.
B. Jacobs, T. Junge, L. Pastewka, Surf. Topogr.: Metrol. Prop. 5 (2017) 013001, in which C2 is defined 4 pi^2 times as
large as here.)"""

import math
from dataclasses import dataclass

import numpy as np
from numpy import fft

from ..parallel.slab import Array

BINS = 12  # tuning: bins per decade of wavenumbers
FEWEST = 5  # accuracy: least number of bins for a Hurst exponent
WHOLE = 0.99  # accuracy: share of the mean square slope in waves used for a Hurst exponent
NARROWEST = math.log(3.0)  # least range of log wavenumber for a Hurst exponent
STEADY = 0.3  # accuracy: largest rms deviation of log C2 from a power law
FLAT, STEEP = -2.0, -4.2  # physics: slopes of log C2 for Hurst exponents 0, and 1 with scatter


@dataclass(frozen=True)
class Statistics:
    """Statistics of a periodic map of (ny, nx) points on a box of (lx, ly) [m].

    * rms_height [m], rms_slope, and rms_curvature [1/m], where the curvature is half of the Laplacian;
    * nayak: Nayak's parameter;
    * q [rad/m], psd_2d [m^4]: wavenumbers, and the spectrum C2 of the module, both of shape (n,);
    * qx, qy [rad/m], psd_x, psd_y [m^3]: wavenumbers along x and y, and the spectra C1 along x and y;
    * hurst, hurst_error: Hurst exponent and its standard error, NaN if no power law fits.
    """

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
    """Return the statistics of a map of heights [m] on a box of `size` [m], from its Fourier series."""
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
    """Return a map under a Hann window, without its windowed mean. The window removes jumps at the edges and smooth
    parts that were subtracted."""
    along = [np.hanning(n + 1)[:-1] if n > 1 else np.ones(1) for n in heights.shape]
    window = along[0][:, None] * along[1]
    return np.asarray((heights - (window * heights).sum() / window.sum()) * window / math.sqrt((window**2).mean()))


def _over_directions(q: Array, power: Array, size: tuple[float, float]) -> tuple[Array, Array, Array]:
    """Return means over rings of wavenumbers, and the number of waves in each ring; a wave has the area 4
    pi^2/(Lx Ly)."""
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
    """Return the wavenumbers above 0 and the one-sided spectrum along one direction."""
    highest = (power.size - 1) // 2
    both = power[1 : highest + 1] + power[-1 : -highest - 1 : -1]
    return 2 * np.pi / length * np.arange(1, highest + 1), both * length / (2 * np.pi)


def _fit_hurst(q: Array, psd: Array, number: Array) -> tuple[float, float]:
    """Return the Hurst exponent H from the slope -2 (1 + H) of log C2 over log q in the widest range with a power law,
    and its standard error. Rings are weighted by their `number` of waves, as the mean over n waves scatters by n^-1/2.

    Waves that hardly contribute to slopes are excluded: they depend on instruments, filters and edges.
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
    """Return the slope of a weighted line, its standard error from the residuals (H. White, Econometrica 48 (1980)
    817), and their rms."""
    x, y = x - np.average(x, weights=weights), y - np.average(y, weights=weights)
    moment = float((weights * x * x).sum())
    slope = float((weights * x * y).sum()) / moment
    left = y - slope * x
    error = math.sqrt(float(((weights * x * left) ** 2).sum()) * x.size / (x.size - 2)) / moment
    return slope, error, math.sqrt(float(np.mean(left**2)))

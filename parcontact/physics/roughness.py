"""Rough surfaces: random self-affine surfaces from their power spectral density Phi, and statistics of maps.

At the wavenumber k [rad/m], with the roll-off k_r, the density [m^4] is (paper, Eqs. 12 and 13)

    Phi(k) = C                             long-wavelength end <= k < roll-off
             C (k/k_r)^(-2 (1 + hurst))    roll-off <= k < short-wavelength end

The transform of the heights h satisfies `|FFT(h)|^2 = Phi (nx ny)^2 / area`. On one row or column of points the
surface is a profile along it, whose Phi [m^3] is that of its waves with k > 0: `<h^2> = int Phi dk/(2 pi)`, and area
stands for twice its length. The random numbers of a wave come from
a stream that depends on the seed and on the wavenumber along x: a seed gives the same waves on every grid and any
number of ranks, and no rank holds the whole spectrum.

Statistics of a map are its spectra, rms values, Nayak's parameter, and the Hurst exponent of a self-affine range:

    C2(q) = <|h^(q)|^2>/(Lx Ly)/(4 pi^2)   averaged over directions, with h^ = int h exp(-i q x) d2x,
    C1(q) along one direction, one-sided,  so that <h^2> = int C2 d2q = int_0^inf C1 dq.

(B. N. J. Persson et al., J. Phys.: Condens. Matter 17 (2005) R1; P. R. Nayak, J. Lubr. Technol. 93 (1971) 398; T. D.
B. Jacobs, T. Junge, L. Pastewka, Surf. Topogr.: Metrol. Prop. 5 (2017) 013001, in which C2 is defined 4 pi^2 times as
large as here.)
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy import fft

from ..errors import InputError
from ..parallel.fft import FFT, Spectrum
from ..parallel.slab import Array
from .convolution import wavenumbers
from .loops import rows_of

BEYOND = 0.01  # accuracy: share of the mean square slope in waves that `shortest_wave` ignores
BIN = 0.01  # accuracy: width of bins in log wavenumber; the error of a shortest wave is half of it
EDGE = 1.0 - 1e-9  # accuracy: factor on limits of wavenumbers, against rounding


@dataclass(frozen=True)
class Roughness:
    """Parameters of a random surface; lengths in m. One of `rms_slope`, `rms_height` and `psd_constant` (C of the
    module, m^4, m^3 for a profile) is given.

    `stretch` is a ratio and an angle from the x axis [rad]. With the wavenumbers k_along the direction of this angle
    and k_across, Phi is a function of the length of the vector (ratio k_along, k_across), so that waves along the angle
    are longer by this ratio than waves across.
    """

    hurst: float
    long_wavelength: float
    rolloff_wavelength: float
    short_wavelength: float
    seed: int = 0
    random_amplitudes: bool = True
    rms_slope: float | None = None
    rms_height: float | None = None
    psd_constant: float | None = None
    stretch: tuple[float, float] = (1.0, 0.0)
    measured: Callable[[Array], Array] | None = None  # Phi/C at k instead of the power law

    def density(self, k: Array) -> Array:
        """Return Phi(k)/C at wavenumbers k [rad/m]."""
        k_long, k_rolloff, k_short = (
            2 * np.pi / length for length in (self.long_wavelength, self.rolloff_wavelength, self.short_wavelength)
        )
        inside = (k >= EDGE * k_long) & (k < EDGE * k_short)
        if self.measured is not None:
            return np.where(inside, self.measured(np.where(inside, k, k_long)), 0.0)
        return np.where(inside, np.maximum(k / k_rolloff, 1.0) ** (-2.0 * (1.0 + self.hurst)), 0.0)

    def spectrum(self, fft: FFT, size: tuple[float, float]) -> Spectrum:
        """Return this rank's part of the Fourier transform of random heights [m] on a box of `size` [m]; collective.
        Raises InputError if no wave of the box lies within the limits."""
        kx, ky = wavenumbers(fft, size)
        k, (ratio, angle) = np.hypot(kx, ky), self.stretch
        along, across = kx * np.cos(angle) + ky * np.sin(angle), ky * np.cos(angle) - kx * np.sin(angle)
        waves = np.sqrt(self.density(k if ratio == 1.0 else np.hypot(ratio * along, across))) * self._random(fft, size)
        power = fft.multiplicity * np.abs(waves) ** 2
        square_height, square_slope = fft.slab.sum(float(power.sum()), float((power * k**2).sum()))
        if square_height == 0.0:
            limits = f"{self.short_wavelength:g} m and {self.long_wavelength:g} m"
            raise InputError(f"a rough surface has no wave between {limits} that fits the box and the grid")
        area = size[0] * size[1]
        if (fft.mx == 1) != (fft.my == 1):  # a profile, whose waves k and -k share Phi
            area = 2.0 * (size[1] if fft.mx == 1 else size[0])
        return np.asarray(waves * (self._amplitude(square_height, square_slope, area) * fft.mx * fft.my))

    def _amplitude(self, square_height: float, square_slope: float, area: float) -> float:
        """Return the factor for a surface of C = area = 1 with the given mean squares."""
        if self.rms_slope is not None:
            return float(self.rms_slope / np.sqrt(square_slope))
        if self.rms_height is not None:
            return float(self.rms_height / np.sqrt(square_height))
        if self.psd_constant is not None:
            return float(np.sqrt(self.psd_constant / area))
        raise ValueError("one of rms_slope, rms_height and psd_constant is needed")

    def _key(self, index_x: int) -> list[int]:
        """Return the seed of the waves with one wavenumber along x; seeds of more than 64 bits are hashed."""
        if self.seed < 2**64:
            return [self.seed, index_x]
        return np.random.SeedSequence([self.seed, index_x]).generate_state(2, np.uint64).tolist()

    def _random(self, fft: FFT, size: tuple[float, float]) -> Spectrum:
        """Return random complex amplitudes of mean square 1 (modulus 1 if fixed) for the waves within the limits."""
        waves = np.zeros(fft.shape, dtype=np.complex128)
        last_x, last_y = (int(length / self.short_wavelength) for length in size)
        index_y = _alternating(min(last_y, (fft.my - 1) // 2))
        for column, index_x in enumerate(range(fft.columns.start, min(fft.columns.stop, last_x + 1))):
            stream = np.random.Generator(np.random.Philox(key=self._key(index_x)))
            phase, square = stream.random((index_y.size, 2)).T
            modulus = np.sqrt(-np.log1p(-square)) if self.random_amplitudes else 1.0
            amplitude = modulus * np.exp(2j * np.pi * phase)
            if index_x == 0:  # the heights are real: waves along y come in conjugate pairs
                positive = index_y > 0
                waves[index_y[positive], column] = amplitude[positive]
                waves[-index_y[positive], column] = amplitude[positive].conj()
            else:
                waves[index_y, column] = amplitude
        return waves


def _alternating(last: int) -> Array:
    """Return 0, 1, -1, 2, -2, ..., last, -last, so that further waves do not change the numbers of the first ones."""
    count = np.arange(1, last + 1)
    return np.concatenate([[0], np.stack([count, -count], axis=1).ravel()])


@dataclass(frozen=True)
class Moments:
    """Spectral moments of an isotropic surface, and parameters that follow from them (SI units)."""

    m0: float
    m2: float
    m4: float

    @property
    def rms_height(self) -> float:
        return float(np.sqrt(self.m0))

    @property
    def rms_slope(self) -> float:
        """Rms magnitude of the gradient."""
        return float(np.sqrt(2.0 * self.m2))

    @property
    def nayak(self) -> float:
        """Nayak's parameter m0 m4/m2^2, the breadth of the spectrum."""
        return self.m0 * self.m4 / self.m2**2 if self.m2 > 0.0 else float("nan")


def moments(spectrum: Spectrum, fft: FFT, size: tuple[float, float]) -> Moments:
    """Return m0 = <h^2>, m2 = <|grad h|^2>/2 and m4 = (3/8) <(laplace h)^2> of a map from its transform; collective.
    The lowest waves suffice if the map has no others."""
    q, power = _powers(spectrum, fft, size)
    q2 = q**2
    m0, m2, m4 = fft.slab.sum(*(float(np.sum(power * weight)) for weight in (1.0, q2 / 2, 3 * q2**2 / 8)))
    return Moments(m0, m2, m4)


def shortest_wave(spectrum: Spectrum, fft: FFT, size: tuple[float, float]) -> float:
    """Return the wavelength [m] below which all waves together have at most the share BEYOND of the mean square slope;
    infinite for a flat map. Arguments are as in `moments`. Collective."""
    q, power = _powers(spectrum, fft, size)
    low = 2 * np.pi / max(size)
    highest = np.pi * np.hypot(fft.mx / size[0], fft.my / size[1])
    count = max(int(np.log(highest / low) / BIN), 0) + 2  # a single point has waves shorter than the box only
    place = (np.log(np.maximum(q / low, 1.0)) / BIN).astype(np.intp)
    slopes = np.array(fft.slab.sum(*np.bincount(place.ravel(), (power * q**2).ravel(), count).tolist()))
    shorter = np.cumsum(slopes[::-1])[::-1]
    if shorter[0] == 0.0:
        return float("inf")
    return float(2 * np.pi / low * np.exp(-BIN * (0.5 + np.flatnonzero(shorter > BEYOND * shorter[0])[-1])))


def _powers(spectrum: Spectrum, fft: FFT, size: tuple[float, float]) -> tuple[Array, Array]:
    """Return this rank's wavenumbers, and the mean square height of each wave; 0 for the mean."""
    rows, columns = rows_of(len(spectrum), fft.my), slice(spectrum.shape[1])
    qx, qy = wavenumbers(fft, size)
    q = np.hypot(qx[:, columns], qy[rows])
    power = fft.multiplicity[:, columns] * np.abs(spectrum) ** 2 / (fft.mx * fft.my) ** 2
    power[q == 0.0] = 0.0
    return q, power


# statistics of maps

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

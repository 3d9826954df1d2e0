"""Random self-affine surfaces from their power spectral density Phi (paper, Eqs. 12 and 13).

At the wavenumber k [rad/m], with the roll-off k_r, the density [m^4] is

    Phi(k) = C                             long-wavelength end <= k < roll-off
             C (k/k_r)^(-2 (1 + hurst))    roll-off <= k < short-wavelength end

The transform of the heights h satisfies `|FFT(h)|^2 = Phi (nx ny)^2 / area`. The random numbers of a wave come from
a stream that depends on the seed and on the wavenumber along x: a seed gives the same waves on every grid and any
number of ranks, and no rank holds the whole spectrum.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

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
    module, m^4) is given.

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
        return np.asarray(waves * (self._amplitude(square_height, square_slope, size) * fft.mx * fft.my))

    def _amplitude(self, square_height: float, square_slope: float, size: tuple[float, float]) -> float:
        """Return the factor for a surface of C = area 1 m^4 with the given mean squares."""
        if self.rms_slope is not None:
            return float(self.rms_slope / np.sqrt(square_slope))
        if self.rms_height is not None:
            return float(self.rms_height / np.sqrt(square_height))
        if self.psd_constant is not None:
            return float(np.sqrt(self.psd_constant / (size[0] * size[1])))
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

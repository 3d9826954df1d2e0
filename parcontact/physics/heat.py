"""Heat of sliding: by how much the surface of a conducting half space is warmed by heat that moves over it.

Heat q [W/m^2] on the surface of a body of conductivity kappa and diffusivity D, below a contact that slides at the
velocity v, warms it in the steady state, seen from the contact, by

    T^(k) = q^(k)/(kappa beta),     beta(k) = sqrt(k^2 - i k.v/D),     Re beta > 0                                (1)

(H. S. Carslaw, J. C. Jaeger, Conduction of Heat in Solids (1959), section 10.7). No heat leaves through the surface
elsewhere. Heat from the depth z arrives with the factor exp(-beta z). A wave of the wavenumber q on an incompressible
half space has strains whose squares add up to `(q z)^2 exp(-2 q z)` times a constant, the same under crests and
troughs, so that its heat, `4 q (q z)^2 exp(-2 q z) dz` of the whole, lies `3/(2 q)` deep in the mean and arrives with

    int 4 q^3 z^2 exp(-(2 q + beta) z) dz = (1 + beta/(2 q))^-3.                                                  (2)

A uniform heat has no steady state in a periodic box: temperatures are relative to the mean of the box there.
"""

from dataclasses import dataclass

import numpy as np

from ..parallel.fft import FFT, Spectrum
from ..parallel.slab import Array, deal
from .convolution import ALL, PARTS, Convolution, travelling_wavenumbers, wavenumbers
from .halfspace import HalfSpace
from .prony import Prony, complex_modulus

Vector = tuple[float, float]
LAYER_DEPTH = 3.0  # wavenumber times thickness from which on heat lies half a thickness deep


@dataclass(frozen=True)
class Conductor:
    """A material that conducts heat: conductivity [W/(m K)] and diffusivity [m^2/s]."""

    conductivity: float
    diffusivity: float

    @property
    def effusivity(self) -> float:
        """The conductivity over the root of the diffusivity [W s^(1/2)/(m^2 K)]."""
        return float(self.conductivity / np.sqrt(self.diffusivity))


@dataclass(frozen=True)
class Depths:
    """How deep the heat of the body lies: the share that waves of each of the wavenumbers [1/m] dissipate."""

    wavenumbers: Array
    shares: Array

    def arriving(self, beta: Spectrum) -> Spectrum:
        """Return the factor (2), of any shape, in the mean over the waves."""
        total = np.zeros_like(beta)
        for q, share in zip(self.wavenumbers, self.shares, strict=True):
            total += share * (1.0 + beta / (2.0 * q)) ** -3
        return total


def sliding_heat(
    fft: FFT, size: Vector, body: Conductor, velocity: Vector, depths: Depths | None = None
) -> Convolution:
    """Return heat [W/m^2] -> temperature rise [K] in a periodic box of `size` [m] below a contact that slides steadily
    at `velocity` [m/s], with the heat on the surface or at `depths`; exact for each wave but those of Nyquist."""

    def part(rows: slice) -> Spectrum:
        beta = _beta(fft, size, body, velocity, rows)
        symbol = np.divide(1.0 / body.conductivity, beta, out=np.zeros_like(beta), where=beta != 0.0)
        return symbol if depths is None else symbol * depths.arriving(beta)

    return Convolution(fft, part, fft.complex, even=not velocity[1])


def _beta(fft: FFT, size: Vector, body: Conductor, velocity: Vector, rows: slice = ALL) -> Spectrum:
    """Return beta of these rows of a spectrum [1/m]; its root with a positive real part."""
    square = np.hypot(*wavenumbers(fft, size, rows)) ** 2
    along_x, along_y = travelling_wavenumbers(fft, size, rows)
    return np.sqrt(square - 1j * (along_x * velocity[0] + along_y * velocity[1]) / body.diffusivity)


def depths_of(spectrum: Spectrum, fft: FFT, body: HalfSpace, unit: float, velocity: Vector, prony: Prony) -> Depths:
    """Return how deep a body dissipates under a pressure of this spectrum that slides at `velocity` [m/s]; collective.

    `unit` [m] is that of the size of the body. A wave loses `|p^|^2 A w Im(-1/G*(w))` with A its compliance and w its
    frequency. Waves are put together by octaves of their length, each with its mean
    wavenumber; on a layer the heat lies half its thickness deep at most.
    """
    longest = max(body.size)
    bins = 2 + int(np.log2(np.hypot(fft.mx, fft.my)))
    sums = np.zeros((2, bins))
    for rows in deal(fft.my, PARTS):
        q = np.hypot(*wavenumbers(fft, body.size, rows))
        along_x, along_y = travelling_wavenumbers(fft, body.size, rows)
        omega = np.abs(along_x * velocity[0] + along_y * velocity[1] if velocity[1] else along_x * velocity[0]) / unit
        loss = omega * np.imag(-1.0 / complex_modulus(omega, *prony))
        power = fft.multiplicity * np.abs(spectrum[rows]) ** 2 * body.symbol(fft, rows) * loss
        octave = np.log2(np.maximum(q * longest / (2.0 * np.pi), 1.0)).astype(np.int64).ravel()
        for total, weight in zip(sums, (power, power * q), strict=True):
            total += np.bincount(octave, weight.ravel(), bins)[:bins]
    powers, moments = np.reshape(fft.slab.sum(*sums.ravel()), sums.shape)
    there = powers > 0.0
    found = moments[there] / powers[there] / unit
    if body.layer is not None:
        found = np.maximum(found, LAYER_DEPTH / (body.layer.thickness * unit))
    return Depths(found, powers[there] / powers.sum() if there.any() else powers[there])

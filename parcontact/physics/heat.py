"""Heat of sliding: by how much the surface of a conducting half space is warmed by heat that moves over it.

Heat q [W/m^2] on the surface of a body of conductivity kappa and diffusivity D, below a contact that slides at the
velocity v, warms it in the steady state, seen from the contact, by

    T^(k) = q^(k)/(kappa beta),     beta(k) = sqrt(k^2 - i k.v/D),     Re beta > 0                                (1)

(H. S. Carslaw, J. C. Jaeger, Conduction of Heat in Solids (1959), section 10.7). No heat leaves through the surface
elsewhere. Heat from the depth z arrives with the factor exp(-beta z). A wave of the wavenumber q on an incompressible
half space has strains whose squares add up to `(q z)^2 exp(-2 q z)` times a constant, the same under crests and
troughs, so that its heat, `4 q (q z)^2 exp(-2 q z) dz` of the whole, lies `3/(2 q)` deep in the mean and arrives with

    int 4 q^3 z^2 exp(-(2 q + beta) z) dz = (1 + beta/(2 q))^-3.                                                  (2)

The rubber that dissipates lies there too, and feels the mean temperature over these depths. With waves cos(m z) along
the depth, of which this distribution has the share

    g(m) = int 4 q^3 z^2 exp(-2 q z) cos(m z) dz = Re (1 - i m/(2 q))^-3,                                         (3)

heat of the body warms the depths where it is made by `2/(pi kappa) int g^2/(beta^2 + m^2) dm` in place of (1).

A uniform heat has no steady state: after a sliding time t it has warmed a body that was cold by `2 q sqrt(t/pi)/e`,
with the effusivity `e = kappa/sqrt(D)`, and each wave by `erf(beta sqrt(D t))` times (1). Without an end of time,
temperatures in a periodic box are relative to its mean.
"""

from dataclasses import dataclass

import numpy as np

from ..parallel.fft import FFT, Spectrum
from ..parallel.slab import Array, deal
from .convolution import ALL, PARTS, Convolution, travelling_wavenumbers, wavenumbers
from .halfspace import HalfSpace
from .prony import Prony, complex_modulus

Vector = tuple[float, float]
SPACING, LOWEST, HIGHEST = 0.3, 1e-5, 30.0  # accuracy: of waves along the depth, in ln m, and over wavenumbers
BINS = 16  # accuracy: of wavenumbers in an octave: flash temperatures differ by 1e-4 from those of all waves
LAYER_DEPTH = 3.0  # physics: wavenumber times thickness from which on heat lies half a thickness deep


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
    """How deep the heat of the body lies: the share that waves of each of the wavenumbers [1/m] dissipate.

    Integrals over waves along the depth stand for (2): they go with a finite time and with both depths alike.
    """

    wavenumbers: Array
    shares: Array

    def cosines(self, m: Array) -> Array:
        """Return the shares (3) of waves [1/m] along the depth, in the mean over the waves."""
        square = (0.5 * m / self.wavenumbers[:, None]) ** 2
        return np.asarray(self.shares @ ((1.0 - 3.0 * square) / (1.0 + square) ** 3))

    def warmed(self, beta: Spectrum, felt: bool, reach: float = np.inf) -> Spectrum:
        """Return the temperature over heat and 1/kappa [m] after diffusion over `reach = D t` [m^2]: that of the
        surface or, if `felt`, that in the depths where heat is made; to 1e-5."""
        total = np.zeros_like(beta)
        for m, weight in zip(*self._waves(felt), strict=True):
            square = beta**2 + m**2
            total += weight * (-np.expm1(-square * reach) if reach < np.inf else 1.0) / square
        return total

    def staying(self, tau: Array) -> Array:
        """Return what is left after diffusion over `tau = D t` [m^2], `2/pi int g^2 exp(-m^2 tau) dm` [1/m]."""
        total = np.zeros_like(tau)
        for m, weight in zip(*self._waves(True), strict=True):
            total += weight * np.exp(-(m**2) * tau)
        return total

    def _waves(self, felt: bool) -> tuple[Array, Array]:
        """Return waves m [1/m] and their weights in integrals of g or g^2 over m, by the trapezoidal rule in ln m."""
        if not self.wavenumbers.size:
            return np.zeros(0), np.zeros(0)
        low, high = np.log(LOWEST * self.wavenumbers.min()), np.log(HIGHEST * self.wavenumbers.max())
        m = np.exp(np.linspace(low, high, 1 + int((high - low) / SPACING)))
        weights = 2.0 / np.pi * np.log(m[1] / m[0]) * m * self.cosines(m) ** (2 if felt else 1)
        weights[0] /= -np.expm1(-np.log(m[1] / m[0]))  # with all below
        m[0] = 0.0
        return m, weights


def sliding_heat(
    fft: FFT,
    size: Vector,
    body: Conductor,
    velocity: Vector,
    depths: Depths | None = None,
    felt: bool = False,
    time: float = np.inf,
) -> Convolution:
    """Return heat [W/m^2] -> temperature rise [K] in a periodic box of `size` [m] below a contact that has slid
    steadily at `velocity` [m/s] for a `time` [s], with the heat on the surface or at `depths`; exact for each wave but
    those of Nyquist.

    The temperature is that of the surface, or, if `felt`, that in the depths where the heat is made.
    """
    reach = body.diffusivity * time

    def part(rows: slice) -> Spectrum:
        beta = _beta(fft, size, body, velocity, rows)
        mean = beta == 0.0
        beta[mean] = 1e-9 / max(size)
        symbol = _on_surface(beta, reach) if depths is None else depths.warmed(beta, felt, reach)
        if time == np.inf:
            symbol[mean] = 0.0
        return symbol / body.conductivity

    return Convolution(fft, part, fft.complex, even=not velocity[1])


def _on_surface(beta: Spectrum, reach: float) -> Spectrum:
    from scipy.special import erf

    return (erf(beta * np.sqrt(reach)) if reach < np.inf else 1.0) / beta


def _beta(fft: FFT, size: Vector, body: Conductor, velocity: Vector, rows: slice = ALL) -> Spectrum:
    """Return beta of these rows of a spectrum [1/m]; its root with a positive real part."""
    square = np.hypot(*wavenumbers(fft, size, rows)) ** 2
    along_x, along_y = travelling_wavenumbers(fft, size, rows)
    return np.sqrt(square - 1j * (along_x * velocity[0] + along_y * velocity[1]) / body.diffusivity)


def depths_of(spectrum: Spectrum, fft: FFT, body: HalfSpace, unit: float, velocity: Vector, prony: Prony) -> Depths:
    """Return how deep a body dissipates under a pressure of this spectrum that slides at `velocity` [m/s]; collective.

    `unit` [m] is that of the size of the body. A wave loses `|p^|^2 A w Im(-1/G*(w))` with A its compliance and w its
    frequency; one that does not move loses nothing. Waves are put together that differ by less than a part of an
    octave (BINS), each with its mean wavenumber; on a layer the heat lies half its thickness deep at most.
    """
    longest = max(body.size)
    bins = 1 + int(BINS * (1.0 + np.log2(np.hypot(fft.mx, fft.my))))
    sums = np.zeros((2, bins))
    for rows in deal(fft.my, PARTS):
        q = np.hypot(*wavenumbers(fft, body.size, rows))
        along_x, along_y = travelling_wavenumbers(fft, body.size, rows)
        omega = np.abs(along_x * velocity[0] + along_y * velocity[1] if velocity[1] else along_x * velocity[0]) / unit
        modulus = complex_modulus(omega, *prony)
        loss = np.divide(omega * modulus.imag, np.abs(modulus) ** 2, out=np.zeros_like(omega), where=omega > 0.0)
        power = fft.multiplicity * np.abs(spectrum[rows]) ** 2 * body.symbol(fft, rows) * loss
        place = (BINS * np.log2(np.maximum(q * longest / (2.0 * np.pi), 1.0))).astype(np.int64).ravel()
        for total, weight in zip(sums, (power, power * q), strict=True):
            total += np.bincount(place, weight.ravel(), bins)[:bins]
    powers, moments = np.reshape(fft.slab.sum(*sums.ravel()), sums.shape)
    there = powers > 0.0
    found = moments[there] / powers[there] / unit
    if body.layer is not None:
        found = np.maximum(found, LAYER_DEPTH / (body.layer.thickness * unit))
    return Depths(found, powers[there] / powers.sum() if there.any() else powers[there])

"""Heat of sliding: temperature rise of the surface of a conducting half space under moving heat.

Heat q [W/m^2] on the surface of a body of conductivity kappa and diffusivity D, below a contact that slides at the
velocity v, causes the steady temperature rise, in the frame of the contact,

    T^(k) = q^(k)/(kappa beta),     beta(k) = sqrt(k^2 - i k.v/D),     Re beta > 0                                (1)

(H. S. Carslaw, J. C. Jaeger, Conduction of Heat in Solids (1959), section 10.7). The rest of the surface is insulated.
Heat from the depth z arrives with the factor exp(-beta z). A wave of the wavenumber q on an incompressible half space
has strains whose squares add up to a constant times `(q z)^2 exp(-2 q z)`, the same under crests and troughs. So its
heat has the distribution `4 q (q z)^2 exp(-2 q z) dz`, the mean depth `3/(2 q)`, and arrives with

    int 4 q^3 z^2 exp(-(2 q + beta) z) dz = (1 + beta/(2 q))^-3.                                                  (2)

The rubber that dissipates lies at these depths, too, and has their mean temperature. With waves cos(m z) along the
depth, of which this distribution has the share

    g(m) = int 4 q^3 z^2 exp(-2 q z) cos(m z) dz = Re (1 - i m/(2 q))^-3,                                         (3)

heat of the body warms the depths where it is released by `2/(pi kappa) int g^2/(beta^2 + m^2) dm` instead of (1).

A uniform heat has no steady state: after a sliding time t it has warmed a cold body by `2 q sqrt(t/pi)/e`, with the
effusivity `e = kappa/sqrt(D)`, and each wave by `erf(beta sqrt(D t))` times (1). For an infinite time, temperatures in
a periodic box are relative to its mean.
"""

from dataclasses import dataclass

import numpy as np

from ...parallel.fft import FFT, Spectrum
from ...parallel.slab import Array, deal
from ...physics.convolution import ALL, PARTS, Convolution, travelling_wavenumbers, wavenumbers
from ...physics.halfspace import HalfSpace
from ...physics.prony import Prony, complex_modulus

Vector = tuple[float, float]
SPACING, LOWEST, HIGHEST = 0.3, 1e-5, 30.0  # accuracy: waves m along the depth: spacing of ln m; limits over q
BINS = 16  # accuracy: bins of wavenumbers per octave; the error of flash temperatures is 1e-4
LAYER_DEPTH = 3.0  # physics: least wavenumber times thickness of a layer: heat lies at most half a thickness deep


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
    """Depths of the heat of the body: the share of it that waves of each wavenumber [1/m] dissipate.

    Integrals over waves along the depth replace (2), as they also hold for a finite time and for heat felt at depth.
    """

    wavenumbers: Array
    shares: Array

    def cosines(self, m: Array) -> Array:
        """Return the shares (3) of waves m [1/m] along the depth, averaged over the waves."""
        square = (0.5 * m / self.wavenumbers[:, None]) ** 2
        return np.asarray(self.shares @ ((1.0 - 3.0 * square) / (1.0 + square) ** 3))

    def warmed(self, beta: Spectrum, felt: bool, reach: float = np.inf) -> Spectrum:
        """Return the temperature over heat, times kappa [m], after diffusion over `reach = D t` [m^2]: that of the
        surface or, if `felt`, that at the depths where heat is released; to 1e-5."""
        total = np.zeros_like(beta)
        for m, weight in zip(*self._waves(felt), strict=True):
            square = beta**2 + m**2
            total += weight * (-np.expm1(-square * reach) if reach < np.inf else 1.0) / square
        return total

    def staying(self, tau: Array) -> Array:
        """Return the rest after diffusion over `tau = D t` [m^2], `2/pi int g^2 exp(-m^2 tau) dm` [1/m]."""
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
        weights[0] /= -np.expm1(-np.log(m[1] / m[0]))  # includes all waves below
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
    """Return the operator from heat [W/m^2] to temperature rise [K] in a periodic box of `size` [m] below a contact
    that has slid steadily at `velocity` [m/s] for a `time` [s].

    The heat is on the surface or at `depths`. The temperature is that of the surface or, if `felt`, that at the
    depths where the heat is released. It is exact for each wave except those of Nyquist.
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
    """Return beta [1/m] for these rows of a spectrum, the root with a positive real part."""
    square = np.hypot(*wavenumbers(fft, size, rows)) ** 2
    along_x, along_y = travelling_wavenumbers(fft, size, rows)
    return np.sqrt(square - 1j * (along_x * velocity[0] + along_y * velocity[1]) / body.diffusivity)


def depths_of(spectrum: Spectrum, fft: FFT, body: HalfSpace, unit: float, velocity: Vector, prony: Prony) -> Depths:
    """Return the depths at which a body dissipates under a pressure of this spectrum, sliding at `velocity` [m/s];
    collective.

    `unit` [m] is the length unit of the body. A wave loses `|p^|^2 A w Im(-1/G*(w))` with its compliance A and
    frequency w. Waves are combined in BINS per octave, each with its mean wavenumber. On a layer the heat lies at
    most half its thickness deep.
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

"""Temperature of the surface of a conducting half space under heat that changes with time: `effects.heat.heat` in time
steps.

Each wave (j, k) of the sum of exponentials (`physics.exponentials`), along the depth and along the surface, satisfies

    dc/dt = -(m_j^2 + D k^2) c + q^(k, t) g_j,     T^(k) = sum_j w_j c_j/e,                                       (1)

with the effusivity e. q is linear in time within a step, over which (1) is solved exactly. For heat on the surface g =
1; for heat of the body it is the share (3) of `heat` of the wave m_j/sqrt(D) along the depth. The temperature
at the depths where this heat is released is `sum_j w_j g_j c_j/e`.

The mean of the box (k = 0) has its own sum, of numbers, exact to 1e-9 at any time, so that no heat is lost.
"""

from dataclasses import dataclass

import numpy as np

from ...parallel.fft import FFT, Spectrum
from ...parallel.slab import Array, allocate
from ...physics import loops
from ...physics.convolution import wavenumbers
from ...physics.exponentials import Exponentials, fit_exponentials, shares_of_step
from .heat import Conductor, Depths, Vector

MEAN_TIMES, MEAN_ERROR = (
    (1e-12, 1e12),
    1e-9,
)  # accuracy: times [s] and relative error of the sum for the mean of the box


@dataclass(frozen=True)
class Heating:
    """Heat in one step [W/m^2, mean over the box], at its beginning and end: on `rubbed` points, and in the body in
    proportion to the pressure, at `depths`."""

    rubbed: tuple[float, float] = (0.0, 0.0)
    pressed: tuple[float, float] = (0.0, 0.0)
    depths: Depths | None = None

    @property
    def whole(self) -> tuple[float, float]:
        """The sum of both."""
        return self.rubbed[0] + self.pressed[0], self.rubbed[1] + self.pressed[1]


def along_depth(rates: Array, body: Conductor, depths: Depths | None) -> Array:
    """Return g of (1) for waves along the depth, averaged over the dissipating waves; 1 without depths."""
    return np.ones_like(rates) if depths is None else depths.cosines(np.sqrt(rates / body.diffusivity))


class MeanMemory:
    """Mean temperature of a box [K], as `waves` along the depth; the same on every rank."""

    def __init__(self, body: Conductor) -> None:
        self.body, self.sum = body, fit_exponentials(*MEAN_TIMES, MEAN_ERROR)
        self.waves = np.zeros(self.sum.rates.size)

    @property
    def stored(self) -> float:
        """Heat in the body [J/m^2, mean over the box]: the longest wave along the depth, which never decays."""
        return float(self.waves[0])

    def advance(self, dt: float, heating: Heating) -> tuple[float, float]:
        """Advance by a step dt [s]. Return the mean temperature rises [K] of the surface and where the body releases
        heat."""
        known, deep = self.sum, along_depth(self.sum.rates, self.body, heating.depths)
        before, after = shares_of_step(known.rates * dt)
        start, end = (one + deep * other for one, other in zip(heating.rubbed, heating.pressed, strict=True))
        self.waves = np.exp(-known.rates * dt) * self.waves + dt * (before * start + after * end)
        fast = 2.0 / (np.pi * known.end) * heating.rubbed[1]
        weights = known.weights / self.body.effusivity
        return float(weights @ self.waves + fast / self.body.effusivity), float((weights * deep) @ self.waves)


class HeatMemory:
    """The waves (1) of a box of `size` [m], and the spectra of rubbing and pressure at the end of the last step.

    Parameters: `fft`, a transform of the size of maps; `rubs`, True if there is heat on the surface in addition to
    that of the body. The constructor and the methods are collective.
    """

    def __init__(self, fft: FFT, size: Vector, body: Conductor, known: Exponentials, rubs: bool) -> None:
        self.fft, self.body, self.sum = fft, body, known
        qx, qy = wavenumbers(fft, size)
        self._spread = body.diffusivity * qx[0] ** 2, body.diffusivity * qy[:, 0] ** 2
        tally = fft.slab.tally
        self.waves = allocate((known.kept, *fft.shape), fft.complex, tally)
        if not tally.only_counts:
            self.waves.fill(0.0)
        self.pressed = allocate(fft.shape, fft.complex, tally)
        self.rubbed = allocate(fft.shape if rubs else (0, fft.shape[1]), fft.complex, tally)
        self.mean = MeanMemory(body)

    def set_heating(self, rubbed: Array | None, pressed: Array, scales: Vector) -> None:
        """Set the maps of rubbing and pressure before the next step, times their scales."""
        if rubbed is not None:
            np.multiply(self.fft.forward(rubbed), scales[0], out=self.rubbed)
        np.multiply(self.fft.forward(pressed), scales[1], out=self.pressed)

    def advance(
        self, dt: float, heating: Heating, rubbed: Array | None, pressed: Spectrum, scales: Vector, out: Array
    ) -> float:
        """Advance by a step dt [s] to these maps of rubbing and pressure, and put the temperature rise of the surface
        [K] into `out`. Return the mean rise [K] at the depths where the body releases heat, weighted by this heat.

        `pressed` is a spectrum, the buffer of the transform or a copy; `scales` give both maps the mean 1.
        """
        known, fft = self.sum, self.fft
        now, fresh = pressed, np.zeros((0, fft.shape[1]), fft.complex)
        if rubbed is not None:
            now = pressed.copy() if pressed is fft.spectrum else pressed
            fresh = fft.forward(rubbed)
        deep, result = along_depth(known.rates, self.body, heating.depths), fft.spectrum
        fall = np.exp(-known.rates[: known.kept] * dt)
        felt = loops.conduct(
            self.waves,
            (known.rates, known.weights / self.body.effusivity, deep, fall, known.end),
            (*self._spread, fft.multiplicity[0]),
            dt,
            (self.rubbed, fresh, self.pressed, now),
            np.array([heating.rubbed, heating.pressed]),
            np.array(scales),
            self.body.effusivity,
            result,
        )
        mean, mean_felt = self.mean.advance(dt, heating)
        if fft.shape[1] and fft.columns.start == 0:
            result[0, 0] = mean * fft.mx * fft.my
        fft.backward(result, out)
        return mean_felt + fft.slab.sum(felt)[0] / (fft.mx * fft.my) ** 2

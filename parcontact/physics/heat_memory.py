"""Temperature of the surface of a conducting half space under heat that changes with time: a march of `physics.heat`.

Each wave (j, k) of the sum of exponentials (`physics.exponentials`), along the depth and along the surface, obeys

    dc/dt = -(m_j^2 + D k^2) c + q^(k, t) g_j,     T^(k) = sum_j w_j c_j/e,                                       (1)

with the effusivity e; q changes linearly with time in a step, over which (1) is solved exactly. For heat on the surface
g = 1; for heat of the body it is the share of the wave m_j/sqrt(D) along the depth in the distribution of heat over
depth (`physics.heat`, (3)). The temperature in the depths where this heat is made is `sum_j w_j g_j c_j/e`.

The mean of the box (k = 0) has a sum of its own, of numbers, exact to 1e-9 at any time: so all heat is accounted for.
"""

from dataclasses import dataclass

import numpy as np

from ..parallel.fft import FFT, Spectrum
from ..parallel.slab import Array, allocate
from . import loops
from .convolution import wavenumbers
from .exponentials import Exponentials, fit_exponentials, shares_of_step
from .heat import Conductor, Depths, Vector

MEAN_TIMES, MEAN_ERROR = (1e-12, 1e12), 1e-9  # accuracy: of the mean of the box


@dataclass(frozen=True)
class Heating:
    """Heat of one step [W/m^2, mean over the box], at its beginning and at its end: on what is `rubbed`, and in the
    body in proportion to the pressure, at `depths`."""

    rubbed: tuple[float, float] = (0.0, 0.0)
    pressed: tuple[float, float] = (0.0, 0.0)
    depths: Depths | None = None

    @property
    def whole(self) -> tuple[float, float]:
        """All of it."""
        return self.rubbed[0] + self.pressed[0], self.rubbed[1] + self.pressed[1]


def along_depth(rates: Array, body: Conductor, depths: Depths | None) -> Array:
    """Return g of (1) for waves along the depth, in the mean over the waves that dissipate; 1 without."""
    return np.ones_like(rates) if depths is None else depths.cosines(np.sqrt(rates / body.diffusivity))


class MeanMemory:
    """The mean temperature of a box [K] and its `waves` along the depth; the same on every rank."""

    def __init__(self, body: Conductor) -> None:
        self.body, self.sum = body, fit_exponentials(*MEAN_TIMES, MEAN_ERROR)
        self.waves = np.zeros(self.sum.rates.size)

    @property
    def stored(self) -> float:
        """The heat in the body [J/m^2], mean over the box: the longest wave along the depth, which never decays."""
        return float(self.waves[0])

    def advance(self, dt: float, heating: Heating) -> tuple[float, float]:
        """Go on by a step [s]; returns the mean temperature rise [K], of the surface and where the body makes heat."""
        known, deep = self.sum, along_depth(self.sum.rates, self.body, heating.depths)
        before, after = shares_of_step(known.rates * dt)
        start, end = (one + deep * other for one, other in zip(heating.rubbed, heating.pressed, strict=True))
        self.waves = np.exp(-known.rates * dt) * self.waves + dt * (before * start + after * end)
        fast = 2.0 / (np.pi * known.end) * heating.rubbed[1]
        weights = known.weights / self.body.effusivity
        return float(weights @ self.waves + fast / self.body.effusivity), float((weights * deep) @ self.waves)


class HeatMemory:
    """The waves (1) of a box of `size` [m], and the spectra of what was rubbed and pressed at the end of the last step.

    Parameters: a transform of the maps' own size, on whose wavenumbers it is; `rubs`: whether there is heat on the
    surface beside that in the body. Making and calling it are collective.
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
        """Take what is rubbed and pressed now, times their scales, for that before the next step."""
        if rubbed is not None:
            np.multiply(self.fft.forward(rubbed), scales[0], out=self.rubbed)
        np.multiply(self.fft.forward(pressed), scales[1], out=self.pressed)

    def advance(
        self, dt: float, heating: Heating, rubbed: Array | None, pressed: Spectrum, scales: Vector, out: Array
    ) -> float:
        """Go on by a step [s] at whose end these are rubbed and pressed; the temperature rise of the surface [K] is
        then in `out`. Returns the mean rise [K] in the depths where the body makes heat, weighted by this heat.

        `pressed` is a spectrum, that of the transform itself or a copy; `scales` make both maps of the mean 1.
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

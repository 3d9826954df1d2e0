"""Temperatures that the heat of sliding causes: in steady sliding, in time steps, and below a free box.

Steady sliding. Heat q^(k) [W/m^2] is released on the surface of a half space of conductivity kappa and diffusivity D,
below a contact that slides at the velocity v; the rest of the surface is insulated. k is the wave vector of the heat.
In the frame of the contact the steady temperature rise of the surface is (H. S. Carslaw, J. C. Jaeger, Conduction of
Heat in Solids (1959), section 10.7)

    T^(k) = q^(k)/(kappa beta),     beta(k) = sqrt(k^2 - i k.v/D),     Re beta > 0.                               (1)

Heat that is released at the depth z reaches the surface with the factor exp(-beta z). A wave of pressure of the
wavenumber q strains an incompressible half space: the squares of all strains add up to a constant times `(q z)^2 exp(-2
q z)`, which is the same under crests and troughs. So the heat that the wave dissipates has the distribution `4 q (q
z)^2 exp(-2 q z) dz` over the depth, with the mean depth `3/(2 q)`. This heat reaches the surface with the factor

    int 4 q^3 z^2 exp(-(2 q + beta) z) dz = (1 + beta/(2 q))^-3.                                                  (2)

The rubber that dissipates is at the same depths, and its temperature is the mean over this distribution. For this mean,
the temperature is written as a sum of waves cos(m z) along the depth. The share of such a wave in the distribution is

    g(m) = int 4 q^3 z^2 exp(-2 q z) cos(m z) dz = Re (1 - i m/(2 q))^-3.                                         (3)

A unit of heat of the body warms the depths at which it is released by `2/(pi kappa) int g^2/(beta^2 + m^2) dm`. This
replaces the factor 1/(kappa beta) of (1).

A uniform heat has no steady state. After a sliding time t the body is warmer by `2 q sqrt(t/pi)/e` than at the start,
with the effusivity `e = kappa/sqrt(D)`. The temperature of a wave is then the fraction `erf(beta sqrt(D t))` of (1).
For an infinite time, temperatures in a periodic box are relative to the mean of the box.

Time steps. The temperature is a sum of exponentials (`physics.prony`), whose terms j are waves along the depth with the
rate m_j^2 and the weight w_j. The amplitude c of each wave j along the depth and k along the surface satisfies

    dc/dt = -(m_j^2 + D k^2) c + q^(k, t) g_j,     T^(k) = sum_j w_j c_j/e.                                       (4)

Within a step q is linear in time, and (4) is solved exactly. For heat on the surface g_j = 1; for heat of the body g_j
is the share (3) for m = m_j/sqrt(D). The temperature at the depths at which this heat is released is
`sum_j w_j g_j c_j/e`. The mean of the box (k = 0) has a sum of exponentials of its own, which is exact to 1e-9 at any
time, so that no heat is lost.

Free box. A uniform heat on one cell of `dx x dy`, while the body passes below it with the velocity -v, causes at the
distance (x, y) from the cell the rise (H. S. Carslaw, J. C. Jaeger, section 10.4)

    K(x, y) = 1/e int_0^inf W(t) P(x + v_x t, dx, t) P(y + v_y t, dy, t) dt/sqrt(pi t),                           (5)
    P(x, dx, t) = (erf((x + dx/2)/sqrt(4 D t)) - erf((x - dx/2)/sqrt(4 D t)))/2.

W is 1 for heat on the surface. For heat that waves of the wavenumber q dissipate, with tau = D t and s = 2 q sqrt(tau),

    W(t) = sqrt(pi) s^3 erfcx''(s)/2,     erfcx''(s) = (2 + 4 s^2) erfcx(s) - 4 s/sqrt(pi),                       (6)

which tends to 1 - 3/s^2 for large s. For the temperature at the depths at which heat is released, W is `sqrt(pi tau)`
times `Depths.staying`. The integral (5) is a sum over panels, short enough for the passage of a cell and for the
spreading of heat.

Distribution over the contact. The heat of the interface is its shear stress times the sliding speed, at all points in
contact. The heat of the body, which its branches dissipate, is distributed in proportion to the pressure.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...parallel.fft import FFT, Spectrum
from ...parallel.slab import Array, Slab, allocate, deal
from ...physics import loops
from ...physics.convolution import (
    ALL,
    PARTS,
    Convolution,
    padded_lengths,
    tabulate,
    travelling_wavenumbers,
    wavenumbers,
)
from ...physics.halfspace import HalfSpace
from ...physics.prony import Exponentials, Prony, complex_modulus, fit_exponentials, shares_of_step

Vector = tuple[float, float]
SPACING, LOWEST, HIGHEST = 0.3, 1e-5, 30.0  # accuracy: waves m along the depth: spacing of ln m; limits over q
BINS = 16  # accuracy: bins of wavenumbers per octave; the error of flash temperatures is 1e-4
DEEPEST = 3.0  # physics: least wavenumber times thickness of the body: heat lies at most half of it deep


@dataclass(frozen=True)
class Conductor:
    """A material that conducts heat: conductivity [W/(m K)] and diffusivity [m^2/s]."""

    conductivity: float
    diffusivity: float

    @property
    def effusivity(self) -> float:
        """The conductivity divided by the root of the diffusivity [W s^(1/2)/(m^2 K)]."""
        return float(self.conductivity / np.sqrt(self.diffusivity))

    def squared_beta(self, fft: FFT, size: Vector, velocity: Vector, rows: slice = ALL) -> Spectrum:
        """Return the square of beta of (1) [1/m^2] for `rows` of a spectrum, in a box of `size` [m] and for the
        `velocity` [m/s] of the contact."""
        square = np.hypot(*wavenumbers(fft, size, rows)) ** 2
        along_x, along_y = travelling_wavenumbers(fft, size, rows)
        return square - 1j * (along_x * velocity[0] + along_y * velocity[1]) / self.diffusivity


@dataclass(frozen=True)
class Depths:
    """Depths at which the body releases heat. Waves with the `wavenumbers` [1/m] dissipate the `shares` of the heat;
    both arrays have the shape (n,).

    Temperatures are computed as integrals over waves cos(m z) along the depth. Unlike (2), these integrals hold also
    for a finite time, and for the temperature at a depth.
    """

    wavenumbers: Array
    shares: Array

    def cosines(self, m: Array) -> Array:
        """Return the share (3) of each wave cos(m z) along the depth, averaged over the dissipating waves with their
        shares of the heat. `m` [1/m] and the result have the shape (k,)."""
        square = (0.5 * m / self.wavenumbers[:, None]) ** 2
        return np.asarray(self.shares @ ((1.0 - 3.0 * square) / (1.0 + square) ** 3))

    def warmed(self, beta: Spectrum, felt: bool, reach: float = np.inf) -> Spectrum:
        """Return the product [m] of conductivity and temperature rise for a unit of heat, in the shape of `beta`. The
        sum over waves is accurate to 1e-5. `beta` [1/m] is defined by (1). Heat has diffused for a time t, given as
        `reach = D t` [m^2]. If `felt` is True, return the rise at the depths where heat is released, else the rise of
        the surface."""
        total = np.zeros_like(beta)
        for m, weight in zip(*self._waves(felt), strict=True):
            square = beta**2 + m**2
            total += weight * (-np.expm1(-square * reach) if reach < np.inf else 1.0) / square
        return total

    def staying(self, tau: Array) -> Array:
        """Return `2/pi int g^2 exp(-m^2 tau) dm` [1/m]. This is the heat capacity times the temperature rise that a
        unit of heat still causes at the depths where the heat was released, after diffusion for a time t, given as `tau
        = D t` [m^2]. The shape is that of `tau`."""
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

    The heat is released on the surface or at `depths`. The temperature is taken on the surface or, if `felt`, at the
    depths where heat is released. The operator is exact for each wave except the Nyquist waves.
    """
    reach = body.diffusivity * time

    def part(rows: slice) -> Spectrum:
        beta: Spectrum = np.sqrt(body.squared_beta(fft, size, velocity, rows))  # its real part is positive
        mean = beta == 0.0
        beta[mean] = 1e-9 / max(size)
        if depths is not None:
            symbol = depths.warmed(beta, felt, reach)
        else:
            from scipy.special import erf

            symbol = (erf(beta * np.sqrt(reach)) if reach < np.inf else 1.0) / beta
        if time == np.inf:
            symbol[mean] = 0.0
        return symbol / body.conductivity

    return Convolution(fft, part, fft.complex, even=not velocity[1])


def depths_of(spectrum: Spectrum, fft: FFT, body: HalfSpace, unit: float, velocity: Vector, prony: Prony) -> Depths:
    """Return the depths at which a body that slides at `velocity` [m/s] dissipates under the pressure with this
    spectrum; collective.

    A wave of pressure with the amplitude p^ and the frequency w loses the power `|p^|^2 A w Im(-1/G*(w))`, where A is
    the compliance of the body to this wave and G* the complex modulus from `prony`. Waves are combined in bins, `BINS`
    per octave, and each bin has the mean wavenumber of its waves. `unit` [m] is the length unit of the body. No heat is
    released deeper than half the thickness of the body.
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
    found = np.maximum(found, DEEPEST / (body.response.thickness * unit))
    return Depths(found, powers[there] / powers.sum() if there.any() else powers[there])


MEAN_TIMES, MEAN_ERROR = (1e-12, 1e12), 1e-9  # accuracy: times [s] and relative error of the mean of the box


@dataclass(frozen=True)
class Heating:
    """Heat in one step [W/m^2, mean over the box]. Each pair holds the values at the beginning and at the end of the
    step: `rubbed` is released on the surface at points that slip, and `pressed` in the body, at `depths`, in proportion
    to the pressure."""

    rubbed: tuple[float, float] = (0.0, 0.0)
    pressed: tuple[float, float] = (0.0, 0.0)
    depths: Depths | None = None

    @property
    def whole(self) -> tuple[float, float]:
        """The sum of both heats at the beginning and at the end of the step [W/m^2]."""
        return self.rubbed[0] + self.pressed[0], self.rubbed[1] + self.pressed[1]


def along_depth(rates: Array, body: Conductor, depths: Depths | None) -> Array:
    """Return the factors g_j of (4) for waves along the depth with these `rates` [1/s], averaged over the dissipating
    waves. Without `depths` heat is released on the surface, and all factors are 1."""
    return np.ones_like(rates) if depths is None else depths.cosines(np.sqrt(rates / body.diffusivity))


class MeanMemory:
    """Mean temperature of a box [K], as a sum of waves along the depth; the same on every rank."""

    def __init__(self, body: Conductor) -> None:
        self.body, self.sum = body, fit_exponentials(*MEAN_TIMES, MEAN_ERROR)
        self.waves = np.zeros(self.sum.rates.size)

    @property
    def stored(self) -> float:
        """Heat that the body has stored [J/m^2, mean over the box]. It is the amplitude of the longest wave along the
        depth, which never decays."""
        return float(self.waves[0])

    def advance(self, dt: float, heating: Heating) -> tuple[float, float]:
        """Advance by a step dt [s]. Return the mean temperature rise [K] of the surface, and the rise at the depths
        where the body releases heat."""
        known, deep = self.sum, along_depth(self.sum.rates, self.body, heating.depths)
        before, after = shares_of_step(known.rates * dt)
        start, end = (one + deep * other for one, other in zip(heating.rubbed, heating.pressed, strict=True))
        self.waves = np.exp(-known.rates * dt) * self.waves + dt * (before * start + after * end)
        fast = 2.0 / (np.pi * known.end) * heating.rubbed[1]
        weights = known.weights / self.body.effusivity
        return float(weights @ self.waves + fast / self.body.effusivity), float((weights * deep) @ self.waves)


class HeatMemory:
    """The temperature waves (4) in the body below a box of `size` [m], and the spectra of heat at the end of the last
    step.

    `fft` is a transform of the size of maps, `body` the conductor, and `known` the sum of exponentials. `rubs` is True
    if heat is also released on the surface, and not only in the body. The constructor and the methods are collective.
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
        """Set how heat is distributed at the beginning of the next step: on the surface in proportion to the map
        `rubbed`, and in the body in proportion to the map `pressed`. `scales` are factors: each map times its factor
        has the mean 1."""
        if rubbed is not None:
            np.multiply(self.fft.forward(rubbed), scales[0], out=self.rubbed)
        np.multiply(self.fft.forward(pressed), scales[1], out=self.pressed)

    def advance(
        self, dt: float, heating: Heating, rubbed: Array | None, pressed: Spectrum, scales: Vector, out: Array
    ) -> float:
        """Advance by a step dt [s]. Put the temperature rise of the surface [K] into the map `out`, and return the mean
        rise [K] at the depths where the body releases heat, weighted by this heat.

        At the end of the step the heat on the surface is distributed like the map `rubbed`, and the heat in the body
        like the map of which `pressed` is the spectrum (the buffer of the transform or a copy). `scales` are factors:
        each map times its factor has the mean 1.
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


GAUSS = np.polynomial.legendre.leggauss(4)
FIRST = 1e-4  # accuracy: end of the first panel over the shortest time scale; the integrand is smooth in sqrt(t) before
GROWTH, PASSING = 1.3, 0.5  # accuracy: largest ratio of panel ends; largest panel over the time to pass the warm zone
SPREAD = 6.5  # accuracy: distance over sqrt(2 D t) beyond which heat is below rounding
LAST = 1e8  # accuracy: end of the integral over the time to spread over the box, at rest
ASYMPTOTIC = 100.0  # accuracy: s beyond which W is 1 - 3/s^2 to 1e-7


def sliding_heat_unbounded(
    fft: FFT,
    size: Vector,
    body: Conductor,
    velocity: Vector,
    depths: Depths | None = None,
    felt: bool = False,
    time: float = np.inf,
) -> Convolution:
    """Return the operator from heat [W/m^2] to temperature rise [K] below a contact that has slid steadily at
    `velocity` [m/s] for a `time` [s] and fits into a free box of `size` [m]; collective. Other arguments are as in
    `sliding_heat`."""
    slab = fft.slab
    padded = FFT(slab, padded_lengths(slab.nx, slab.ny), np.float64, measured=False)

    def coefficient(x: Array, y: Array, dx: float, dy: float) -> Array:
        times, shares = _times(size, (dx, dy), body, velocity, time)
        if depths is not None:
            tau = body.diffusivity * times
            shares = shares * (np.sqrt(np.pi * tau) * depths.staying(tau) if felt else _reaching(times, body, depths))
        along_x = _covered(x[0] + velocity[0] * times[:, None], dx, times, body)
        along_y = _covered(y[:, 0] + velocity[1] * times[:, None], dy, times, body)
        return np.asarray((along_y * shares[:, None]).T @ along_x) / body.effusivity

    table = tabulate(padded, size, coefficient)
    return Convolution(padded, table.__getitem__, padded.complex, even=not velocity[1])


def _covered(x: Array, dx: float, times: Array, body: Conductor) -> Array:
    """Return P of (5), of shape (times, positions)."""
    from scipy.special import erf

    reach = np.sqrt(4.0 * body.diffusivity * times)[:, None]
    return np.asarray(0.5 * (erf((x + 0.5 * dx) / reach) - erf((x - 0.5 * dx) / reach)))


def _times(size: Vector, cell: Vector, body: Conductor, velocity: Vector, time: float) -> tuple[Array, Array]:
    """Return times t [s], up to `time`, and their shares of `dt/sqrt(pi t)` in the integral (5), by Gauss panels in
    sqrt(t)."""
    speed, smallest, longest = float(np.hypot(*velocity)), min(cell), 2.0 * float(np.hypot(*size))
    start = FIRST * smallest / max(speed, body.diffusivity / smallest)
    end = LAST * longest**2 / body.diffusivity
    if speed:  # the warmed body has left when v t > longest + SPREAD sqrt(2 D t)
        wide = SPREAD * np.sqrt(2.0 * body.diffusivity) / speed
        end = min(end, ((wide + np.sqrt(wide**2 + 4.0 * longest / speed)) / 2.0) ** 2)
    end = min(end, time)
    edges = [0.0, min(start, end)]
    while edges[-1] < end:
        passing = max(smallest, np.sqrt(4.0 * body.diffusivity * edges[-1])) / speed if speed else np.inf
        edges.append(min(edges[-1] * GROWTH, edges[-1] + PASSING * passing, end))
    roots = np.sqrt(edges)
    half = 0.5 * np.diff(roots)[:, None]
    nodes = (roots[:-1, None] + half * (1.0 + GAUSS[0])).ravel()
    return nodes**2, (half * GAUSS[1]).ravel() * 2.0 / np.sqrt(np.pi)


def _reaching(times: Array, body: Conductor, depths: Depths) -> Array:
    """Return W of (6) at these times, averaged over the dissipating waves."""
    from scipy.special import erfcx

    total = np.zeros_like(times)
    for q, share in zip(depths.wavenumbers, depths.shares, strict=True):
        s = 2.0 * q * np.sqrt(body.diffusivity * times)
        near = np.minimum(s, ASYMPTOTIC)
        bend = (2.0 + 4.0 * near**2) * erfcx(near) - 4.0 * near / np.sqrt(np.pi)
        late = 1.0 - 3.0 / np.maximum(s, ASYMPTOTIC) ** 2
        total += share * np.where(s < ASYMPTOTIC, 0.5 * np.sqrt(np.pi) * near**3 * bend, late)
    return total


SLIP_BINS = 512  # accuracy: bins of the histogram for quartiles, whose error is 1/512 of the range


@dataclass(frozen=True)
class Flash:
    """Temperature rises [K] where a contact releases heat, on the surface and in the body. Means are weighted by this
    heat.

    `mean` is the flash temperature, `lower` and `upper` are the quartiles, and `highest` is the highest rise on the
    surface. In bands, `hottest_band` is the rise of the hottest band; otherwise it is None. With feedback, `rounds`
    steady states were solved to find the temperatures. The first of these states was for cold rubber, and
    `friction_cold` is its friction coefficient.
    """

    mean: float = 0.0
    highest: float = 0.0
    lower: float = 0.0
    upper: float = 0.0
    hottest_band: float | None = None
    rounds: int = 1
    friction_cold: float = math.nan

    @property
    def of_rubber(self) -> float:
        return self.mean if self.hottest_band is None else self.hottest_band


def spread_over(slab: Slab, weights: Array, total: float) -> Array:
    """Return the heat `total` [W/m^2, mean over the box] distributed in proportion to the map `weights`; 0 if all
    weights are 0. Collective."""
    whole = slab.sum(float(weights.sum(dtype=np.float64)))[0]
    return weights * (total * slab.points / whole if whole > 0.0 else 0.0)


def share_of(slab: Slab, rubbed: Array, own: Array, other: Array, counterbody: Array) -> float:
    """Return the share of the heat of the interface that enters the rubber; the rest enters the counterbody. With this
    share both surfaces have the same mean temperature over the contact (H. Blok, Proc. Inst. Mech. Engrs. 2 (1937)
    222); collective.

    If all heat of the interface entered the rubber, the rubber would warm by `own` [K]; if all entered the counterbody,
    the counterbody would warm by `counterbody` [K]. Other heat warms the rubber by `other` [K]. All are maps, and their
    means are weighted by the map `rubbed` of the heat of the interface.
    """
    sums = slab.sum(*(float((rise * rubbed).sum()) for rise in (own, other, counterbody)))
    whole = sums[0] + sums[2]
    return min(max((sums[2] - sums[1]) / whole, 0.0), 1.0) if whole > 0.0 else 1.0


def flash_of(slab: Slab, surface: Array, pairs: Sequence[tuple[Array, Array]]) -> Flash:
    """Return the temperatures of a contact; collective. `surface` is the map of the temperature rise of the surface
    [K]. Each of the `pairs` has a map of a temperature rise [K], and a map of the heat that is released at the same
    depths."""
    sums = [(float((rise * heat).sum()), float(heat.sum())) for rise, heat in pairs]
    warmed, whole = slab.sum(*(math.fsum(each) for each in zip(*sums, strict=True))) if sums else (0.0, 0.0)
    highest = float(surface.max(initial=-math.inf))
    if not whole > 0.0:
        return Flash()
    values = np.concatenate([rise[heat > 0.0] for rise, heat in pairs])
    weights = np.concatenate([heat[heat > 0.0] for _, heat in pairs])
    ends = float(values.max(initial=-math.inf)), -float(values.min(initial=math.inf))
    highest, top, bottom = slab.reduce((), [highest, *ends])
    low, span = -bottom, max(top + bottom, np.finfo(float).tiny)
    counts = np.histogram((values - low) / span, SLIP_BINS, (0.0, 1.0), weights=weights)[0]
    shares = np.concatenate([[0.0], np.cumsum(slab.sum(*counts))]) / whole
    lower, upper = low + span * np.interp([0.25, 0.75], shares, np.linspace(0.0, 1.0, SLIP_BINS + 1))
    return Flash(warmed / whole, highest, float(lower), float(upper))

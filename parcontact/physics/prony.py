"""Linear viscoelasticity: relaxation, creep, complex and time-discrete moduli of a Prony series.

    G(t) = G_inf + sum_j G_j exp(-t/tau_j)

Source: J. D. Ferry, Viscoelastic Properties of Polymers (1980), chapters 1 and 3; the Zener branch is Eq. (4) of the
paper "Transient frictionless contact of a rough rigid surface on a viscoelastic half-space". Relaxation times may be
0 (no stress after the first instant) or infinite (a spring).

The memory of heat is a sum of exponentials, as is the memory of the body.

Heat of the wavenumber k on the surface of a body of diffusivity D and effusivity e, released a time t ago, leaves
the temperature `exp(-D k^2 t)/(e sqrt(pi t))`. With

    1/sqrt(pi t) = 2/pi int_0^inf exp(-m^2 t) dm ~ sum_j w_j exp(-m_j^2 t),   m_j = m_0 exp(j h),  w_j = 2/pi h m_j  (1)

the memory has one map for each j, which decays at the rate `m_j^2 + D k^2`. The spacing of ln m is h, and the least
m is m_0. Each m belongs to a wave along the depth, of wavenumber m/sqrt(D); the share of this wave in heat at depth is
the cosine transform of the distribution of heat over the depth. The trapezoidal rule (1) in ln m has the relative error
`2 sum_n 1/sqrt(cosh(pi^2 n/h))` at every t, as the Fourier transform of the integrand is a gamma function (G. Beylkin,
L. Monzon, Appl. Comput. Harmon. Anal. 28 (2010) 131). All waves below m_0 are combined to one wave with their mean
rate, correct to second order in `m_0^2 t`; above the last wave `erfc(m sqrt(t))` is neglected.
"""

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..parallel.slab import Array as slab_Array

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
BEND_SERIES = 1.0  # rounding: z below which q is a series, to sixteen digits
BEND_TERMS = [0.5 * n / math.factorial(n + 2) for n in range(1, 18)]
Integrator = Literal["exponential", "exponential-linear", "backward-euler"]
Moduli = tuple[float, ArrayLike, ArrayLike]  # long-term modulus (Pa), moduli (Pa), relaxation times (s), as in Prony


class Prony(NamedTuple):
    """Relaxation function: long-term shear modulus [Pa], and moduli [Pa] and relaxation times [s] of its terms."""

    modulus_inf: float
    moduli: Array
    relaxation_times: Array


class CreepSpectrum(NamedTuple):
    """Creep function J(t) = glass + sum_i compliances[i] (1 - exp(-t/retardation_times[i])) + fluidity t, with
    compliances [1/Pa], retardation times [s] and fluidity [1/(Pa s)]."""

    glass: float
    compliances: Array
    retardation_times: Array
    fluidity: float

    def compliance(self, t: ArrayLike) -> Array:
        """Return J(t) [1/Pa] for times t >= 0 [s], any shape."""
        t = np.asarray(t, float)
        delayed = -np.expm1(-t[..., None] / self.retardation_times) @ self.compliances
        return np.asarray(self.glass + delayed + self.fluidity * t)

    def time(self, compliance: float) -> float:
        """Return the time t [s] at which J(t) = `compliance`: 0 if J(0) is larger, inf if J never reaches it."""
        from scipy.optimize import brentq  # slow to import, and of use to few

        growth = compliance - self.glass
        if growth <= 0:
            return 0.0
        total = self.compliances.sum()
        if self.fluidity == 0 and growth >= total * (1 - 1e-14):
            return np.inf
        # J rises no faster than at the start, and no slower than by flow alone or by the longest retardation time
        earliest = growth / (self.fluidity + np.sum(self.compliances / self.retardation_times))
        by_flow = growth / self.fluidity if self.fluidity > 0 else np.inf
        by_delay = -self.retardation_times.max() * np.log1p(-growth / total) if growth < total else np.inf
        low, high = np.log(earliest) - 1, np.log(min(by_flow, by_delay)) + 1
        return float(np.exp(brentq(lambda x: self.compliance(np.exp(x)) - compliance, low, high, xtol=1e-15)))


def normal_form(modulus_inf: float, moduli: ArrayLike, relaxation_times: ArrayLike) -> Prony:
    """Return the series of the given moduli and times in normal form: the same relaxation function with ascending,
    distinct, positive, finite relaxation times and positive moduli. Raises ValueError for numbers that do not define a
    relaxation function."""
    terms, times = np.atleast_1d(np.asarray(moduli, float)), np.atleast_1d(np.asarray(relaxation_times, float))
    if terms.shape != times.shape or terms.ndim != 1:
        raise ValueError(f"There are {terms.size} moduli but {times.size} relaxation times.")
    if not (modulus_inf >= 0 and np.all(terms >= 0) and np.all(times >= 0)):
        raise ValueError("Moduli and relaxation times must not be negative.")
    spring = modulus_inf + terms[np.isinf(times)].sum()
    lasting = (terms > 0) & (times > 0) & np.isfinite(times)
    distinct, index = np.unique(times[lasting], return_inverse=True)
    if not 0 < spring + terms[lasting].sum() < np.inf:
        raise ValueError("The modulus after the first instant must be positive and finite.")
    return Prony(float(spring), np.asarray(np.bincount(index, terms[lasting], distinct.size), float), distinct)


def zener_to_prony(
    series_modulus: ArrayLike, kelvin_modulus: ArrayLike, kelvin_viscosity: ArrayLike, modulus_inf: float = 0.0
) -> Prony:
    """Return the Prony series of Zener branches in parallel with a spring `modulus_inf`.

    A branch is a spring G0 (`series_modulus`, Pa) in series with a spring G1 (`kelvin_modulus`, Pa) and a dashpot
    eta1 (`kelvin_viscosity`, Pa s) that are parallel. It adds G0 G1/(G0 + G1) to the long-term modulus and one term
    with modulus G0^2/(G0 + G1) and relaxation time eta1/(G0 + G1). G1 = 0 is a Maxwell branch; eta1 = 0 leaves the
    two springs (relaxation time 0), eta1 = inf leaves G0 (relaxation time inf).
    """
    g0, g1, eta1 = (
        np.atleast_1d(np.asarray(value, float)) for value in (series_modulus, kelvin_modulus, kelvin_viscosity)
    )
    if not (np.all((g0 > 0) & np.isfinite(g0 + g1)) and np.all(g1 >= 0) and np.all(eta1 >= 0)):
        raise ValueError("A Zener branch needs finite moduli, a positive series modulus and nothing negative.")
    both = g0 + g1
    return Prony(float(modulus_inf + np.sum(g0 * g1 / both)), g0 * g0 / both, eta1 / both)


def relaxation(t: ArrayLike, *material: *Moduli) -> Array:
    """Return the stress G(t) [Pa] at times t >= 0 [s], any shape, after a unit step of strain at t = 0. `material` is
    the three arguments of `Prony`."""
    spring, terms, times = normal_form(*material)
    return np.asarray(spring + np.exp(-np.asarray(t, float)[..., None] / times) @ terms)


def relaxation_integral(t: ArrayLike, *material: *Moduli) -> Array:
    """Return the integral of G from 0 to t [Pa s], the stress after straining at unit rate for the time t [s], any
    shape."""
    spring, terms, times = normal_form(*material)
    t = np.asarray(t, float)
    return np.asarray(spring * t - np.expm1(-t[..., None] / times) @ (terms * times))


def complex_modulus(omega: ArrayLike, *material: *Moduli) -> ComplexArray:
    """Return G* = G' + i G'' [Pa] at angular frequencies omega [rad/s], any shape and sign, for strains exp(+i omega
    t).

        G*(omega) = G_inf + sum_j G_j i omega tau_j / (1 + i omega tau_j)
    """
    spring, terms, times = normal_form(*material)
    phase = 1j * np.asarray(omega, float)[..., None] * times
    return np.asarray(spring + (phase / (1 + phase)) @ terms)


def discrete_modulus(
    omega: ArrayLike, dt: ArrayLike, *material: *Moduli, integrator: Integrator = "exponential"
) -> ComplexArray:
    """Return the complex modulus [Pa] that an integrator with steps dt > 0 [s] has in effect, for a displacement
    sampled from exp(i omega t).

    With y = exp(i omega dt), and phi_j and q_j as in `physics.body`, the terms of G_inf + sum_j H_j are

        backward Euler:      H_j = G_j (1 - 1/y) / (1 + dt/tau_j - 1/y)
        exponential-linear:  H_j = G_j phi_j (1 - 1/y) / (1 - exp(-dt/tau_j)/y)
        exponential:         H_j = G_j (phi_j + q_j (1 - 1/y)) (1 - 1/y) / (1 - exp(-dt/tau_j)/y)

    These are z-transforms of the recursions of `coefficients` for steps of one length. N steps per period correspond to
    dt = 2 pi/(N omega). omega and dt broadcast.
    """
    spring, terms, times = normal_form(*material)
    omega, dt = (np.asarray(value, float)[..., None] for value in (omega, dt))
    ratio, turn = dt / times, 1j * omega * dt
    change = -np.expm1(-turn)
    if integrator == "backward-euler":
        gains = change / (ratio + change)
    elif integrator in ("exponential", "exponential-linear"):
        weight = -np.expm1(-ratio) / ratio + (bend(ratio) * change if integrator == "exponential" else 0.0)
        gains = weight * change / -np.expm1(-ratio - turn)
    else:
        raise ValueError(f"The integrator must be one of {', '.join(get_args(Integrator))}, not {integrator}.")
    return np.asarray(spring + gains @ terms)


def elapsed(prony: Prony, dt: float) -> Array:
    """Return `z = dt/tau` of each branch, at most 1e100 against overflow."""
    return np.asarray(dt / np.maximum(prony.relaxation_times, 1e-100 * dt))


class Advance(NamedTuple):
    """Coefficients of branches over a step: `h <- decay h + gain du + back du_before`, with the increments du of the
    displacement in this step and in the step before."""

    decay: Array
    gain: Array
    back: Array


def coefficients(prony: Prony, integrator: str, dt: float, growth: float = 0.0) -> Advance:
    """Return the coefficients of each branch over a step dt [s]; dt = 0 is a jump, in which nothing relaxes.

    `growth` is dt divided by the length of the step before; `growth` is 0 after a jump and in the first step of a
    stage. With `growth` > 0 the exponential integrator takes u as quadratic in time (`physics.body`), else as linear.
    """
    z = elapsed(prony, dt)
    if integrator == "backward-euler":
        return Advance(1.0 / (1.0 + z), prony.moduli / (1.0 + z), np.zeros_like(z))
    phi = np.divide(-np.expm1(-z), z, out=np.ones_like(z), where=z > 0.0)
    curved = 2.0 * growth / (1.0 + growth) * bend(z) if integrator == "exponential" else np.zeros_like(z)
    return Advance(np.exp(-z), prony.moduli * (phi + curved), -growth * prony.moduli * curved)


def bend(z: ArrayLike) -> Array:
    """Return `q(z) = int_0^1 exp(-z x) (1/2 - x) dx = (1 + exp(-z))/(2 z) - (1 - exp(-z))/z^2`, the response of a
    branch to a bend of the displacement within a step `z = dt/tau`."""
    z = np.asarray(z, float)
    safe = np.maximum(z, BEND_SERIES)
    lost = np.expm1(-safe)
    closed = (0.5 * (2.0 + lost) + lost / safe) / safe
    small = np.minimum(z, BEND_SERIES)
    return np.asarray(np.where(z < BEND_SERIES, small * np.polynomial.polynomial.polyval(-small, BEND_TERMS), closed))


def creep_spectrum(*material: *Moduli) -> CreepSpectrum:
    """Return the creep compliance of a relaxation function.

    The compliance follows by partial fractions of 1/Gbar, with Gbar(s) = G_inf + sum_j G_j s tau_j/(1 + s tau_j). Gbar
    is zero at s = -1/lambda_i, where J_i = -1/(s Gbar'(s)). One lambda_i lies between each relaxation time and the
    next, and one above the last relaxation time. If G_inf = 0, the last lambda_i is infinite, and the body flows. Each
    zero is found by the logarithm of its distance to the nearer pole, so that no digits are lost, however close or far
    the times are.
    """
    series = normal_form(*material)
    spring, terms, times = series
    zeros = retardation(series)
    slopes = np.array([zero.slope for zero in zeros])
    retardation_times = np.array([zero.time for zero in zeros])
    fluidity = 1 / float(terms @ times) if spring == 0 else 0.0
    return CreepSpectrum(1 / float(spring + terms.sum()), 1 / (retardation_times * slopes), retardation_times, fluidity)


def creep(t: ArrayLike, *material: *Moduli) -> Array:
    """Return the creep compliance J(t) [1/Pa] for times t >= 0 [s], any shape: the strain after a unit step
    of stress."""
    return creep_spectrum(*material).compliance(t)


class Zero(NamedTuple):
    """A zero lambda of f = G_inf + sum_k G_k tau_k/(tau_k - lambda): its value `time`, which is a retardation time [s];
    the differences tau_k - lambda [s] for all k; and the slope df/dlambda [Pa/s]."""

    time: float
    distances: Array
    slope: float


def retardation(series: Prony) -> list[Zero]:
    """Return the zeros for a series in normal form, one above each relaxation time. If the long-term modulus is 0, the
    last zero is infinite and omitted."""
    return [_zero_above(index, series) for index in range(series.moduli.size - (series.modulus_inf == 0))]


def _zero_above(index: int, series: Prony) -> Zero:
    """Return the zero above tau[index]."""
    from scipy.optimize import brentq

    pole, sign, room = _nearer_pole(index, series)
    times = series.relaxation_times
    own, rest = _split(pole, sign * room, series)
    # f rises between poles: within this distance the term of the pole is larger than the rest
    least = room * abs(own / rest)
    bracket = np.log(least / 2), np.log(1.5 * room)
    offset = sign * np.exp(brentq(lambda x: sum(_split(pole, sign * np.exp(x), series)), *bracket, xtol=1e-15))
    distances = times - times[pole] - offset
    slope = float(np.sum(series.moduli * times / distances**2))
    return Zero(float(times[pole] + offset), distances, slope)


def _nearer_pole(index: int, series: Prony) -> tuple[int, int, float]:
    """Return the pole nearer to the zero above tau[index], the side of it (+1 above) and the largest
    possible distance."""
    spring, terms, times = series
    if index == times.size - 1:
        return index, 1, times[index] * terms.sum() / spring
    room = 0.5 * (times[index + 1] - times[index])
    return (index, 1, room) if sum(_split(index, room, series)) >= 0 else (index + 1, -1, room)


def _split(pole: int, offset: float, series: Prony) -> tuple[float, float]:
    """Return f at lambda = tau[pole] + offset as the term of that pole and the rest."""
    spring, terms, times = series
    others = np.arange(times.size) != pole
    distances = times[others] - times[pole] - offset
    return -terms[pole] * times[pole] / offset, spring + float(np.sum(terms[others] * times[others] / distances))


INSTANT = 30.0  # accuracy: m above which a wave has no memory, over 1/sqrt(shortest time)


@dataclass(frozen=True)
class Exponentials:
    """The sum of exponentials (1) of the module for times from `shortest` to `longest` [s], with a relative error of at
    most `bound`.

    `rates` m^2 [1/s] and `weights` [s^(-1/2)] belong to all waves. Only the first `kept` waves have a memory; the
    others are in equilibrium with the present heat. Waves above `end` [s^(-1/2)] are neglected. `first` and `spacing`
    are m_0 and h.
    """

    rates: slab_Array
    weights: slab_Array
    kept: int
    end: float
    bound: float
    first: float
    spacing: float


def fit_exponentials(shortest: float, longest: float, error: float) -> Exponentials:
    """Return the sum of exponentials for times from `shortest` to `longest` [s] with a relative error of at most
    `error` < 1/10."""
    h = np.pi**2 / (2.0 * np.log(4.0 * np.sqrt(2.0) / error))  # half of the error
    below = np.exp(-h * np.arange(1.0, 40.0 / h))  # m/m_0 of the waves below m_0, which are combined
    share, rate = below.sum(), (below**3).sum() / below.sum()
    spread = np.sqrt(np.pi) / np.pi * h * ((below**5).sum() - rate**2 * share)  # of the error, over (m_0^2 t)^(5/2)
    first = float((0.25 * error / spread) ** 0.2 / np.sqrt(longest))
    last = np.sqrt(np.log(4.0 / error) / shortest)
    count = 1 + int(np.ceil(np.log(last / first) / h))
    more = int(np.ceil(np.log(INSTANT / np.sqrt(shortest) / last) / h))
    m = first * np.exp(h * np.arange(count + max(more, 0)))
    rates = np.array([rate * first**2, *m**2])
    weights = 2.0 / np.pi * h * np.array([share * first, *m])
    turns = np.arange(1, 4) * np.pi**2 / h
    bound = 2.0 * float(np.sum(np.cosh(turns) ** -0.5)) + 0.5 * error
    return Exponentials(rates, weights, count + 1, float(m[-1] * np.exp(0.5 * h)), bound, first, float(h))


def shares_of_step(x: slab_Array) -> tuple[slab_Array, slab_Array]:
    """Return the weights, divided by dt, of the heat before and of the heat after a step, for heat linear in time. `x`
    is the length dt of the step times the rate, any shape."""
    small = np.minimum(x, 1e-3)
    safe = np.maximum(x, 1e-3)
    mean = np.where(x < 1e-3, 1.0 - small / 2 + small**2 / 6 - small**3 / 24, -np.expm1(-safe) / safe)
    after = np.where(x < 1e-3, 0.5 - small / 6 + small**2 / 24, (1.0 + np.expm1(-safe) / safe) / safe)
    return mean - after, after

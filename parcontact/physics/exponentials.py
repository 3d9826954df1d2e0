"""Memory of heat as a sum of exponentials: each wave of heat on the surface decays like the branches of a body.

Heat of the wavenumber k on the surface, released a time t ago, leaves the temperature `exp(-D k^2 t)/(e sqrt(pi
t))`, in the Laplace domain `1/(e sqrt(s + D k^2))`, with the effusivity e. With

    1/sqrt(pi t) = 2/pi int_0^inf exp(-m^2 t) dm ~ sum_j w_j exp(-m_j^2 t),   m_j = m_0 exp(j h),  w_j = 2/pi h m_j  (1)

the memory has one map for each j, which decays at the rate `m_j^2 + D k^2`. Each m belongs to a wave along the
depth, of wavenumber m/sqrt(D), and heat at depth enters it with the cosine transform of its distribution. The
trapezoidal rule (1) in ln m has the relative error `2 sum_n 1/sqrt(cosh(pi^2 n/h))` at every t, as the Fourier
transform of the integrand is a gamma function (G. Beylkin, L. Monzon, Appl. Comput. Harmon. Anal. 28 (2010) 131).
All waves below m_0 are combined to one with their mean rate, correct to second order in `m_0^2 t`; above the last
wave `erfc(m sqrt(t))` is left out.
"""

from dataclasses import dataclass

import numpy as np

from ..parallel.slab import Array

INSTANT = 30.0  # accuracy: m above which a wave has no memory, over 1/sqrt(shortest time)


@dataclass(frozen=True)
class Exponentials:
    """The sum (1) for times from `shortest` to `longest` [s], with a relative error of at most `bound`.

    `rates` m^2 [1/s] and `weights` [s^(-1/2)] belong to all waves. Only the first `kept` have a memory; the
    others follow the present heat. Waves above `end` [s^(-1/2)] are left out. `first` and `spacing` are m_0 and h.
    """

    rates: Array
    weights: Array
    kept: int
    end: float
    bound: float
    first: float
    spacing: float


def fit_exponentials(shortest: float, longest: float, error: float) -> Exponentials:
    """Return the sum for times from `shortest` to `longest` [s] with a relative error of at most `error` < 1/10."""
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


def shares_of_step(x: Array) -> tuple[Array, Array]:
    """Return the weights of the heat before and after a step `x = rate dt`, over dt, for heat linear in time."""
    small = np.minimum(x, 1e-3)
    safe = np.maximum(x, 1e-3)
    mean = np.where(x < 1e-3, 1.0 - small / 2 + small**2 / 6 - small**3 / 24, -np.expm1(-safe) / safe)
    after = np.where(x < 1e-3, 0.5 - small / 6 + small**2 / 24, (1.0 + np.expm1(-safe) / safe) / safe)
    return mean - after, after

"""Bodies in closed form or by their branches, and tables of them as instruments would write them."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Waves = NDArray[np.complex128]
DIGITS = 6  # of the numbers in a table


class Body(NamedTuple):
    """G(t) [Pa] at times [s], and G* [Pa] at angular frequencies [rad/s]."""

    relaxation: Callable[[Array], Array]
    modulus: Callable[[Array], Waves]


def branches(modulus_inf: float, moduli: Array, times: Array) -> Body:
    """Sums of Maxwell branches, from their definition."""

    def modulus(omega: Array) -> Waves:
        iwt = 1j * omega[:, None] * times
        return np.asarray(modulus_inf + (moduli * iwt / (1.0 + iwt)).sum(axis=1))

    return Body(lambda t: np.asarray(modulus_inf + (moduli * np.exp(-t[:, None] / times)).sum(axis=1)), modulus)


def fractional(modulus_inf: float, modulus: float, time: float, power: float) -> Body:
    """G* = G_inf + G z/(1 + z), z = (i w tau)^power: the continuous spectrum of Cole and Cole, summed in steps of 0.01
    of the logarithm, which is exact to 1e-8 (it is smooth and falls off as a power)."""
    x = np.arange(-60.0, 60.0, 0.01)
    shape = np.sin(power * np.pi) / (2 * np.pi * (np.cosh(power * x) + np.cos(power * np.pi)))
    return branches(modulus_inf, 0.01 * modulus * shape, np.exp(x + np.log(time)))


# ten branches, one in each decade: 3 MPa (1 + sum g exp(-t/tau))
TEN = branches(3e6, 3e6 * np.array([0.8, 0.7, 0.6, 0.5, 0.4, 0.35, 0.3, 0.25, 0.2, 0.15]), 10.0 ** np.arange(-4.0, 6.0))
# two in each decade; a broad and a steep continuous spectrum
DENSE = branches(2e6, 2e7 * np.power(0.75, np.arange(14.0)), np.power(10.0, np.arange(-4.0, 3.0, 0.5)))
BROAD = fractional(1e6, 1e7, 1e-4, 0.25)
STEEP = fractional(1e6, 5e8, 1e-6, 0.45)


def write(path: Path, head: str, *columns: Array, mark: str = " ") -> Path:
    """A table with a line of names above columns of equal length."""
    rows = zip(*columns, strict=True)
    lines = [head, *(mark.join(f"{value:.{DIGITS}g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def noisy(values: Array, share: float, seed: int = 1) -> Array:
    """Values with relative errors of a normal distribution."""
    return np.asarray(values * (1.0 + share * np.random.default_rng(seed).standard_normal(values.size)))

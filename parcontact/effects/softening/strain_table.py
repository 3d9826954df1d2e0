"""Factors of the moduli of filled rubber over the amplitude of the shear strain.

The softened body is equivalent linear, `G*(omega, gamma) = f(gamma) G'(omega) + i g(gamma) G''(omega)`: f and g come
from a sweep of the strain and depend on gamma alone.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...parallel.slab import Array

ROUNDING = 1e-9  # rounding: relative, of a wavenumber at the end of an octave
MIXED = 0.7  # tuning: exponent of the new strain in that of the next round


@dataclass(frozen=True)
class StrainTable:
    """Factors `storage` (f) and `loss` (g) [-] at rising amplitudes of the shear `strain` [-]; between them they are
    linear in the logarithm of the strain, outside they have the values of the ends."""

    start: ClassVar[float] = 0.02  # tuning: strain of the first round of a fixed point

    strain: tuple[float, ...]
    storage: tuple[float, ...]
    loss: tuple[float, ...]

    def factors(self, strain: Array | float) -> tuple[Array, Array]:
        """Return f and g at strains above 0, any shape."""
        place = np.log(strain)
        known = np.log(self.strain)
        return np.interp(place, known, self.storage), np.interp(place, known, self.loss)

    @staticmethod
    def mixed(found: ArrayLike, before: ArrayLike) -> Array:
        """Return the strains of the next round of a fixed point; a strain that was not found (NaN or 0) stays."""
        new, old = np.asarray(found, float), np.asarray(before, float)
        return np.where(new > 0.0, new**MIXED * old ** (1.0 - MIXED), old)

    def at(self, strain: float) -> Callable[[Array], tuple[Array, Array]]:
        """Return the factors of all waves at one strain, as a function of their wavenumbers."""
        return Softened(self, 1.0, (strain,)).factors

    def reaches(self, strain: float) -> bool:
        """Return True if a strain is within the table."""
        return self.strain[0] <= strain <= self.strain[-1]


@dataclass(frozen=True)
class Softened:
    """Factors of the moduli of each wave, from the strain of each octave of wavenumbers.

    The first octave begins at the wavelength `longest` [any unit of length]; the last one contains all shorter waves.
    """

    table: StrainTable
    longest: float
    strains: tuple[float, ...]

    def octave(self, q: Array) -> NDArray[np.int64]:
        """Return the number of the octave of each wavenumber [1/length]."""
        return np.minimum(octave_of(q, self.longest), len(self.strains) - 1)

    def same_factors(self, other: "Softened") -> bool:
        """Return True if the octaves have the factors of other strains."""
        own, others = (self.table.factors(np.array(one.strains)) for one in (self, other))
        return bool(np.array_equal(own, others))

    def factors(self, q: Array) -> tuple[Array, Array]:
        """Return f and g of waves with these wavenumbers."""
        f, g = self.table.factors(np.array(self.strains))
        octave = self.octave(q)
        return f[octave], g[octave]


def octave_of(q: Array, longest: float) -> NDArray[np.int64]:
    """Return the number of the octave of each wavenumber [1/length], from the wavelength `longest` on."""
    ratio = np.maximum(q * longest / (2.0 * np.pi), 1.0)
    return np.floor(np.log2(ratio * (1.0 + ROUNDING))).astype(np.int64)


def strains_in_full_contact(q: Array, slopes: Array, group: NDArray[np.int64], count: int) -> Array:
    """Return the strain [-] of each group of waves in full contact, from the mean square slopes of waves with the
    wavenumbers q, shape (n,), and the number of their group, below `count`; NaN for a group without waves.

    With r = k_j/q it is `gamma_q^2 = sum_j 12 (k_j A_j)^2 r^2/(1 + r)^5`; `(k A)^2` is twice the mean square slope.
    """
    ratio = q / q[:, None]
    squares = (24.0 * slopes * ratio**2 / (1.0 + ratio) ** 5).sum(axis=1)
    sums, whole = (np.bincount(group, weights, count) for weights in (slopes * squares, slopes))
    return np.sqrt(np.divide(sums, whole, out=np.full(count, np.nan), where=whole > 0.0))

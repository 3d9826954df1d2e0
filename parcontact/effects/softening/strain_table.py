"""Factors of the moduli of filled rubber over the amplitude of the shear strain.

The softened body is equivalent linear, `G*(omega, gamma) = f(gamma) G'(omega) + i g(gamma) G''(omega)`: f and g come
from a sweep of the strain and depend on gamma alone.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ...parallel.slab import Array

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

    def octave(self, q: Array) -> np.ndarray:
        """Return the number of the octave of each wavenumber [1/length]."""
        ratio = np.maximum(q * self.longest / (2.0 * np.pi), 1.0)
        return np.minimum(np.floor(np.log2(ratio * (1.0 + 1e-9))).astype(np.int64), len(self.strains) - 1)

    def same_factors(self, other: "Softened") -> bool:
        """Return True if the octaves have the factors of other strains."""
        own, others = (self.table.factors(np.array(one.strains)) for one in (self, other))
        return bool(np.array_equal(own, others))

    def factors(self, q: Array) -> tuple[Array, Array]:
        """Return f and g of waves with these wavenumbers."""
        f, g = self.table.factors(np.array(self.strains))
        octave = self.octave(q)
        return f[octave], g[octave]

"""Factors of the moduli of filled rubber as functions of the amplitude of shear strain, and files that contain them.

At each strain amplitude gamma the softened body is linear, with the modulus
`G*(omega, gamma) = f(gamma) G'(omega) + i g(gamma) G''(omega)`. f and g come from a sweep of the strain and depend on
gamma alone. A file has these factors, or both moduli, at each strain amplitude.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import InputError
from ...parallel.slab import Array
from ...text_tables import Table, read_named_columns

ROUNDING = 1e-9  # rounding: relative, of a wavenumber at the end of an octave
MIXED = 0.7  # tuning: exponent of the new strain in that of the next round


@dataclass(frozen=True)
class StrainTable:
    """Factors `storage` (f) and `loss` (g) [-] at rising amplitudes of the shear `strain` [-]. Between these strains
    the factors are linear in the logarithm of the strain; outside they are constant."""

    start: ClassVar[float] = 0.02  # tuning: strain of the first round of a fixed point

    strain: tuple[float, ...]
    storage: tuple[float, ...]
    loss: tuple[float, ...]

    def factors(self, strain: Array | float) -> tuple[Array, Array]:
        """Return the factors f of the storage modulus and g of the loss modulus, in the shape of `strain`. Strains are
        above 0."""
        place = np.log(strain)
        known = np.log(self.strain)
        return np.interp(place, known, self.storage), np.interp(place, known, self.loss)

    @staticmethod
    def mixed(found: ArrayLike, before: ArrayLike) -> Array:
        """Return the strains for the next round, from the strains `found` in this round and the strains `before` it. If
        a strain was not found (NaN or 0), the one before stays."""
        new, old = np.asarray(found, float), np.asarray(before, float)
        return np.where(new > 0.0, new**MIXED * old ** (1.0 - MIXED), old)

    def at(self, strain: float) -> Callable[[Array], tuple[Array, Array]]:
        """Return a function that takes wavenumbers, and returns for each of them the factors f and g at this `strain`
        [-]."""
        return Softened(self, 1.0, (strain,)).factors

    def reaches(self, strain: float) -> bool:
        """Return True if a strain is within the range of the table."""
        return self.strain[0] <= strain <= self.strain[-1]


@dataclass(frozen=True)
class Softened:
    """Factors of the moduli for each wave, which the strain of the wave's octave determines. `strains` has one item per
    octave.

    The first octave begins at the wavelength `longest`, in any unit of length. The last octave contains all shorter
    waves.
    """

    table: StrainTable
    longest: float
    strains: tuple[float, ...]

    def octave(self, q: Array) -> NDArray[np.int64]:
        """Return the number of the octave of each wavenumber q, in 1 over the unit of `longest`."""
        return np.minimum(octave_of(q, self.longest), len(self.strains) - 1)

    def same_factors(self, other: "Softened") -> bool:
        """Return True if the factors of all octaves equal those of `other`."""
        own, others = (self.table.factors(np.array(one.strains)) for one in (self, other))
        return bool(np.array_equal(own, others))

    def factors(self, q: Array) -> tuple[Array, Array]:
        """Return the factors of both moduli for waves with the wavenumbers q, each in the shape of q."""
        f, g = self.table.factors(np.array(self.strains))
        octave = self.octave(q)
        return f[octave], g[octave]


def octave_of(q: Array, longest: float) -> NDArray[np.int64]:
    """Return the number of the octave of each wavenumber q; octaves are counted from the wavelength `longest`. The unit
    of q is 1 over that of `longest`."""
    ratio = np.maximum(q * longest / (2.0 * np.pi), 1.0)
    return np.floor(np.log2(ratio * (1.0 + ROUNDING))).astype(np.int64)


def strains_in_full_contact(q: Array, slopes: Array, group: NDArray[np.int64], count: int) -> Array:
    """Return the strain [-] of each group of waves in full contact, shape (count,), from the mean square slopes of
    waves with the wavenumbers q, both of shape (n,). `group` has the number of each wave's group, below `count`. The
    strain of a group without waves is NaN.

    All waves j strain the rubber in which the wave of wavenumber q dissipates. With r = k_j/q the square of the strain
    of this wave is `gamma_q^2 = sum_j 12 (k_j A_j)^2 r^2/(1 + r)^5`, where `(k_j A_j)^2` is twice the mean square slope
    of the wave j.
    """
    ratio = q / q[:, None]
    squares = (24.0 * slopes * ratio**2 / (1.0 + ratio) ** 5).sum(axis=1)
    sums, whole = (np.bincount(group, weights, count) for weights in (slopes * squares, slopes))
    return np.sqrt(np.divide(sums, whole, out=np.full(count, np.nan), where=whole > 0.0))


FACTORS = ("f", "g")  # of the storage and of the loss modulus
PAIRS = (("G_stor", "G_loss"), ("E_stor", "E_loss"), ("*_stor", "*_loss"))
HELD = {"f": "frequency", "omega": "frequency", "T": "temperature"}  # of which a sweep has one
NAMES = {"strain", *FACTORS, "omega", "T", *(name for pair in PAIRS for name in pair)}
PLAIN = {"strain", *FACTORS}  # columns that need no unit
HIGHEST = 10.0  # physics: strain [-] that no rubber reaches in shear
UNITS = {"": 1.0, "%": 0.01}
EXAMPLE = "strain,f,g or strain[%],G'[MPa],G''[MPa]"


def read_sweep(path: Path, reference: float | None) -> tuple[StrainTable, str]:
    """Return the factors in the file of a strain sweep, and a sentence on the strain at which they are 1; the sentence
    is '' if the file has factors.

    If the file has moduli, they are divided by their values at the strain `reference` [-], which is by default the
    smallest strain. Raises InputError with the file and what was expected.
    """
    table = read_named_columns(path, f"a strain sweep ({EXAMPLE})", EXAMPLE, NAMES, _is_header, PLAIN)
    pair = next((pair for pair in (FACTORS, *PAIRS) if {"strain", *pair} <= table.columns.keys()), None)
    if pair is None or len(table.lines) < 2:
        raise InputError(f"{path}: a strain sweep with at least two rows was expected ({EXAMPLE})")
    _refuse_several(table, pair)
    unit = table.unit("strain", UNITS)
    rows = sorted(zip(*(table.columns[name] for name in ("strain", *pair)), strict=True))
    strain, storage, loss = (tuple(column) for column in zip(*rows, strict=True))
    strain = tuple(unit * value for value in strain)
    if not strain[0] > 0.0 or len(set(strain)) < len(strain) or min(*storage, *loss) <= 0.0:
        raise InputError(f"{path}: strains must be positive and different, moduli or factors positive")
    if strain[-1] > HIGHEST and not table.units.get("strain"):
        raise InputError(
            f"{path}: strains without a unit reach {strain[-1]:g}; write strain[%] if they are in per cent"
        )
    found = StrainTable(strain, storage, loss)
    if pair == FACTORS:
        return found, ""
    at = strain[0] if reference is None else reference
    if not found.reaches(at):
        raise InputError(
            f"{path}: softening.reference_strain {at:g} is outside of its strains, {strain[0]:g} to {strain[-1]:g}"
        )
    first, second = (float(value) for value in found.factors(at))
    why = "the smallest one, as softening.reference_strain is not given" if reference is None else "as given"
    said = f"softening: moduli of {path.name} are divided by those at a strain of {at:g}, {why}"
    return StrainTable(strain, tuple(v / first for v in storage), tuple(v / second for v in loss)), said


def _is_header(names: set[str]) -> bool:
    return "strain" in names and any(names.issuperset(pair) for pair in (FACTORS, *PAIRS))


def _refuse_several(table: Table, pair: tuple[str, str]) -> None:
    """Refuse sweeps at several frequencies or temperatures."""
    for name, what in HELD.items():
        values = sorted(set(table.columns.get(name, ()))) if name not in pair else []
        if len(values) > 1:
            few = f"{values[0]:g} to {values[-1]:g} {table.units[name]}".strip()
            raise InputError(
                f"{table.path}: a strain sweep has one {what}, got {len(values)}, {few}; keep the rows of one"
            )

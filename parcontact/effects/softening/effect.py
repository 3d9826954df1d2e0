"""Softening of filled rubber by strain: the section `softening`, factors of both moduli, and the effect.

At each strain amplitude gamma the softened body is linear, with the modulus
`G*(omega, gamma) = f(gamma) G'(omega) + i g(gamma) G''(omega)`. f and g come from a sweep of the strain and depend on
gamma alone. A file has these factors, or both moduli, at each strain amplitude. The effect acts only in steady sliding
(`steady`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import AfterValidator, Field, PrivateAttr

from ...errors import InputError
from ...job.parts import Part, Positive, Rule, existing_file, rules_of
from ...job.yaml_text import Fault, refuse
from ...parallel.slab import Array
from ...printed import quantity
from ...text_tables import Table, read_named_columns
from ..effect import BY_THEORY, Decision, Effect

ROUNDING = 1e-9  # rounding: relative, of a wavenumber at the end of an octave
MIXED = 0.7  # tuning: exponent of the new strain in that of the next round


@dataclass(frozen=True)
class StrainTable:
    """Factors `storage` (f) and `loss` (g) [-] at rising amplitudes of the shear `strain` [-]. Between these strains
    the factors are linear in the logarithm of the strain; outside this range they are constant."""

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
        """Return the strains for the next iteration, from the strains `found` in this iteration and the strains
        `before` it. Where no strain was found (NaN or 0), the strain before stays."""
        new, old = np.asarray(found, float), np.asarray(before, float)
        return np.where(new > 0.0, new**MIXED * old ** (1.0 - MIXED), old)

    def at(self, strain: float) -> Callable[[Array], tuple[Array, Array]]:
        """Return a function that takes wavenumbers, and returns for each wavenumber the factors f and g at this
        `strain` [-]."""
        return Softened(self, 1.0, (strain,)).factors

    def reaches(self, strain: float) -> bool:
        """Return True if a strain is within the range of the table, so that its factors are known."""
        return self.strain[0] <= strain <= self.strain[-1]


@dataclass(frozen=True)
class Softened:
    """Factors of the moduli for each wave. The factors of a wave follow from the strain of its octave. `strains` has
    one item per octave [-].

    The first octave begins at the wavelength `longest`, in any unit of length. The last octave contains all shorter
    waves.
    """

    table: StrainTable
    longest: float
    strains: tuple[float, ...]

    def octave(self, q: Array) -> NDArray[np.int64]:
        """Return the number of the octave of each wavenumber q. If `longest` is in m, q is in 1/m."""
        return np.minimum(octave_of(q, self.longest), len(self.strains) - 1)

    def same_factors(self, other: Softened) -> bool:
        """Return True if the factors of all octaves equal those of `other`."""
        own, others = (self.table.factors(np.array(one.strains)) for one in (self, other))
        return bool(np.array_equal(own, others))

    def factors(self, q: Array) -> tuple[Array, Array]:
        """Return the factors of both moduli for waves with the wavenumbers q, each in the shape of q."""
        f, g = self.table.factors(np.array(self.strains))
        octave = self.octave(q)
        return f[octave], g[octave]


def octave_of(q: Array, longest: float) -> NDArray[np.int64]:
    """Return the number of the octave of each wavenumber q. Octaves are counted from the wavelength `longest`. If
    `longest` is in m, q is in 1/m."""
    ratio = np.maximum(q * longest / (2.0 * np.pi), 1.0)
    return np.floor(np.log2(ratio * (1.0 + ROUNDING))).astype(np.int64)


def strains_in_full_contact(q: Array, slopes: Array, group: NDArray[np.int64], count: int) -> Array:
    """Return the strain [-] of each group of waves in full contact, shape (count,), from the mean square slopes of
    waves with the wavenumbers q, both of shape (n,). `group` has the number of each wave's group, below `count`. The
    strain of a group without waves is NaN.

    All waves j strain the rubber in which a wave of wavenumber q dissipates. With the wavenumbers k_j, the amplitudes
    A_j and r = k_j/q, the square of the strain of this wave is `gamma_q^2 = sum_j 12 (k_j A_j)^2 r^2/(1 + r)^5`. `(k_j
    A_j)^2` is twice the mean square slope of the wave j.
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
    """Return the factors in the file of a strain sweep, and a sentence on the strain at which these factors are 1. The
    sentence is '' if the file itself has factors.

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


Row = tuple[Positive, Positive, Positive]
LEAST_POISSON = 0.45  # physics: Poisson's ratio from which the strain of an incompressible body holds to 10 %


def _rising(table: tuple[Any, ...] | None) -> Iterator[Fault]:
    if table is None or any(row is None or None in row for row in table):
        return
    strains = [row[0] for row in table]
    if len(strains) < 2 or any(b <= a for a, b in pairwise(strains)):
        yield Fault("must be at least two rows [strain, f, g] with rising strains [-]", ("table",))


def _of_a_file(path: Path | None, reference: float | None) -> Iterator[Fault]:
    if path is None and reference is not None:
        yield Fault(
            "is for the path of a strain sweep; factors of a table are given as they are", ("reference_strain",)
        )


class Softening(Part):
    """The section `softening`: factors of the storage and of the loss modulus as functions of the amplitude of shear
    strain."""

    label: ClassVar[str] = "softening"
    table: tuple[Row, ...] | None = Field(
        default=None, description="a list of rows [strain, f, g], factors of G' and G''"
    )
    path: Annotated[Path, AfterValidator(existing_file)] | None = Field(
        default=None, description="the path of a strain sweep with the columns strain, f, g or strain and moduli"
    )
    reference_strain: Positive | None = Field(default=None, description="a positive strain [-] of the sweep")

    one_of = (("table", "path"),)
    rules = (*rules_of(_rising), Rule(("path", "reference_strain"), _of_a_file))

    _made: tuple[StrainTable, str] = PrivateAttr()

    def model_post_init(self, context: Any) -> None:
        if self.table:
            self._made = StrainTable(*zip(*self.table, strict=True)), ""
            return
        if self.path is None:
            return  # refused
        try:
            self._made = read_sweep(self.path, self.reference_strain)
        except InputError as error:
            refuse(Fault(f"cannot be read: {error}", ("path",)))

    @property
    def made(self) -> StrainTable:
        """Table of the factors of the moduli as functions of the strain."""
        return self._made[0]

    @property
    def fact(self) -> str:
        """A sentence on the strain at which the factors are 1; '' if the job gives the factors."""
        return self._made[1]


def only_in_steady_sliding(softening: Softening, history: Any, initial: Any) -> Iterator[Fault]:
    """Yield an error for jobs with a history. The softened modulus `f G' + i g G''` is no Prony series, so that no
    relaxation function of the body in time is known."""
    if history:
        sentence = (
            "cannot be used with softening, which is for friction curves (parcontact steady): softened moduli are no"
        )
        yield Fault(f"{sentence} Prony series; leave out the history and give steady.pressures", ("history",))
    if initial.state == "steady":
        yield Fault("cannot be used with softening, as softened moduli are no Prony series; leave it out", ("initial",))


def in_a_periodic_box(softening: Softening, grid: Any) -> Iterator[Fault]:
    """Yield an error for free boxes, since strains are known for waves in a periodic box only."""
    if not all(grid.cyclic):
        yield Fault(
            "must be periodic with softening: strains are those of waves in a periodic box", ("grid", "boundary")
        )


def of_rubber(softening: Softening, material: Any) -> Iterator[Fault]:
    """Yield an error for bodies that dissipate nothing or are compressible."""
    if not material.fitted.branches:
        yield Fault(
            "needs a material that relaxes (model zener or dma): strains count where it dissipates", ("softening",)
        )
    if material.poisson < LEAST_POISSON:
        sentence = (
            f"must be at least {LEAST_POISSON:g} with softening, whose strains are those of an incompressible body"
        )
        yield Fault(f"{sentence}, got {material.poisson:g}", ("material", "poisson"))


class SofteningEffect(Effect[None]):
    """Effect of strain softening. It has no part in steps: jobs with a history are refused."""

    section: ClassVar[type[Part]] = Softening
    in_curves: ClassVar[bool] = True
    columns: ClassVar[tuple[str, ...]] = ()
    rules: ClassVar[tuple[Rule, ...]] = rules_of(only_in_steady_sliding, in_a_periodic_box, of_rubber)
    forbids: ClassVar[Mapping[str, str]] = {
        BY_THEORY: "the theory excludes softening, as its moduli do not depend on the strain: leave out softening"
    }

    @staticmethod
    def facts(job: Any) -> Iterator[str]:
        """Yield a sentence on the strain at which the material's moduli were measured."""
        if text := job.section("softening").fact:
            yield text

    @staticmethod
    def curve_options(job: Any) -> Iterator[str]:
        """Yield the option for which friction curves have further columns (`Column.when`): softening."""
        yield "softening"

    @staticmethod
    def describe_waves(job: Any, q: Array, slopes: Array) -> Iterator[str]:
        """Yield a sentence with the strain and the factors f and g of each octave of waves in full contact."""
        longest = max(job.grid.size)
        octave = octave_of(q, longest)
        strains = strains_in_full_contact(q, slopes, octave, int(octave.max()) + 1)
        known = np.unique(octave)
        found = zip(known, strains[known], *job.section("softening").made.factors(strains[known]), strict=True)
        ends = {k: quantity(longest / 2.0 ** (k + 1), "m") for k in known}
        each = (f"{strain:.2g} down to {ends[k]} (f {f:.2g}, g {g:.2g})" for k, strain, f, g in found)
        yield f"softening: strains of waves in full contact {', '.join(each)}"

    @staticmethod
    def decide(job: Any) -> Decision:
        section: Softening | None = job.section("softening")
        if section is None:
            return Decision("softening", False, "there is no softening section")
        low, high = section.made.strain[0], section.made.strain[-1]
        return Decision("softening", True, f"strains from {low:g} to {high:g}")

"""Softening of filled rubber by strain: the section `softening`, with factors of both moduli, and the effect.

The effect acts only in steady sliding (`steady`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import AfterValidator, Field, PrivateAttr

from ...errors import InputError
from ...job.parts import Part, Positive, Rule, existing_file, rules_of
from ...job.yaml_text import Fault, refuse
from ...parallel.slab import Array
from ...printed import quantity
from ..effect import BY_THEORY, Decision, Effect
from .strain_table import StrainTable, octave_of, read_sweep, strains_in_full_contact

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
        if self.table is not None:
            self._made = StrainTable(*zip(*self.table, strict=True)), ""
            return
        if self.path is None:
            return  # `one_of` reports it
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


def only_in_steady_sliding(softening: Softening | None, history: Any, initial: Any) -> Iterator[Fault]:
    """Yield an error for jobs with a history. The softened modulus `f G' + i g G''` is no Prony series, so that no
    relaxation function of the body in time is known."""
    if softening is None:
        return
    if history:
        sentence = (
            "cannot be used with softening, which is for friction curves (parcontact steady): softened moduli are no"
        )
        yield Fault(f"{sentence} Prony series; leave out the history and give steady.pressures", ("history",))
    if initial.state == "steady":
        yield Fault("cannot be used with softening, as softened moduli are no Prony series", ("initial",))


def in_a_periodic_box(softening: Softening | None, grid: Any) -> Iterator[Fault]:
    """Yield an error for free boxes, since strains are known for waves in a periodic box only."""
    if softening is not None and not all(grid.cyclic):
        yield Fault(
            "must be periodic with softening: strains are those of waves in a periodic box", ("grid", "boundary")
        )


def of_rubber(softening: Softening | None, material: Any) -> Iterator[Fault]:
    """Yield an error for bodies that dissipate nothing or are compressible."""
    if softening is None:
        return
    if not material.fitted.branches:
        yield Fault(
            "needs a material that relaxes (model zener or dma): strains count where it dissipates", ("softening",)
        )
    if material.poisson < LEAST_POISSON:
        sentence = (
            f"must be at least {LEAST_POISSON:g} with softening, whose strains are those of an incompressible body"
        )
        yield Fault(f"{sentence}, got {material.poisson:g}", ("material", "poisson"))


RULES = rules_of(only_in_steady_sliding, in_a_periodic_box, of_rubber)


class SofteningEffect(Effect[None]):
    """Effect of strain softening. It has no part in steps: jobs with a history are refused."""

    section: ClassVar[type[Part]] = Softening
    in_curves: ClassVar[bool] = True
    columns: ClassVar[tuple[str, ...]] = ()
    rules: ClassVar[tuple[Rule, ...]] = RULES
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

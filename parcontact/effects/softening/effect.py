"""The effect of softening: its section and its decision. It acts only in steady sliding (`steady`)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import numpy as np

from ...job.parts import Part, Rule
from ...parallel.slab import Array
from ...printed import quantity
from ..effect import BY_THEORY, Decision, Effect
from .section import RULES, Softening
from .strain_table import octave_of, strains_in_full_contact


class SofteningEffect(Effect[None]):
    """Effect of strain softening. Jobs with a history are refused, so that no march creates it."""

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
        """Yield the requirements of columns of friction curves that the job meets."""
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

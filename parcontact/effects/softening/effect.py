"""Softening as an effect: its section and its decision. It acts in steady sliding only (`steady`)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from ...job.sections.part import Part, Rule
from ..effect import Decision, Effect
from .section import RULES, Softening


class SofteningEffect(Effect[None]):
    """Strain softening; histories are refused, so that no march makes it."""

    section: ClassVar[type[Part]] = Softening
    columns: ClassVar[tuple[str, ...]] = ()
    rules: ClassVar[tuple[Rule, ...]] = RULES

    @staticmethod
    def facts(job: Any) -> Iterator[str]:
        """Yield a sentence on the strain at which moduli are those of the material."""
        if text := job.section("softening").fact:
            yield text

    @staticmethod
    def decide(job: Any) -> Decision:
        section: Softening | None = job.section("softening")
        if section is None:
            return Decision("softening", False, "there is no softening section")
        low, high = section.made.strain[0], section.made.strain[-1]
        return Decision("softening", True, f"strains from {low:g} to {high:g}")

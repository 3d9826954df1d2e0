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
    def steady_loop(setup: Any) -> Any:
        """Return the fixed point of strains, a loop around each steady state on one grid."""
        from .steady import StrainLoop  # what solves is not loaded to check a job

        return StrainLoop(setup)

    @staticmethod
    def facts(job: Any) -> Iterator[str]:
        """Yield a sentence on the strain at which moduli are those of the material."""
        if text := job.section("softening").fact:
            yield text

    @staticmethod
    def describe_bands(job: Any, cut: Any) -> Iterator[str]:
        """Yield a sentence on the strains of bands in full contact."""
        from .full_contact import describe_bands

        return describe_bands(job, cut)

    @staticmethod
    def decide(job: Any) -> Decision:
        section: Softening | None = job.section("softening")
        if section is None:
            return Decision("softening", False, "there is no softening section")
        low, high = section.made.strain[0], section.made.strain[-1]
        return Decision("softening", True, f"strains from {low:g} to {high:g}")

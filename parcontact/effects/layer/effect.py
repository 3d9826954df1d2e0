"""A layer of rubber: another response of the surface to pressure, at the same cost; steps are as ever."""

from __future__ import annotations

from typing import Any, ClassVar

from ...job import limits
from ...job.parts import Part, Rule
from ..effect import Decision, Effect
from .response import Layer
from .section import RULES, Body, doubt_span, doubts_of_layer


class RubberLayer(Effect[None]):
    """A layer on a rigid base."""

    section: ClassVar[type[Part]] = Body
    columns: ClassVar[tuple[str, ...]] = ()
    in_curves: ClassVar[bool] = True
    in_bands_over_time: ClassVar[bool] = True  # all bands are refused
    lifts: ClassVar[tuple[Any, ...]] = (limits.steady_bodies_do_not_flow,)
    rules: ClassVar[tuple[Rule, ...]] = RULES
    doubts = staticmethod(doubts_of_layer)
    doubt_heights = staticmethod(doubt_span)

    @staticmethod
    def decide(job: Any) -> Decision:
        if (found := job.section("body")) is None:
            return Decision("body", False, "no body section: a half space")
        return Decision("body", True, f"a layer of {found.thickness:g} m, on a {found.base} base")

    @staticmethod
    def response(job: Any, unit: float) -> Layer:
        """Return the response of the layer of a job, with lengths in a `unit` [m]."""
        return Layer(job.body.thickness / unit, job.body.base, poisson=job.material.poisson)

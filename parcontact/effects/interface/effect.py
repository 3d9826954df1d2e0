"""The effect of interface friction: a shear stress on the area in contact (`physics.motion`)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

from ...columns import added_by
from ...physics.measures import Measures
from ...physics.motion import InterfaceFriction
from ..effect import Changes, Instant
from .section import Interface, InterfaceEffect


def shares(measures: Measures, velocity: tuple[float, float]) -> tuple[float, float]:
    """Return the parts of the friction coefficient by the body and by the interface: the components of both forces
    along the total force, divided by the normal force. A part is negative if its force opposes the total force, as the
    force of the interface may after a reversal."""
    scale = math.hypot(measures.force_x, measures.force_y) * math.hypot(*velocity)
    along = -(measures.force_x * velocity[0] + measures.force_y * velocity[1]) / scale if scale else 0.0
    own = along * measures.friction_interface
    return measures.friction - own, own


class InterfaceColumns(InterfaceEffect[tuple[float, float]]):
    """Columns of the two parts of friction, by the body and by the interface, whose sum is friction."""

    columns: ClassVar[tuple[str, ...]] = added_by("interface")

    def __new__(cls, scene: Any) -> Any:
        """Return the effect of a job: with `stick` that of tractions (`effects.stick.effect`)."""
        if not scene.job.section("interface").stick:
            return super().__new__(cls)
        from ..stick.effect import StickSlip

        return StickSlip(scene)

    @staticmethod
    def shear(job: Any) -> InterfaceFriction | None:
        """Return the shear stress of the section, shifted to the temperature of the material; None with `stick`."""
        law: Interface = job.section("interface")
        return None if law.stick else law.friction(job.material)

    def __init__(self, scene: Any) -> None:
        self._energies = bool(scene.job.output.energy)

    def at_rest(self) -> tuple[float, float]:
        return 0.0, 0.0

    def follow(self, instant: Instant, memory: tuple[float, float]) -> Changes[tuple[float, float]]:
        return Changes(shares(instant.measures, instant.step.velocity))

    def last_lines(self, memory: tuple[float, float]) -> Iterator[str]:
        if self._energies:
            yield "friction of the interface heats the surface: it is no part of work and dissipated"

    def values(self, memory: tuple[float, float]) -> Sequence[float]:
        return memory

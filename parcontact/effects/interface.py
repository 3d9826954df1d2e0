"""Interface friction: a shear stress on the area in contact (`physics.interface_friction`)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

from pydantic import Field

from ..columns import added_by
from ..job.sections.part import Part, Rule
from ..job.sections.quantities import Positive
from ..job.text.fault import Fault
from ..physics.interface_friction import InterfaceFriction
from ..physics.measures import Measures
from .effect import Changes, Decision, Effect, Instant
from .relaxation import time_factor_of

LEAST_POISSON = 0.49  # physics: below it shear moves the surface, and the solve would have to be coupled


def _whole_bell(velocity: float | None, width: float | None) -> Iterator[Fault]:
    if (velocity is None) != (width is None):
        missing, given = ("velocity", "width") if velocity is None else ("width", "velocity")
        yield Fault(f"is missing; a bell over the velocity needs it beside {given}", (missing,))


def _incompressible(interface: Any, material: Any) -> Iterator[Fault]:
    if interface is not None and material.poisson < LEAST_POISSON:
        yield Fault(
            f"needs material.poisson of at least {LEAST_POISSON:g}, got {material.poisson:g}: shear on a compressible "
            "body moves its surface, which is not solved for (see parcontact manual limits)",
            ("interface",),
        )


class Interface(Part):
    """The `interface` section: a constant shear stress, or a bell over the logarithm of the velocity."""

    label: ClassVar[str] = "interface"
    shear_stress: Positive = Field(description="a positive shear stress on the area in contact [Pa]")
    velocity: Positive | None = Field(default=None, description="a positive velocity [m/s], where the bell is highest")
    width: Positive | None = Field(default=None, description="a positive number of decades, the width of the bell [-]")

    rules = (Rule(("velocity", "width"), _whole_bell),)


def shares(measures: Measures, velocity: tuple[float, float]) -> tuple[float, float]:
    """Return what the body and the interface make of friction: their forces in the direction of both together, over the
    normal force. The part of one is negative where its force is against the whole, as the interface's may be after a
    reversal."""
    scale = math.hypot(measures.force_x, measures.force_y) * math.hypot(*velocity)
    along = -(measures.force_x * velocity[0] + measures.force_y * velocity[1]) / scale if scale else 0.0
    own = along * measures.friction_interface
    return measures.friction - own, own


class InterfaceColumns(Effect[tuple[float, float]]):
    """Columns of the parts of friction that the body and the interface make, which add up to it."""

    section: ClassVar[type[Part]] = Interface
    columns: ClassVar[tuple[str, ...]] = added_by("interface")
    rules: ClassVar[tuple[Rule, ...]] = (Rule(("interface", "material"), _incompressible),)

    @staticmethod
    def decide(job: Any) -> Decision:
        law: Interface | None = job.section("interface")
        why = "there is no interface section" if law is None else f"a shear stress of {law.shear_stress:g} Pa at most"
        return Decision("interface", law is not None, why)

    @staticmethod
    def shear(job: Any) -> InterfaceFriction:
        """Return the stress of the section, shifted to the temperature of the material."""
        law: Interface = job.section("interface")
        return InterfaceFriction(law.shear_stress, law.velocity, law.width or 1.0, time_factor_of(job.material))

    def __init__(self, scene: Any) -> None: ...

    def at_rest(self) -> tuple[float, float]:
        return 0.0, 0.0

    def follow(self, instant: Instant, memory: tuple[float, float]) -> Changes[tuple[float, float]]:
        return Changes(shares(instant.measures, instant.step.velocity))

    def values(self, memory: tuple[float, float]) -> Sequence[float]:
        return memory

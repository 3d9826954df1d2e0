"""Heat of sliding: how warm the rubber becomes below the contact (`physics.heat`)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, ClassVar, Literal

from numpy.typing import DTypeLike
from pydantic import Field

from ..job.checks import limits
from ..job.sections.part import Part, Rule
from ..job.sections.quantities import Positive
from ..job.text.fault import Fault
from ..physics.entries import Entry
from ..physics.heat import Conductor
from ..physics.units import Units
from .effect import Decision, Instant


def _no_march(thermal: Any, history: Any) -> Iterator[Fault]:
    if thermal is not None and history:
        yield Fault("is for steady sliding: leave out the history, and solve with `parcontact steady`", ("thermal",))


class Thermal(Part):
    """The `thermal` section: how the rubber conducts heat, and whether warm rubber relaxes faster."""

    label: ClassVar[str] = "thermal"
    conductivity: Positive = Field(description="a positive conductivity of the rubber [W/(m K)]")
    diffusivity: Positive = Field(description="a positive thermal diffusivity of the rubber [m^2/s]")
    feedback: Literal["none"] = "none"

    @property
    def conductor(self) -> Conductor:
        """The rubber."""
        return Conductor(self.conductivity, self.diffusivity)


class ThermalColumns:
    """The mean temperature rise of the contact, weighted by heat, and the highest one of the surface [K]."""

    section: ClassVar[type[Part]] = Thermal
    columns: ClassVar[tuple[str, ...]] = ("flash_temperature", "max_temperature")
    rules: ClassVar[tuple[Rule, ...]] = (Rule(("thermal", "history"), _no_march),)
    lifts: ClassVar[tuple[Any, ...]] = (limits.no_temperature,)

    @staticmethod
    def decide(job: Any) -> Decision:
        section: Thermal | None = job.section("thermal")
        why = "there is no thermal section" if section is None else f"feedback is {section.feedback}"
        return Decision("thermal", section is not None, why)

    @staticmethod
    def maps(job: Any) -> Sequence[DTypeLike]:
        return ()

    def __init__(self, scene: Any) -> None: ...

    def follow(self, instant: Instant) -> None: ...

    def values(self) -> Sequence[float]:
        return (0.0, 0.0)

    def entries(self, units: Units) -> dict[str, Entry]:
        """Nothing is remembered."""
        return {}

    def restore(self, saved: Any) -> None: ...

"""The `interface` section of a job, which gives the friction of the contact area itself (`physics.surface`), and the
effects that add this friction."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

from pydantic import Field

from ... import capabilities
from ...columns import added_by
from ...errors import Doubt, Kind
from ...job import limits
from ...job.parts import Flag, Part, Positive, Rule, rules_of
from ...job.surfaces import Rough, RoughSpectrum, Topography
from ...job.yaml_text import Fault
from ...physics.records import Measures, Memory
from ...physics.surface import InterfaceFriction
from ..branches import time_factor_of
from ..effect import Changes, Decision, Effect, Instant

SAME = 1e-9  # rounding: tolerance on Poisson's ratio
LEAST_POISSON = 0.49  # physics: least Poisson's ratio for which shear hardly moves the surface along its normal


def _bell(velocity: float | None, width: float | None, coefficient: float | None, stick: bool) -> Iterator[Fault]:
    if (velocity is None) != (width is None):
        missing, given = ("velocity", "width") if velocity is None else ("width", "velocity")
        yield Fault(f"is missing; a bell over the velocity needs it in addition to {given}", (missing,))
    if coefficient is not None and not stick:
        yield Fault("needs stick: true", ("coefficient",))
    if coefficient is not None and velocity is not None:
        yield Fault("cannot be used with coefficient: a bell over the velocity needs shear_stress", ("velocity",))


def _incompressible(interface: Any, material: Any) -> Iterator[Fault]:
    if interface.stick and abs(material.poisson - 0.5) > SAME:
        yield Fault(
            f"needs material.poisson of 0.5, got {material.poisson:g}: pressure on a compressible body moves its "
            "surface sideways, too, which is not solved for",
            ("interface", "stick"),
        )
    elif material.poisson < LEAST_POISSON:
        yield Fault(
            f"needs material.poisson of at least {LEAST_POISSON:g}, got {material.poisson:g}: shear on a compressible "
            "body moves its surface, which is not solved for (see parcontact manual limits)",
            ("interface",),
        )


def _sticks(
    interface: Any, grid: Any, initial: Any, steady: Any, bands: Any, history: Any, output: Any
) -> Iterator[Fault]:
    """Refuse jobs with stick that are not solved for, and maps of tractions without stick."""
    if not interface.stick:
        yield from (fault for check in OF_TRACTIONS for fault in check(output))
        return
    if grid is not None and grid.cyclic[0] != grid.cyclic[1]:
        sentence = (
            "needs grid.boundary: periodic or free, got [periodic, free], a box for which tractions are not solved"
        )
        yield Fault(sentence, ("interface", "stick"))
    for key, asked in (("initial", initial.state == "steady"), ("steady", steady is not None)):
        if asked:
            sentence = "cannot be used with interface.stick: steady sliding is solved without tractions that stick"
            yield Fault(f"{sentence}; slide into the steady state with a stage", (key,))
    if bands is not None and history:
        sentence = "cannot be used with bands and a history: tractions of all bands would have to be solved together"
        yield Fault(f"{sentence}; give the job a grid", ("interface", "stick"))


def _rolls(interface: Any, history: Any, surface: Any) -> Iterator[Fault]:
    """Refuse rolling without stick, of a rough surface, and in chosen steps."""
    if not interface.stick:
        yield from limits.no_rolling(history)
        return
    rough = any(isinstance(shape, Rough | RoughSpectrum | Topography) for shape in surface)
    for index, stage in enumerate(history):
        place = ("history", index, "creep")
        if stage is not None and stage.rolls and rough:
            yield Fault("needs a smooth surface: heights travel with the contact, those of a rough wheel do not", place)
        if stage is not None and stage.rolls and stage.chooses:
            yield Fault("needs cells_per_step or a time_step: chosen steps do not follow the error of rolling", place)


def _no_adhesion(interface: Any, adhesion: Any) -> Iterator[Fault]:
    if interface.coefficient is not None:
        sentence = (
            "cannot be used with adhesion: pressures are negative at the edge of contact, and the contact pressure "
            "(pressure plus work/range) depends on the range; give a shear_stress"
        )
        yield Fault(sentence, ("interface", "coefficient"))


OF_TRACTIONS = [check for name, check in limits.no_field.items() if name == "traction"]  # none without `effects.stick`


def _needs_its_folder(stick: bool, coefficient: float | None) -> Iterator[Fault]:
    """Refuse keys of `effects.stick` in a program without this folder."""
    asked = {"stick": stick, "coefficient": coefficient is not None}
    for key in (key for key, given in asked.items() if given and not capabilities.has("stick")):
        yield Fault("is not a key of interface; known keys: shear_stress, velocity, width", (key,), at_key=True)


class Interface(Part):
    """The `interface` section: friction by a shear stress, which is constant or a bell curve of the logarithm of the
    velocity, or by a coefficient. With `stick: true` this friction is an upper bound: points stick until the traction
    reaches it."""

    label: ClassVar[str] = "interface"
    shear_stress: Positive | None = Field(
        default=None, description="a positive shear stress on the area in contact [Pa]"
    )
    coefficient: Positive | None = Field(default=None, description="a positive coefficient of friction [-]")
    velocity: Positive | None = Field(default=None, description="a positive velocity [m/s], where the bell is highest")
    width: Positive | None = Field(default=None, description="a positive number of decades, the width of the bell [-]")
    stick: Flag = False

    one_of = (("shear_stress", "coefficient"),)
    rules = rules_of(_needs_its_folder, _bell)

    def friction(self, material: Any) -> InterfaceFriction | None:
        """Return the law of the shear stress, shifted to the temperature of a material; None if a coefficient is given
        instead."""
        if self.shear_stress is None:
            return None
        return InterfaceFriction(self.shear_stress, self.velocity, self.width or 1.0, time_factor_of(material))


WARN_WHOLE_BOX_STICKS = Kind(
    "whole box sticks",
    "{where}: all of the periodic box is in contact, where no traction moves the mean of its surface: friction of "
    "the first steps that stick may be too small; use grid.boundary: free, a smaller load or rougher heights",
)


class InterfaceEffect(Effect[Memory]):
    """Base class of the two effects of the `interface` section."""

    section: ClassVar[type[Part]] = Interface
    in_curves: ClassVar[bool] = True
    in_bands_over_time: ClassVar[bool] = True
    rules: ClassVar[tuple[Rule, ...]] = rules_of(_incompressible, _sticks, _rolls, _no_adhesion)
    lifts: ClassVar[tuple[Any, ...]] = (*OF_TRACTIONS, limits.no_rolling)

    @staticmethod
    def remembers(job: Any) -> bool:
        return bool(job.section("interface").stick)

    sheared_first = remembers

    @staticmethod
    def doubt_contact(job: Any, measures: Measures, where: str) -> Iterator[Doubt]:
        """Yield a warning about full contact of a periodic box in which points may stick."""
        if job.section("interface").stick and all(job.grid.cyclic) and measures.contact_area == 1.0:
            yield WARN_WHOLE_BOX_STICKS("", {"where": where})

    @staticmethod
    def decide(job: Any) -> Decision:
        law: Interface | None = job.section("interface")
        if law is None:
            return Decision("interface", False, "there is no interface section")
        bound = f"a coefficient of {law.coefficient or 0.0:g}"
        if law.shear_stress is not None:
            bound = f"a shear stress of {law.shear_stress:g} Pa at most"
        return Decision("interface", True, bound + ", below which points stick" * law.stick)


def shares(measures: Measures, velocity: tuple[float, float]) -> tuple[float, float]:
    """Return the two parts of the friction coefficient, due to the body and due to the interface: the components of
    both forces along the total force, divided by the normal force. The force of the interface opposes the vector
    `velocity`, whose length does not matter. A part is negative if its force opposes the total force, as the force of
    the interface may after a reversal."""
    scale = math.hypot(measures.force_x, measures.force_y) * math.hypot(*velocity)
    along = -(measures.force_x * velocity[0] + measures.force_y * velocity[1]) / scale if scale else 0.0
    own = 0.0 + along * measures.friction_interface  # not -0
    return measures.friction - own, own


class InterfaceColumns(InterfaceEffect[tuple[float, float]]):
    """Effect of an interface without stick: its columns are the two parts of friction, by the body and by the
    interface, which add up to the friction coefficient."""

    columns: ClassVar[tuple[str, ...]] = added_by("interface")

    def __new__(cls, scene: Any) -> Any:
        """Return the effect of a job: with `stick` that of tractions (in `effects.stick`)."""
        if not scene.job.section("interface").stick:
            return super().__new__(cls)
        (tractions,) = capabilities.offers("effect", "StickSlip")
        return tractions(scene)

    @staticmethod
    def shear(job: Any) -> InterfaceFriction | None:
        """Return the shear stress of the section, shifted to the temperature of the material. With `stick: true` return
        None, as the effect of stick finds the tractions."""
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

"""The `shift` of a material: how its relaxation times and moduli depend on temperature (`parcontact.rubber.shift`)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Annotated, ClassVar, Literal

from pydantic import Field, PlainValidator

from ...errors import InputError
from ...rubber.shift import WLF, Arrhenius, Density, Factors, log_vertical
from ...rubber.shift import Shift as Law
from ..text.fault import Fault
from .part import Part, Rule, chosen
from .quantities import NonNegative, Positive, Real

LOWEST, HIGHEST = -273.15, 5000.0  # physics: range of temperatures [deg C]
LARGEST_SHIFT = 60.0  # rounding: largest magnitude of log10 a_T for which relaxation times do not overflow
Celsius = Annotated[Real, Field(gt=LOWEST, le=HIGHEST, description="a temperature [deg C], up to 5000")]


def _rising(
    temperatures: tuple[float, ...], logs: tuple[float, ...], reference: float | None = None
) -> Iterator[Fault]:
    if None in temperatures:  # reported separately
        return
    if len(temperatures) < 2 or any(b <= a for a, b in pairwise(temperatures)):
        yield Fault("must be at least two rising temperatures [deg C]", ("temperatures",))
    elif len(logs) != len(temperatures):
        yield Fault(f"must be {len(temperatures)} numbers, one for each temperature, got {len(logs)}", ("logs",))
    elif reference is not None and not temperatures[0] <= reference <= temperatures[-1]:
        yield Fault(f"must be within {temperatures[0]:g} and {temperatures[-1]:g} C, got {reference:g}", ("reference",))


class DensityLaw(Part):
    """`b_T = rho T/(rho_ref T_ref)`, temperatures in K; `rho = rho_ref (1 - expansion (T - reference))`."""

    law: Literal["density"] = "density"
    expansion: NonNegative = Field(description="a loss of density per kelvin [1/K] of zero or more (rubber: 6e-4)")

    def at(self, reference: float) -> Density:
        """Return the law with the reference of its shift [deg C]."""
        return Density(self.expansion, reference)


class ModulusFactors(Part):
    """log10 of b_T at given temperatures, linear between them."""

    law: Literal["factors"] = "factors"
    temperatures: tuple[Celsius, ...] = Field(description="a list of rising temperatures [deg C]")
    logs: tuple[Real, ...] = Field(description="a list of numbers, log10 of b_T at each temperature")

    rules = (Rule(("temperatures", "logs"), _rising),)

    def at(self, reference: float) -> Factors:
        """Return the law with the reference of its shift [deg C]."""
        return Factors(self.temperatures, self.logs, reference)


VERTICAL_LAWS = {"density": DensityLaw, "factors": ModulusFactors}
AnyVertical = DensityLaw | ModulusFactors
VerticalLaw = Annotated[AnyVertical, PlainValidator(chosen("law", VERTICAL_LAWS), json_schema_input_type=AnyVertical)]


def _reaches(vertical: AnyVertical | None, reference: float) -> Iterator[Fault]:
    if isinstance(vertical, ModulusFactors) and not vertical.temperatures[0] <= reference <= vertical.temperatures[-1]:
        yield Fault(f"must reach the reference of the shift, {reference:g} C", ("vertical", "temperatures"))


class ShiftLaw(Part):
    """Base of the laws of a shift; `kind` is the class in `rubber.shift` that evaluates it."""

    kind: ClassVar[Callable[..., Law]]
    reference: Celsius
    vertical: VerticalLaw | None = Field(default=None, description="a mapping with law: density | factors")

    rules: ClassVar[tuple[Rule, ...]] = (Rule(("vertical", "reference"), _reaches),)

    @property
    def made(self) -> Law:
        vertical = self.vertical and self.vertical.at(self.reference)
        return self.kind(**self.model_dump(exclude={"law", "vertical"}), vertical=vertical)


class WlfShift(ShiftLaw):
    """`log10 a_T = -C1 (T - reference)/(C2 + T - reference)` (Williams, Landel and Ferry)."""

    kind = WLF
    law: Literal["wlf"] = "wlf"
    C1: Positive = Field(description="a positive number, the first constant of Williams, Landel and Ferry [-]")
    C2: Positive = Field(description="a positive number, the second constant of Williams, Landel and Ferry [K]")


class ArrheniusShift(ShiftLaw):
    """`log10 a_T = energy/(R ln 10) (1/T - 1/reference)`, temperatures in K."""

    kind = Arrhenius
    law: Literal["arrhenius"] = "arrhenius"
    energy: Positive = Field(description="a positive energy of activation [J/mol]")


class FactorsShift(ShiftLaw):
    """log10 of a_T at given temperatures, linear between them."""

    kind = Factors
    law: Literal["factors"] = "factors"
    temperatures: tuple[Celsius, ...] = Field(description="a list of rising temperatures [deg C]")
    logs: tuple[Real, ...] = Field(description="a list of numbers, log10 of a_T at each temperature")

    rules = (*ShiftLaw.rules, Rule(("temperatures", "logs", "reference"), _rising))


LAWS = {"wlf": WlfShift, "arrhenius": ArrheniusShift, "factors": FactorsShift}
AnyShift = WlfShift | ArrheniusShift | FactorsShift
Shift = Annotated[AnyShift, PlainValidator(chosen("law", LAWS), json_schema_input_type=AnyShift)]


def shifted(shift: AnyShift | None, temperature: float | None) -> Iterator[Fault]:
    """Check that a material with a temperature has a shift that reaches it."""
    if temperature is None:
        return
    if shift is None:
        sentence = "needs material.shift, the dependence of relaxation times on temperature; give a shift"
        yield Fault(sentence, ("temperature",))
        return
    try:
        log = shift.made.log_factor(temperature)
        log_vertical(shift.made, temperature)
    except InputError as error:
        yield Fault(f"is outside of the shift: {error}", ("temperature",))
        return
    if not abs(log) <= LARGEST_SHIFT:
        sentence = (
            f"would change the relaxation times by a factor of 10^{log:.3g}; the limits are 10^-{LARGEST_SHIFT:g} and "
        )
        yield Fault(f"{sentence}10^{LARGEST_SHIFT:g}", ("temperature",))

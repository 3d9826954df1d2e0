"""The `material` section: an elastic body, a generalized Zener body (paper, Eq. 8), or measured moduli.

`shift` of a material states how relaxation times and moduli depend on temperature (`parcontact.rubber.shift`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import AfterValidator, Field, PlainValidator, PrivateAttr, ValidationInfo, model_validator

from ..errors import SAID, Doubt, InputError
from ..rubber import compound
from ..rubber.shift import WLF, Arrhenius, Density, Factors, log_vertical
from ..rubber.shift import Shift as Law
from .parts import Celsius, Instead, NonNegative, Number, Part, Positive, Real, Rule, chosen, existing_file, rules_of
from .yaml_text import Fault, quote, refuse

Modulus = Annotated[NonNegative, Field(description="a shear modulus [Pa] of zero or more")]
Hardness = Annotated[Positive | None, Field(description="a positive pressure [Pa] at which the counterbody yields")]
Poisson = Annotated[Number, Field(gt=-1, le=0.5, description="a Poisson ratio [-] above -1 and up to 0.5")]
ROUNDED = 1e-9  # rounding: allowed error of the sum of fractions
YOUNG = ("young_modulus", "youngs_modulus", "elastic_modulus", "young", "e")
BY_THREE = "moduli here are shear moduli: {} is E/(2 (1 + poisson)), a third of Young's modulus E for rubber"


# -- shift with temperature -------------------------------------------------------------------------------------------


LARGEST_SHIFT = 60.0  # rounding: largest magnitude of log10 a_T for which relaxation times do not overflow


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
    """Moduli are proportional to density times temperature: `b_T = rho T/(rho_ref T_ref)`, with temperatures in K and
    `rho = rho_ref (1 - expansion (T - reference))`."""

    law: Literal["density"] = "density"
    expansion: NonNegative = Field(description="a loss of density per kelvin [1/K] of zero or more (rubber: 6e-4)")

    def at(self, reference: float) -> Density:
        """Return the law as an object that evaluates b_T. `reference` is the reference temperature of the horizontal
        shift [deg C]."""
        return Density(self.expansion, reference)


class ModulusFactors(Part):
    """A table of log10 of b_T at given temperatures, which is linear between them."""

    law: Literal["factors"] = "factors"
    temperatures: tuple[Celsius, ...] = Field(description="a list of rising temperatures [deg C]")
    logs: tuple[Real, ...] = Field(description="a list of numbers, log10 of b_T at each temperature")

    rules = (Rule(("temperatures", "logs"), _rising),)

    def at(self, reference: float) -> Factors:
        """Return the table as an object that evaluates b_T. `reference` is the reference temperature of the horizontal
        shift [deg C]."""
        return Factors(self.temperatures, self.logs, reference)


VERTICAL_LAWS = {"density": DensityLaw, "factors": ModulusFactors}
AnyVertical = DensityLaw | ModulusFactors
VerticalLaw = Annotated[AnyVertical, PlainValidator(chosen("law", VERTICAL_LAWS), json_schema_input_type=AnyVertical)]


def _reaches(vertical: AnyVertical | None, reference: float) -> Iterator[Fault]:
    if isinstance(vertical, ModulusFactors) and not vertical.temperatures[0] <= reference <= vertical.temperatures[-1]:
        yield Fault(f"must reach the reference of the shift, {reference:g} C", ("vertical", "temperatures"))


class ShiftLaw(Part):
    """Base class of the laws of a shift; `kind` is the class in `rubber.shift` that evaluates the law."""

    kind: ClassVar[Callable[..., Law]]
    reference: Celsius
    vertical: VerticalLaw | None = Field(default=None, description="a mapping with law: density | factors")

    rules: ClassVar[tuple[Rule, ...]] = rules_of(_reaches)

    @property
    def made(self) -> Law:
        vertical = self.vertical and self.vertical.at(self.reference)
        return self.kind(**self.model_dump(exclude={"law", "vertical"}), vertical=vertical)


class WlfShift(ShiftLaw):
    """The law of Williams, Landel and Ferry: `log10 a_T = -C1 (T - reference)/(C2 + T - reference)`."""

    kind = WLF
    law: Literal["wlf"] = "wlf"
    C1: Positive = Field(description="a positive number, the first constant of Williams, Landel and Ferry [-]")
    C2: Positive = Field(description="a positive number, the second constant of Williams, Landel and Ferry [K]")


class ArrheniusShift(ShiftLaw):
    """The law of Arrhenius: `log10 a_T = energy/(R ln 10) (1/T - 1/reference)`, with temperatures in K."""

    kind = Arrhenius
    law: Literal["arrhenius"] = "arrhenius"
    energy: Positive = Field(description="a positive energy of activation [J/mol]")


class FactorsShift(ShiftLaw):
    """A table of log10 of a_T at given temperatures, which is linear between them."""

    kind = Factors
    law: Literal["factors"] = "factors"
    temperatures: tuple[Celsius, ...] = Field(description="a list of rising temperatures [deg C]")
    logs: tuple[Real, ...] = Field(description="a list of numbers, log10 of a_T at each temperature")

    rules = (*ShiftLaw.rules, Rule(("temperatures", "logs", "reference"), _rising))


LAWS = {"wlf": WlfShift, "arrhenius": ArrheniusShift, "factors": FactorsShift}
AnyShift = WlfShift | ArrheniusShift | FactorsShift
Shift = Annotated[AnyShift, PlainValidator(chosen("law", LAWS), json_schema_input_type=AnyShift)]


def shifted(shift: AnyShift | None, temperature: float | None) -> Iterator[Fault]:
    """Yield an error if a material has a `temperature` [deg C] and no shift, or if its `shift` is not defined at this
    temperature."""
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
        limits = f"the limits are 10^-{LARGEST_SHIFT:g} and 10^{LARGEST_SHIFT:g}"
        yield Fault(f"would change the relaxation times by a factor of 10^{log:.3g}; {limits}", ("temperature",))


# -- bodies ------------------------------------------------------------------------------------------------------------


class ZenerBranch(Part):
    """A spring G0 in series with a Kelvin element (spring G1 parallel to dashpot eta1); a Maxwell branch if G1 = 0."""

    label: ClassVar[str] = "a branch of the form G0, G1, eta1"
    G0: Positive = Field(description="a positive shear modulus [Pa]")
    G1: Modulus
    eta1: Number = Field(ge=0, description="a viscosity [Pa s] of zero or more, or .inf")

    @property
    def relaxation_time(self) -> float:
        """Return the time constant of stress relaxation at constant strain, eta1 / (G0 + G1) [s]."""
        return self.eta1 / (self.G0 + self.G1)

    @property
    def instant_modulus(self) -> float:
        """Return the instantaneous modulus [Pa]."""
        return self.G0 if self.eta1 > 0 else self.G0 * self.G1 / (self.G0 + self.G1)

    @property
    def long_modulus(self) -> float:
        """Return the long-term modulus, of both springs in series [Pa]."""
        return self.G0 if math.isinf(self.eta1) else self.G0 * self.G1 / (self.G0 + self.G1)


class PronyBranch(Part):
    """A term `modulus exp(-t / relaxation_time)` of the relaxation function."""

    label: ClassVar[str] = "a branch of the form modulus, relaxation_time"
    long_modulus: ClassVar[float] = 0.0
    modulus: Modulus
    relaxation_time: Positive = Field(description="a positive time [s]")

    @property
    def instant_modulus(self) -> float:
        """Return the instantaneous modulus of the term [Pa]."""
        return self.modulus


class FractionBranch(Part):
    """A term of a Prony series as in finite element programs: `G(t) = modulus_0 (1 - sum g (1 - exp(-t/tau)))`."""

    label: ClassVar[str] = "a branch of the form g, tau"
    g: Number = Field(ge=0, le=1, description="a fraction of modulus_0 [-] from 0 to 1")
    tau: Positive = Field(description="a positive relaxation time [s]")

    def times(self, modulus: float) -> PronyBranch:
        """Return this term as a Prony branch with a modulus in Pa, for a body whose instantaneous modulus is `modulus`
        [Pa]."""
        return PronyBranch(modulus=self.g * modulus, relaxation_time=self.tau)


MadeBranch = ZenerBranch | PronyBranch
AnyBranch = MadeBranch | FractionBranch
FORMS: tuple[type[AnyBranch], ...] = (ZenerBranch, PronyBranch, FractionBranch)


def _branch(data: Any, info: ValidationInfo) -> AnyBranch:
    """Return a branch in the form that its keys determine."""
    if isinstance(data, AnyBranch):
        return data
    names = [", ".join(form.words()) for form in FORMS]
    forms = f"{', '.join(names[:-1])} or {names[-1]}"
    if not isinstance(data, dict):
        refuse(Fault(f"must be a mapping of {forms}, got {quote(data)}"))
    meant = [form for form in FORMS if any(key in data for key in form.words())]
    if len(meant) > 1:
        given = [key for form in meant for key in form.words() if key in data]
        refuse(Fault(f"mixes forms of a branch: give {forms}, got {', '.join(given)}"))
    if not meant:
        refuse(Fault(f"must have the keys {forms}, got {', '.join(data) or 'none'}"))
    return meant[0].model_validate(data, context=info.context)


Branch = Annotated[MadeBranch, PlainValidator(_branch, json_schema_input_type=AnyBranch)]


class Elastic(Part):
    """A linear elastic body."""

    model: Literal["elastic"] = "elastic"
    poisson: Poisson = 0.5
    shear_modulus: Positive = Field(description="a positive shear modulus [Pa]")
    hardness: Hardness = None

    branches: ClassVar[tuple[()]] = ()
    remembers: ClassVar[bool] = False
    time_factor: ClassVar[float] = 1.0
    modulus_factor: ClassVar[float] = 1.0
    foreign = dict.fromkeys(YOUNG, Instead(BY_THREE.format("shear_modulus"), ("shear_modulus",)))

    @property
    def fitted(self) -> Elastic:
        """Return the body itself. Only `Dma` has to be fitted."""
        return self

    @property
    def instant_modulus(self) -> float:
        """Return the shear modulus, which is also the long-term modulus [Pa]."""
        return self.shear_modulus

    long_modulus = instant_modulus


def _rising_band(band: tuple[float, float] | None) -> tuple[float, float] | None:
    if band and band[0] >= band[1]:
        refuse(Fault(f"must be a lower and a higher frequency [Hz], got {list(band)!r}"))
    return band


def _ordered(degrees: tuple[float, float] | None) -> tuple[float, float] | None:
    if degrees and degrees[0] > degrees[1]:
        refuse(Fault(f"must be the lowest and the highest temperature [deg C], got {list(degrees)!r}"))
    return degrees


Band = Annotated[
    tuple[Positive, Positive] | None,
    AfterValidator(_rising_band),
    Field(description="two frequencies [Hz], the measured band reduced to the reference temperature"),
]


Measured = Annotated[
    tuple[Celsius, Celsius] | None,
    AfterValidator(_ordered),
    Field(description="two temperatures [deg C], the lowest and the highest that were measured"),
]


def _fractions(modulus_0: float | None, modulus_inf: float, branches: tuple[AnyBranch | None, ...]) -> Iterator[Fault]:
    """Check that fractions have a modulus_0, and that a body with modulus_0 has fractions only, of sum 1 at most."""
    fractions = [branch.g for branch in branches if isinstance(branch, FractionBranch)]
    if fractions and modulus_0 is None:
        yield Fault(
            "is missing: g of branches is a fraction of it; give the instantaneous shear modulus [Pa]", ("modulus_0",)
        )
    if modulus_0 is None:
        return
    if modulus_inf:
        rest = "modulus_inf = modulus_0 (1 - sum of g); leave one of the two out"
        yield Fault(f"cannot be given with modulus_0: {rest}", ("modulus_inf",), at_key=True)
    if len(fractions) < len(branches) and None not in branches:
        yield Fault("needs branches of the form g, tau", ("modulus_0",), at_key=True)
    if sum(fractions) > 1.0 + ROUNDED:
        yield Fault(f"have fractions g that add up to {sum(fractions):.6g}, more than 1", ("branches",))


def _stiff(modulus_0: float | None, modulus_inf: float, branches: tuple[AnyBranch | None, ...]) -> Iterator[Fault]:
    own = [branch for branch in branches if not isinstance(branch, FractionBranch)]
    moduli = [branch.instant_modulus for branch in own if branch is not None]
    if modulus_0 is None and len(own) == len(branches) and None not in branches and modulus_inf + sum(moduli) == 0:
        yield Fault("has no stiffness: modulus_inf and all branches are zero; give one of them a modulus [Pa]")


class Zener(Part):
    """Springs, Kelvin and Maxwell branches in parallel with the spring `modulus_inf`, G_inf of Eq. (8) of the paper.

    The body is a fluid if the long-term modulus is zero. Relaxation times and moduli of a material with a `shift` are
    given at the reference temperature of the shift. At another temperature, which the key `temperature` gives,
    relaxation times are multiplied by the horizontal factor a_T, and moduli by the vertical factor b_T. If the
    instantaneous modulus `modulus_0` is given, branches are fractions of this modulus.
    """

    model: Literal["zener"] = "zener"
    poisson: Poisson = 0.5
    modulus_inf: Modulus = 0.0
    modulus_0: Positive | None = Field(default=None, description="a positive instantaneous shear modulus [Pa]")
    branches: tuple[Branch, ...] = Field(default=(), description="a list of branches")
    shift: Shift | None = Field(default=None, description="a mapping with law: wlf | arrhenius | factors")
    temperature: Celsius | None = Field(default=None, description="a temperature [deg C], up to 5000")  # the reference
    band: Band = None
    temperatures: Measured = None
    hardness: Hardness = None

    foreign = dict.fromkeys(YOUNG, Instead(BY_THREE.format("each of modulus_inf and branches")))
    rules = (*rules_of(_fractions, _stiff), Rule(("shift", "temperature"), shifted))

    @model_validator(mode="wrap")
    @classmethod
    def _with_moduli(cls, data: Any, handler: Callable[[Any], Self]) -> Self:
        """Replace fractions of `modulus_0` by moduli."""
        found = handler(data)
        if (whole := found.modulus_0) is None:
            return found
        fractions = [branch for branch in found.branches if isinstance(branch, FractionBranch)]
        rest = 1.0 - math.fsum(branch.g for branch in fractions)
        changes = {"branches": tuple(branch.times(whole) for branch in fractions), "modulus_0": None}
        return found.model_copy(update={**changes, "modulus_inf": whole * (rest if rest > ROUNDED else 0.0)})

    @property
    def fitted(self) -> Zener:
        """Return the body itself. Only `Dma` has to be fitted."""
        return self

    @property
    def remembers(self) -> bool:
        """Return True if the body relaxes."""
        return bool(self.branches)

    @property
    def time_factor(self) -> float:
        """Return a_T [-]: relaxation times at the temperature of the body, divided by those at the reference
        temperature."""
        if self.shift is None or self.temperature is None:
            return 1.0
        return float(10.0 ** self.shift.made.log_factor(self.temperature))

    @property
    def modulus_factor(self) -> float:
        """Return b_T [-]: moduli at the temperature of the body, divided by those at the reference temperature."""
        if self.shift is None or self.temperature is None:
            return 1.0
        return float(10.0 ** log_vertical(self.shift.made, self.temperature))

    @property
    def instant_modulus(self) -> float:
        """Return the instantaneous modulus at the temperature of the body [Pa]."""
        return self.modulus_factor * (self.modulus_inf + sum(branch.instant_modulus for branch in self.branches))

    @property
    def long_modulus(self) -> float:
        """Return the long-term modulus at the temperature of the body [Pa]."""
        return self.modulus_factor * (self.modulus_inf + sum(branch.long_modulus for branch in self.branches))

    def at(self, temperature: float) -> Zener:
        """Return the body at another temperature [deg C], which must be in the range of its shift."""
        return self.model_copy(update={"temperature": temperature})


class Dma(Part):
    """A material that is fitted to a table of measured moduli when the job is read. The fit is that of `parcontact
    fit`."""

    model: Literal["dma"] = "dma"
    path: Annotated[Path, AfterValidator(existing_file), Field(description="the path of a table of measured moduli")]
    poisson: Poisson = 0.5
    reference: Celsius | None = None  # default: the middle one of the measured temperatures
    shift: Literal["wlf", "arrhenius", "free"] = "wlf"
    temperature: Celsius | None = Field(default=None, description="a temperature [deg C], up to 5000")  # the reference
    error: Positive = Field(default=0.02, description="a positive relative error of both moduli [-]")
    weight: Literal["both", "storage", "loss"] = "both"
    vertical: Literal["auto", "density", "free", "none"] = "auto"
    hardness: Hardness = None

    _fitted: Zener = PrivateAttr()
    _doubts: tuple[Doubt, ...] = PrivateAttr(default=())

    def model_post_init(self, context: Any) -> None:
        try:
            of_fit = (self.error, self.weight, self.vertical)
            found = compound.fitted(self.path, self.poisson, self.reference, self.shift, *of_fit)
        except InputError as error:
            refuse(Fault(f"cannot be fitted: {error}", ("path",)))
        made = Zener.model_validate(found.material())
        if faults := list(shifted(made.shift, self.temperature)):
            refuse(*faults)
        self._doubts = tuple(SAID("material.path", {"text": text}) for text in found.doubts())
        self._fitted = made.model_copy(update={"temperature": self.temperature, "hardness": self.hardness})

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Return the warnings about the fit."""
        return self._doubts

    @property
    def fitted(self) -> Zener:
        """Return the fitted material, with springs and Maxwell branches."""
        return self._fitted


def describe_temperature(material: Elastic | Zener | Dma, section: str = "material") -> str:
    """Return a sentence on the temperature of the material in a section, or '' for a material without a shift."""
    body = material.fitted
    if not isinstance(body, Zener) or body.shift is None:
        return ""
    reference = body.shift.made.reference
    if body.temperature is None:
        return f"{section}: at {reference:g} C, the reference of its shift; the job gives no {section}.temperature"
    factors = f"a_T = {body.time_factor:.4g}"
    factors += f", b_T = {body.modulus_factor:.4g}" if body.shift.vertical else ""
    return f"{section}: at {body.temperature:g} C ({factors}, reference {reference:g} C)"


def heated(material: Elastic | Zener | Dma, temperature: float) -> Zener:
    """Return the material at a `temperature` [deg C], which may be higher or lower than its own. Raises InputError for
    a material without a shift, and for a temperature outside the range of the shift."""
    body = material.fitted
    if not isinstance(body, Zener):
        raise InputError("temperatures need a material whose relaxation times depend on it: model zener or dma")
    if faults := list(shifted(body.shift, temperature)):
        raise InputError(f"temperature {faults[0].predicate}")
    return body.at(temperature)


KINDS = {"elastic": Elastic, "zener": Zener, "dma": Dma}
CALLED = dict.fromkeys(("prony", "maxwell", "viscoelastic", "sls"), "zener")  # names in other programs
AnyMaterial = Elastic | Zener | Dma
Material = Annotated[AnyMaterial, PlainValidator(chosen("model", KINDS, CALLED), json_schema_input_type=AnyMaterial)]

"""A counterbody that deforms: both bodies are one viscoelastic material, which replaces the material of a job.

Let G(s) = s Gbar(s) be the modulus of a body, where Gbar is the Laplace transform of its relaxation function. Under one
pressure the displacements of both bodies add up, so that the pair has the modulus M,

    1/M(s) = 1/G1(s) + 1/G2(s)

M is a Prony series again, with M_inf = G1_inf G2_inf/(G1_inf + G2_inf). Its relaxation times are the retardation times
lambda of S = G1 + G2, with the moduli |G1 G2|/(lambda dS/dlambda) at s = -1/lambda. A relaxation time that both bodies
have, with the moduli a and b, remains with the modulus a b/(a + b).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np
from pydantic import GetCoreSchemaHandler, PrivateAttr
from pydantic_core import CoreSchema

from ...job.materials import AnyMaterial, Dma, Material, PronyBranch, Zener, describe_temperature, heated
from ...job.meaning import excited_band
from ...job.parts import Part, Rule, rules_of
from ...job.surfaces import Rough
from ...job.yaml_text import Fault
from ...physics.prony import Array, Moduli, Prony, Zero, complex_modulus, normal_form, retardation
from ..branches import relaxation_of
from ..effect import Decision, Effect


def pair(first: Moduli, second: Moduli) -> Prony:
    """Return the relaxation function of two bodies in contact [Pa, s], from the moduli of both.

    The moduli of the result agree with 1/(1/G1 + 1/G2) to rounding. Raises ValueError for numbers that do not define a
    relaxation function.
    """
    one, other = normal_form(*first), normal_form(*second)
    terms, times = np.append(one.moduli, other.moduli), np.append(one.relaxation_times, other.relaxation_times)
    whole = normal_form(one.modulus_inf + other.modulus_inf, terms, times)
    a, b = (_on_times(body, whole) for body in (one, other))
    zeros = retardation(whole)  # G1 = -G2 there but for rounding
    moduli = [abs(_at(z, one, a, whole) * _at(z, other, b, whole)) / (z.time * z.slope) for z in zeros]
    shared = a * b / (a + b)
    spring = one.modulus_inf * other.modulus_inf / whole.modulus_inf if whole.modulus_inf else 0.0
    slow = [zero.time for zero in zeros]
    return normal_form(spring, np.append(shared, moduli), np.append(whole.relaxation_times, slow))


def _on_times(body: Prony, whole: Prony) -> Array:
    """Return the moduli of a body at all relaxation times of the `whole` series [Pa]."""
    found = np.zeros_like(whole.moduli)
    found[np.searchsorted(whole.relaxation_times, body.relaxation_times)] = body.moduli
    return found


def _at(zero: Zero, body: Prony, moduli: Array, whole: Prony) -> float:
    """Return the modulus of a body at s = -1/lambda [Pa]."""
    return body.modulus_inf + float(np.sum(moduli * whole.relaxation_times / zero.distances))


class Counterbody(Part):
    """The `counterbody` section: the material of a rough body that deforms, with the keys of the section `material`,
    such as `{model: elastic, shear_modulus: 5.0e6}` or `{include: NAME}`. Without this section the rough body is rigid
    ({doc}`limits`)."""

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return handler.generate_schema(Material)


class Pair(Zener):
    """A rubber and its counterbody as one body, with Poisson's ratio, hardness, shift and measured range of the rubber.

    Each body is shifted to its temperature before both are joined. The base class multiplies `branches` and
    `modulus_inf` by the shift factors of the rubber. So these keys hold the series of the pair divided by these
    factors.
    """

    _first: AnyMaterial = PrivateAttr()
    _second: AnyMaterial = PrivateAttr()
    _relaxed: bool = PrivateAttr()

    @classmethod
    def of(cls, first: AnyMaterial, second: AnyMaterial, relaxed: bool) -> Pair:
        """Return two bodies as one. The moduli of the second body are multiplied by `(1 - nu_1)/(1 - nu_2)`, with the
        Poisson ratios of both bodies. Then the compliances (1 - nu)/G of both bodies add up. If `relaxed` is True, the
        second body is elastic with its long-term modulus."""
        own, scale = first.fitted, (1.0 - first.poisson) / (1.0 - second.poisson)
        other = Prony(second.fitted.long_modulus, np.zeros(0), np.zeros(0)) if relaxed else relaxation_of(second)
        both = pair(relaxation_of(first), (scale * other.modulus_inf, scale * other.moduli, other.relaxation_times))
        kept = {name: getattr(own, name, None) for name in ("poisson", "hardness", "band", "temperatures")}
        shifts = own if getattr(own, "shift", None) else second.fitted
        found = cls.model_construct(
            **kept, shift=getattr(shifts, "shift", None), temperature=getattr(shifts, "temperature", None)
        )
        stiff, slow = found.modulus_factor, found.time_factor
        terms = zip((both.moduli / stiff).tolist(), (both.relaxation_times / slow).tolist(), strict=True)
        branches = (PronyBranch.model_construct(modulus=modulus, relaxation_time=time) for modulus, time in terms)
        found = found.model_copy(update={"modulus_inf": both.modulus_inf / stiff, "branches": tuple(branches)})
        found._first, found._second, found._relaxed = first, second, relaxed
        return found

    @property
    def given(self) -> AnyMaterial:
        """Return the material that the job gives: the rubber without its counterbody."""
        return self._first

    def at(self, temperature: float) -> Pair:
        """Return the pair with both bodies at another temperature [deg C]; a body without a shift does not change."""
        bodies = (self._first, self._second)
        first, second = (heated(one, temperature) if getattr(one.fitted, "shift", None) else one for one in bodies)
        return Pair.of(first, second, self._relaxed)


SAME = 1e-9  # rounding: tolerance on Poisson's ratio
SHOWN = 3  # number of frequencies at which moduli are shown
AT_REST = "it carries the roughness and sees a load at rest, so that in steady sliding its long-term modulus counts"


def _slides(counterbody: Any, history: Any, initial: Any, steady: Any) -> Iterator[Fault]:
    """Refuse histories that slide on a counterbody that relaxes, and steady sliding in which it flows."""
    if not counterbody.fitted.remembers:
        return
    why = "needs an elastic counterbody: states of one that relaxes move with the surface, which is not solved for"
    for index, stage in enumerate(history):
        if stage is not None and (stage.speed or stage.rolls):
            yield Fault(f"{why}; use a steady section without a history", ("history", index, "velocity"))
    if initial.state == "steady":
        yield Fault(why, ("initial",))
    if steady is not None and history:
        sentence = "cannot be used with a history if the counterbody relaxes"
        yield Fault(f"{sentence}: {AT_REST}; leave out one of them", ("steady",))
    if steady is not None and counterbody.fitted.long_modulus == 0.0:
        yield Fault(f"needs a long-term modulus: {AT_REST}", ("counterbody",))


def _sticks(counterbody: Any, material: Any, interface: Any) -> Iterator[Fault]:
    if interface.stick and _differ(material, counterbody):
        sentence = f"needs counterbody.poisson of {material.poisson:g}, got {counterbody.poisson:g}"
        yield Fault(f"{sentence}: bodies share tractions and pressures in other proportions", ("interface", "stick"))


def _no_heat(counterbody: Any, thermal: Any) -> Iterator[Fault]:
    sentence = "cannot be used with counterbody: losses in it heat it, too, which is not solved for"
    yield Fault(f"{sentence}; leave one of them out", ("thermal",))


def _no_softening(counterbody: Any, softening: Any) -> Iterator[Fault]:
    sentence = "cannot be used with counterbody: only the rubber softens, and factors would count for both bodies"
    yield Fault(f"{sentence}; leave one of them out", ("softening",))


def _does_not_yield(counterbody: Any) -> Iterator[Fault]:
    if counterbody.hardness is not None:
        yield Fault("is a key of material, also with a counterbody: give it there", ("counterbody", "hardness"))


def _differ(material: Any, counterbody: Any) -> bool:
    return abs(material.poisson - counterbody.poisson) > SAME


def _has_relaxed(job: Any) -> bool:
    """Return True if the counterbody counts with its long-term modulus: in steady sliding."""
    return job.steady is not None and not job.history


class CounterbodyThatDeforms(Effect[None]):
    """Effect of a counterbody that deforms: the pair of both bodies replaces the material of the job."""

    section: ClassVar[type[Part]] = Counterbody
    in_curves: ClassVar[bool] = True
    in_bands_over_time: ClassVar[bool] = True
    columns: ClassVar[tuple[str, ...]] = ()
    rules: ClassVar[tuple[Rule, ...]] = rules_of(_slides, _sticks, _no_heat, _no_softening, _does_not_yield)

    @staticmethod
    def changed_material(job: Any) -> Any:
        """Return a material (`Pair`) that replaces body and counterbody by one body. For steady sliding the counterbody
        has its long-term modulus: it carries the roughness, so that its load does not change with time."""
        relaxed = _has_relaxed(job)
        if isinstance(job.material, Pair) or (relaxed and job.counterbody.fitted.long_modulus == 0.0):  # refused
            return job.material
        return Pair.of(job.material, job.counterbody, relaxed)

    @staticmethod
    def why_no_curve(job: Any) -> str:
        """Return the reason why a job has no friction curve; '' if the job may have one."""
        if job.steady is not None or not job.counterbody.fitted.remembers:
            return ""
        return f"with a counterbody that relaxes the job needs a steady section in place of its history: {AT_REST}"

    @staticmethod
    def decide(job: Any) -> Decision:
        if (found := job.section("counterbody")) is None:
            return Decision("counterbody", False, "there is no counterbody section")
        low, high = (f"{value:g}" for value in (found.fitted.long_modulus, found.fitted.instant_modulus))
        modulus = low if low == high or _has_relaxed(job) else f"{low} to {high}"
        return Decision("counterbody", True, f"a shear modulus of {modulus} Pa; both bodies count as one")

    @staticmethod
    def doubts(job: Any) -> Iterator[Any]:
        """Yield warnings about the fit of the counterbody's moduli and about different Poisson's ratios."""
        first, second = job.material, job.counterbody
        if isinstance(second, Dma):
            yield from map(str, second.doubts)
        if _differ(first, second):
            yield (
                f"counterbody: Poisson's ratios of both bodies differ ({first.poisson:g} and {second.poisson:g}): "
                "shear moves the surfaces along their normal (Dundurs' second constant), which is left out"
            )

    @staticmethod
    def facts(job: Any) -> Iterator[str]:
        """Yield sentences on the temperature of the counterbody, and on the moduli of the pair."""
        yield describe_temperature(job.counterbody, "counterbody")
        series = relaxation_of(job.material)
        text = f"both bodies as one: shear modulus {series.modulus_inf:.4g} Pa after all relaxation"
        shown = ((value, complex(complex_modulus(2.0 * math.pi * value, *series))) for value in frequencies(job))
        yield "; ".join([text, *(f"{m.real:.4g} + {m.imag:.4g}i Pa at {f:.4g} Hz" for f, m in shown)])


def frequencies(job: Any) -> list[float]:
    """Return at most SHOWN frequencies [Hz] at which `facts` states the moduli of the pair; an empty list if nothing
    relaxes. They span the range that the sliding of the job excites; without sliding, the range in which the pair
    relaxes."""
    times = relaxation_of(job.material).relaxation_times
    if not times.size:
        return []
    known = job.bands is None or all(isinstance(shape, Rough) for shape in job.surface)
    band = excited_band(job) if known else None
    low, high = band or (0.5 / (math.pi * times.max()), 0.5 / (math.pi * times.min()))
    return [low] if low == high else list(map(float, np.geomspace(low, high, SHOWN)))

"""A counterbody that deforms: the pair of both bodies replaces the material of a job; steps are the usual ones."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np

from ...job.materials import Dma, describe_temperature
from ...job.meaning import excited_band
from ...job.parts import Part, Rule, rules_of
from ...job.surfaces import Rough
from ...job.yaml_text import Fault
from ...physics.prony import complex_modulus
from ..effect import Decision, Effect
from ..relaxation import relaxation_of
from .section import Counterbody, Pair

SAME = 1e-9  # rounding: tolerance on Poisson's ratio
SHOWN = 3  # number of frequencies at which moduli are shown
AT_REST = "it carries the roughness and sees a load at rest, so that in steady sliding its long-term modulus counts"


def _slides(counterbody: Any, history: Any, initial: Any, steady: Any) -> Iterator[Fault]:
    """Refuse histories that slide on a counterbody that relaxes, and steady sliding in which it flows."""
    if counterbody is None or not counterbody.fitted.remembers:
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
    if None not in (counterbody, interface) and interface.stick and _differ(material, counterbody):
        sentence = f"needs counterbody.poisson of {material.poisson:g}, got {counterbody.poisson:g}"
        yield Fault(f"{sentence}: bodies share tractions and pressures in other proportions", ("interface", "stick"))


def _no_heat(counterbody: Any, thermal: Any) -> Iterator[Fault]:
    if None not in (counterbody, thermal):
        sentence = "cannot be used with counterbody: losses in it heat it, too, which is not solved for"
        yield Fault(f"{sentence}; leave one of them out", ("thermal",))


def _no_softening(counterbody: Any, softening: Any) -> Iterator[Fault]:
    if None not in (counterbody, softening):
        sentence = "cannot be used with counterbody: only the rubber softens, and factors would count for both bodies"
        yield Fault(f"{sentence}; leave one of them out", ("softening",))


def _does_not_yield(counterbody: Any) -> Iterator[Fault]:
    if counterbody is not None and counterbody.hardness is not None:
        yield Fault("is a key of material, also with a counterbody: give it there", ("counterbody", "hardness"))


def _differ(material: Any, counterbody: Any) -> bool:
    return abs(material.poisson - counterbody.poisson) > SAME


def _has_relaxed(job: Any) -> bool:
    """Return True if the counterbody counts with its long-term modulus: in steady sliding."""
    return job.steady is not None and not job.history


class CounterbodyThatDeforms(Effect[None]):
    """Effect of a counterbody that deforms."""

    section: ClassVar[type[Part]] = Counterbody
    in_curves: ClassVar[bool] = True
    in_bands_over_time: ClassVar[bool] = True
    columns: ClassVar[tuple[str, ...]] = ()
    rules: ClassVar[tuple[Rule, ...]] = rules_of(_slides, _sticks, _no_heat, _no_softening, _does_not_yield)

    @staticmethod
    def changed_material(job: Any) -> Any:
        """Return the pair of both bodies, which replaces the material; in a steady state the counterbody has
        relaxed."""
        relaxed = _has_relaxed(job)
        if isinstance(job.material, Pair) or (relaxed and job.counterbody.fitted.long_modulus == 0.0):  # refused
            return job.material
        return Pair.of(job.material, job.counterbody, relaxed)

    @staticmethod
    def why_no_curve(job: Any) -> str:
        """Return the reason why a job has no friction curve; '' if it has one."""
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
    """Return at most SHOWN frequencies [Hz] at which moduli are shown: frequencies of the job's sliding, else of the
    relaxation of the pair; an empty list if nothing relaxes."""
    times = relaxation_of(job.material).relaxation_times
    if not times.size:
        return []
    known = job.bands is None or all(isinstance(shape, Rough) for shape in job.surface)
    band = excited_band(job) if known else None
    low, high = band or (0.5 / (math.pi * times.max()), 0.5 / (math.pi * times.min()))
    return [low] if low == high else list(map(float, np.geomspace(low, high, SHOWN)))

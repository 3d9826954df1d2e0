"""The `counterbody` section, which may be any material, and both bodies as one viscoelastic material.

Let G(s) = s Gbar(s) be the modulus of a body, where Gbar is the Laplace transform of its relaxation function. Under one
pressure the displacements of both bodies add up, so that the pair has the modulus M,

    1/M(s) = 1/G1(s) + 1/G2(s)

M is a Prony series again, with M_inf = G1_inf G2_inf/(G1_inf + G2_inf). Its relaxation times are the retardation times
lambda of S = G1 + G2, with the moduli |G1 G2|/(lambda dS/dlambda) at s = -1/lambda. A relaxation time that both bodies
have, with the moduli a and b, remains with the modulus a b/(a + b).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pydantic import GetCoreSchemaHandler, PrivateAttr
from pydantic_core import CoreSchema

from ...job.materials import AnyMaterial, Material, PronyBranch, Zener, heated
from ...job.parts import Part
from ...physics.prony import Array, Moduli, Prony, Zero, normal_form, retardation
from ..relaxation import relaxation_of


def pair(first: Moduli, second: Moduli) -> Prony:
    """Return the relaxation function of two bodies in contact [Pa, s], from the moduli of both.

    The moduli of the result agree with 1/(1/G1 + 1/G2) to rounding. Raises ValueError for numbers that do not define a
    relaxation function.
    """
    one, other = normal_form(*first), normal_form(*second)
    terms, times = np.append(one.moduli, other.moduli), np.append(one.relaxation_times, other.relaxation_times)
    whole = normal_form(one.modulus_inf + other.modulus_inf, terms, times)
    a, b = (_on_times(body, whole) for body in (one, other))
    zeros = retardation(whole)
    products = [
        abs(_at(zero, one, a, whole) * _at(zero, other, b, whole)) for zero in zeros
    ]  # G1 = -G2 but for rounding
    moduli = [product / (zero.time * zero.slope) for product, zero in zip(products, zeros, strict=True)]
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
    """The rough body if it deforms, too: any section that `material` may be, such as `{model: elastic, shear_modulus:
    5.0e6}` or `{include: NAME}`. Without this section the rough body is rigid ({doc}`limits`)."""

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return handler.generate_schema(Material)


class Pair(Zener):
    """A rubber and its counterbody as one body, with Poisson's ratio, hardness, shift and measured range of the rubber.

    Each body is shifted to its temperature before both are joined. `branches` and `modulus_inf` are divided by the
    shift of the rubber, which the base class applies again. A relaxed counterbody has its long-term modulus.
    """

    _first: AnyMaterial = PrivateAttr()
    _second: AnyMaterial = PrivateAttr()
    _relaxed: bool = PrivateAttr()

    @classmethod
    def of(cls, first: AnyMaterial, second: AnyMaterial, relaxed: bool) -> Pair:
        """Return two bodies as one. The modulus of the second is scaled by its 1 - nu, so that compliances add up. A
        counterbody that is `relaxed` has its long-term modulus."""
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
        """Return the rubber without its counterbody."""
        return self._first

    def at(self, temperature: float) -> Pair:
        """Return the pair with both bodies at another temperature [deg C]; a body without a shift does not change."""
        bodies = (self._first, self._second)
        first, second = (heated(one, temperature) if getattr(one.fitted, "shift", None) else one for one in bodies)
        return Pair.of(first, second, self._relaxed)

"""The `counterbody` section, any material, and both bodies as one material."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydantic import GetCoreSchemaHandler, PrivateAttr
from pydantic_core import CoreSchema

from ...job.sections.materials import AnyMaterial, Material, PronyBranch, Zener, heated
from ...job.sections.part import Part
from ...physics.prony import Prony
from ..relaxation import relaxation_of
from .pair import pair


class Counterbody(Part):
    """The rough body deforms, too: any section that `material` may be, such as `{model: elastic, shear_modulus: 5.0e6}`
    or `{include: NAME}`. By default it is rigid ({doc}`limits`)."""

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return handler.generate_schema(Material)


class Pair(Zener):
    """A rubber and its counterbody as one body, with Poisson's ratio, hardness, shift and measured range of the rubber.

    Both are at their temperatures before they become one. `branches` and `modulus_inf` are reduced by the shift of the
    rubber, which the base class applies. A `relaxed` counterbody has its long-term modulus.
    """

    _first: AnyMaterial = PrivateAttr()
    _second: AnyMaterial = PrivateAttr()
    _relaxed: bool = PrivateAttr()

    @classmethod
    def of(cls, first: AnyMaterial, second: AnyMaterial, relaxed: bool) -> Pair:
        """Return two bodies as one. The modulus of the second is scaled so that compliances, which are in proportion to
        1 - nu, add up."""
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
        """Return the rubber."""
        return self._first

    def at(self, temperature: float) -> Pair:
        """Return the pair with both bodies at another temperature [deg C], but for a body without a shift."""
        bodies = (self._first, self._second)
        first, second = (heated(one, temperature) if getattr(one.fitted, "shift", None) else one for one in bodies)
        return Pair.of(first, second, self._relaxed)

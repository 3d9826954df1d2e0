"""A steady state as data: its parameters, its measures, and its cost."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ..accuracy.budget import ErrorBudget
from ..accuracy.constants import FLASH
from ..physics.measures import Measures
from ..solve.certificate import Certificate

if TYPE_CHECKING:  # found only for jobs that ask for it
    from ..effects.heat.flash import Flash

Vector = tuple[float, float]


@dataclass(frozen=True)
class Point:
    """A steady state: velocity [m/s], pressure [Pa], temperature [deg C] (NaN if none is given), relaxation times over
    those at the reference, measures, certificate, and cost.

    `friction` is the dissipated power over load and velocity, plus that of an interface; `errors` is its budget. The
    friction of `measures` is by the slopes of the rigid surface; the difference is a mesh error. `operator_calls`
    count applications on the finest grid. `dissipated` is the power [W] of each branch (empty for a free scene, whose
    wake continues outside the box). `flash` has the temperatures of the contact, None without `thermal`. With
    feedback, found in `rounds`, the shift factor is that of the flash temperature, and `friction_cold` is friction
    without feedback. `strain_amplitude` is the strain that softens the rubber, NaN without `softening`.
    """

    velocity: Vector
    pressure: float
    temperature: float
    shift_factor: float
    measures: Measures
    friction: float
    errors: ErrorBudget
    certificate: Certificate
    operator_calls: float
    seconds: float
    dissipated: tuple[float, ...]
    flash: Flash | None = None
    rounds: int = 1
    friction_cold: float = math.nan
    strain_amplitude: float = math.nan

    @property
    def speed(self) -> float:
        """Magnitude of the velocity [m/s]."""
        return math.hypot(*self.velocity)

    @property
    def error_friction(self) -> float:
        """Relative error of friction, 1 or more if friction is smaller than its error; NaN without friction, and if
        spots may be smaller than a cell."""
        return self.errors.friction.of_friction if self.errors.friction and self.errors.resolved else math.nan

    @property
    def error_area(self) -> float:
        """Relative error of the corrected area; NaN if spots may be smaller than a cell."""
        return self.errors.area.total if self.errors.resolved else math.nan

    @property
    def error_flash(self) -> float:
        """The relative error of the flash temperature, FLASH times that of friction; NaN where there is none."""
        return FLASH.value * self.error_friction if self.flash and self.flash.mean else math.nan


def in_rounds(points: Sequence[Point]) -> Point:
    """Return the last round of a fixed point, with the cost of all rounds, and with the relative changes in the last
    round as errors."""
    *_, before, last = [*points[-1:], *points]
    friction, area = (
        abs(one - other) / one if one > 0.0 else 0.0
        for one, other in (
            (last.friction, before.friction),
            (last.measures.contact_area_corrected, before.measures.contact_area_corrected),
        )
    )
    calls, seconds = (sum(getattr(point, name) for point in points) for name in ("operator_calls", "seconds"))
    return replace(last, errors=last.errors.with_rounds(friction, area), operator_calls=calls, seconds=seconds)

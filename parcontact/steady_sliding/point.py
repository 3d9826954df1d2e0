"""A steady state as data: where it is, what it measures, and what it took."""

import math
from dataclasses import dataclass

from ..accuracy.budget import ErrorBudget
from ..accuracy.constants import FLASH
from ..physics.flash import Flash
from ..physics.measures import Measures
from ..solve.certificate import Certificate

Vector = tuple[float, float]


@dataclass(frozen=True)
class Point:
    """A steady state: velocity [m/s], pressure [Pa], temperature [deg C] (NaN where none was asked for), by what factor
    relaxation times are longer than at the reference, what it measures, its certificate, and what it took.

    `friction` is the power that the body dissipates, over load and velocity, and what an interface adds; that of
    `measures` is by the slopes of the rigid surface. They differ by the mesh, and `errors` is the budget of the former.
    `operator_calls` are in applications on the finest grid; `sets` is 0 where projected steps did.
    `dissipated` is the power [W] of each branch (empty for a free scene, whose wake goes on outside the box). `flash`
    has the temperatures of the contact, None where the job has no `thermal`; with feedback, found in so many `rounds`,
    the shift factor is that of the flash temperature, and `friction_cold` that without feedback.
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
    sets: int
    seconds: float
    dissipated: tuple[float, ...]
    flash: Flash | None = None
    rounds: int = 1
    friction_cold: float = math.nan

    @property
    def speed(self) -> float:
        """The size of the velocity [m/s]."""
        return math.hypot(*self.velocity)

    @property
    def error_friction(self) -> float:
        """The relative error of friction, 1 or more where it cannot be told from 0; NaN where there is none."""
        return self.errors.friction.of_friction if self.errors.friction else math.nan

    @property
    def error_flash(self) -> float:
        """The relative error of the flash temperature, FLASH times that of friction; NaN where there is none."""
        return FLASH.value * self.error_friction if self.flash and self.flash.mean else math.nan

"""Warnings for jobs that leave the frequencies and temperatures at which their rubber was measured."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ..effects.folded_branches import bands, phases
from ..effects.relaxation import time_factor_of
from ..history.timeline import Timeline
from ..job import Job, Zener

NEAR = 0.5  # accuracy: decades beyond the measured band that pass, as a surface has little of its last waves


class ExcitedBand(NamedTuple):
    """Frequencies [Hz] that a job excites at a temperature [deg C], None where moduli do not depend on it, with the
    shift factor a_T there."""

    temperature: float | None
    factor: float
    band: tuple[float, float]

    @property
    def reduced(self) -> tuple[float, float]:
        """The frequencies [Hz] at the reference temperature at which moduli are the same."""
        return self.band[0] * self.factor, self.band[1] * self.factor


def excited_band(job: Job) -> tuple[float, float] | None:
    """Return the frequencies [Hz] with which the waves of a job's surface pass a point of the body, over all stages and
    steady velocities; None for a surface that stands."""
    velocities = [*(phase.velocity for phase in phases(Timeline.of(job))), job.initial.velocity]
    speeds = [*(math.hypot(*velocity) for velocity in velocities), *(job.steady.velocities if job.steady else ())]
    moving, waves = [speed for speed in speeds if speed > 0.0], list(bands(job.grid, job.surface))
    if not moving or not waves:
        return None
    low, high = min(band.low for band in waves), max(band.high for band in waves)
    return min(moving) * low / (2 * math.pi), max(moving) * high / (2 * math.pi)


def excited_bands(job: Job, temperatures: Sequence[float] = ()) -> list[ExcitedBand]:
    """Return what a job excites at each temperature of a friction curve, or else at that of the material; nothing where
    the surface stands."""
    if (band := excited_band(job)) is None:
        return []
    body = _body(job)
    if body is None or body.shift is None:
        return [ExcitedBand(None, 1.0, band)]
    reference = body.shift.made.reference
    degrees = temperatures or (reference if body.temperature is None else body.temperature,)
    return [ExcitedBand(value, time_factor_of(job.at_temperature(value).material), band) for value in degrees]


def describe_beyond(job: Job, temperatures: Sequence[float] = ()) -> Iterator[str]:
    """Yield a sentence for frequencies and one for temperatures that the material of a job was not measured at.

    `temperatures` [deg C] are those of a friction curve; without any, that of the material.
    """
    if (body := _body(job)) is None:
        return
    degrees = [value for value in temperatures or (body.temperature,) if value is not None]
    if body.temperatures is not None:
        low, high = body.temperatures
        if beyond := [value for value in degrees if not low <= value <= high]:
            yield (
                f"material: {', '.join(f'{value:g}' for value in beyond)} C is beyond the {low:g} to {high:g} C of its "
                "measurement: the shift is an extrapolation there"
            )
    found = excited_bands(job, temperatures)
    if body.band is None or not found:
        return
    low, high = min(one.reduced[0] for one in found), max(one.reduced[1] for one in found)
    for decades, side in ((math.log10(body.band[0] / low), "below"), (math.log10(high / body.band[1]), "above")):
        if decades > NEAR:
            yield (
                f"material: the job excites {low:.3g} to {high:.3g} Hz, reduced to the reference temperature, "
                f"{decades:.1f} decades {side} the measured {body.band[0]:.3g} to {body.band[1]:.3g} Hz: moduli are an "
                "extrapolation there"
            )


def _body(job: Job) -> Zener | None:
    """Return the material as springs and branches; None of an elastic one."""
    return job.material.fitted if isinstance(job.material.fitted, Zener) else None

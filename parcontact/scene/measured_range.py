"""Whether a job stays within the frequencies and temperatures at which its rubber was measured."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ..effects.folded_branches import bands, phases
from ..effects.relaxation import time_factor_of
from ..history.timeline import Timeline
from ..job import Dma, Job, Zener

NEAR = 0.5  # decades beyond the measured band that pass: a surface has little of its last waves


@dataclass(frozen=True)
class ExcitedBand:
    """Frequencies [Hz] that a job excites at a temperature [deg C], None where moduli do not depend on it.

    `factor` is the shift factor a_T there.
    """

    temperature: float | None
    factor: float
    band: tuple[float, float]

    @property
    def reduced(self) -> tuple[float, float]:
        """As at the reference temperature."""
        return self.band[0] * self.factor, self.band[1] * self.factor


def excited_band(job: Job) -> tuple[float, float] | None:
    """Frequencies [Hz] with which the waves of a job's surface pass a point of the body, over all stages and steady
    velocities; None for a surface that stands."""
    speeds = [math.hypot(*phase.velocity) for phase in phases(Timeline.of(job))] + [math.hypot(*job.initial.velocity)]
    speeds = [speed for speed in (*speeds, *(job.steady.velocities if job.steady else ())) if speed > 0.0]
    waves = [(band.low, band.high) for band in bands(job.grid, job.surface)]
    if not speeds or not waves:
        return None
    low, high = min(low for low, _ in waves), max(high for _, high in waves)
    return min(speeds) * low / (2 * math.pi), max(speeds) * high / (2 * math.pi)


def excited_bands(job: Job, temperatures: Sequence[float] = ()) -> list[ExcitedBand]:
    """What a job excites at each temperature of a friction curve, or else at that of the material; nothing where the
    surface stands."""
    body = job.material.fitted if isinstance(job.material, Dma) else job.material
    if (band := excited_band(job)) is None:
        return []
    if not isinstance(body, Zener) or body.shift is None:
        return [ExcitedBand(None, 1.0, band)]
    reference = body.shift.made.reference
    degrees = temperatures or (reference if body.temperature is None else body.temperature,)
    return [ExcitedBand(value, time_factor_of(job.at_temperature(value).material), band) for value in degrees]


def describe_beyond(job: Job, temperatures: Sequence[float] = ()) -> Iterator[str]:
    """Yield a sentence for frequencies and one for temperatures that the material of a job was not measured at.

    `temperatures` [deg C] are those of a friction curve; without any, that of the material.
    """
    body = job.material.fitted if isinstance(job.material, Dma) else job.material
    if not isinstance(body, Zener):
        return
    degrees = [value for value in (*temperatures, *(() if temperatures else (body.temperature,))) if value is not None]
    if body.temperatures is not None:
        low, high = body.temperatures
        beyond = [value for value in degrees if not low <= value <= high]
        if beyond:
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

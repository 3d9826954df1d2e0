"""Warnings for jobs outside the frequencies and temperatures at which their rubber was measured."""

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from ..doubts import Doubt
from ..effects.relaxation import time_factor_of
from ..job import Flat, Grid, Job, Rough, Wave, Zener
from ..rubber.shift import doubt_kelvin

NEAR = 0.5  # accuracy: decades beyond the measured band without a warning


class ExcitedBand(NamedTuple):
    """Frequencies [Hz] that a job excites at a temperature [deg C], and the shift factor a_T there.

    The temperature is None if moduli do not depend on it.
    """

    temperature: float | None
    factor: float
    band: tuple[float, float]

    @property
    def reduced(self) -> tuple[float, float]:
        """Frequencies [Hz] with the same moduli at the reference temperature."""
        return self.band[0] * self.factor, self.band[1] * self.factor


def excited_band(job: Job) -> tuple[float, float] | None:
    """Return the range of frequencies [Hz] at which the waves of a job's surface load a point of the body, over all
    stages and steady velocities; None if the surface does not move."""
    velocities = [*(stage.velocity for stage in job.history), job.initial.velocity]
    speeds = [*(math.hypot(*velocity) for velocity in velocities), *(job.steady.velocities if job.steady else ())]
    moving, waves = (
        [speed for speed in speeds if speed > 0.0],
        [number for shape in job.surface for number in wave_numbers(shape, job.grid)],
    )
    if not moving or not waves:
        return None
    low, high = min(waves), max(waves)
    return min(moving) * low / (2 * math.pi), max(moving) * high / (2 * math.pi)


def wave_numbers(shape: Any, grid: Grid) -> tuple[float, ...]:
    """Return the wavenumbers [rad/m] of a shape, or the lowest and the highest one; none for a flat surface. Round
    shapes and files may have every wave from the box to two cells."""
    longest = 2.0 * math.pi / max(grid.size)
    cells = [cell for cell, n in zip((grid.dx, grid.dy), grid.points, strict=True) if n > 1]
    if isinstance(shape, Flat):
        return ()
    if isinstance(shape, Wave):
        waves = [2.0 * math.pi * n / length for n, length in zip(shape.waves, grid.size, strict=True)]
        return (math.hypot(*waves),) if any(waves) else ()
    if isinstance(shape, Rough):
        ratio = shape.anisotropy.ratio if shape.anisotropy else 1.0
        return max(2.0 * math.pi / (ratio * shape.long_wavelength), longest), 2.0 * math.pi / shape.short_wavelength
    return longest, max(math.pi / min(cells, default=math.inf), longest)


def excited_bands(job: Job, temperatures: Sequence[float] = ()) -> list[ExcitedBand]:
    """Return the frequencies that a job excites at each temperature of a friction curve, or at the temperature of the
    material; none if the surface does not move."""
    if (band := excited_band(job)) is None:
        return []
    body = _body(job)
    if body is None or body.shift is None:
        return [ExcitedBand(None, 1.0, band)]
    reference = body.shift.made.reference
    degrees = temperatures or (reference if body.temperature is None else body.temperature,)
    return [ExcitedBand(value, time_factor_of(job.at_temperature(value).material), band) for value in degrees]


def doubt_band(job: Job, temperatures: Sequence[float] = ()) -> Iterator[Doubt]:
    """Yield warnings about frequencies and temperatures at which the material was not measured. `temperatures` [deg C]
    belong to a friction curve; without them the temperature of the material counts."""
    if (body := _body(job)) is None:
        return
    if job.steady is None or tuple(temperatures) != job.steady.temperatures:  # given apart from the job
        yield from doubt_kelvin("temperatures", temperatures)
    degrees = [value for value in temperatures or (body.temperature,) if value is not None]
    if body.temperatures is not None:
        low, high = body.temperatures
        if beyond := [value for value in degrees if not low <= value <= high]:
            degrees_text = ", ".join(f"{value:g}" for value in beyond)
            yield Doubt("temperatures", "material", {"degrees": degrees_text, "low": low, "high": high})
    found = excited_bands(job, temperatures)
    if body.band is None or not found:
        return
    low, high = min(one.reduced[0] for one in found), max(one.reduced[1] for one in found)
    for decades, side in ((math.log10(body.band[0] / low), "below"), (math.log10(high / body.band[1]), "above")):
        if decades > NEAR:
            measured = {"decades": decades, "side": side, "first": body.band[0], "last": body.band[1]}
            yield Doubt("frequencies", "material", {"low": low, "high": high, **measured})


def _body(job: Job) -> Zener | None:
    """Return the material as springs and branches; None if it is elastic."""
    return job.material.fitted if isinstance(job.material.fitted, Zener) else None

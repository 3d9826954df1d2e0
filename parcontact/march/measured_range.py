"""Warnings for jobs outside the frequencies and temperatures at which their rubber was measured."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ..effects.branches import time_factor_of
from ..errors import Doubt, Kind
from ..job import Job, Zener
from ..job.meaning import excited_band
from ..rubber.shift import doubt_kelvin

NEAR = 0.5  # accuracy: decades beyond the measured band without a warning


class ExcitedBand(NamedTuple):
    """Frequency range [Hz] that a job excites at a temperature [deg C], and the shift factor a_T at this temperature.

    The temperature is None if the moduli do not depend on it.
    """

    temperature: float | None
    factor: float
    band: tuple[float, float]

    @property
    def reduced(self) -> tuple[float, float]:
        """Frequency range [Hz] with the same moduli at the reference temperature."""
        return self.band[0] * self.factor, self.band[1] * self.factor


def excited_bands(job: Job, temperatures: Sequence[float] = ()) -> list[ExcitedBand]:
    """Return the frequency range that a job excites at each temperature of a friction curve, or at the temperature of
    the material if there is no curve; an empty list if the surface does not move."""
    if (band := excited_band(job)) is None:
        return []
    body = _body(job)
    if body is None or body.shift is None:
        return [ExcitedBand(None, 1.0, band)]
    reference = body.shift.made.reference
    degrees = temperatures or (reference if body.temperature is None else body.temperature,)
    return [ExcitedBand(value, time_factor_of(job.at_temperature(value).material), band) for value in degrees]


WARN_TEMPERATURES = Kind(
    "temperatures", "{degrees} C is outside of the measured {low:g} to {high:g} C: the shift is an extrapolation there"
)
WARN_FREQUENCIES = Kind(
    "frequencies",
    "the job excites {low:.3g} to {high:.3g} Hz, reduced to the reference temperature, {decades:.1f} decades "
    "{side} the measured {first:.3g} to {last:.3g} Hz: moduli are an extrapolation there",
)


def doubt_band(job: Job, temperatures: Sequence[float] = ()) -> Iterator[Doubt]:
    """Yield warnings about frequencies and temperatures at which the material was not measured. `temperatures` [deg C]
    belong to a friction curve; without a curve the temperature of the material counts."""
    if (body := _body(job)) is None:
        return
    if job.steady is None or tuple(temperatures) != job.steady.temperatures:  # given apart from the job
        yield from doubt_kelvin("temperatures", temperatures)
    degrees = [value for value in temperatures or (body.temperature,) if value is not None]
    if body.temperatures is not None:
        low, high = body.temperatures
        if beyond := [value for value in degrees if not low <= value <= high]:
            degrees_text = ", ".join(f"{value:g}" for value in beyond)
            yield WARN_TEMPERATURES("material", {"degrees": degrees_text, "low": low, "high": high})
    found = excited_bands(job, temperatures)
    if body.band is None or not found:
        return
    low, high = min(one.reduced[0] for one in found), max(one.reduced[1] for one in found)
    for decades, side in ((math.log10(body.band[0] / low), "below"), (math.log10(high / body.band[1]), "above")):
        if decades > NEAR:
            measured = {"decades": decades, "side": side, "first": body.band[0], "last": body.band[1]}
            yield WARN_FREQUENCIES("material", {"low": low, "high": high, **measured})


def _body(job: Job) -> Zener | None:
    """Return the material as springs and branches; None if it is elastic."""
    return job.material.fitted if isinstance(job.material.fitted, Zener) else None

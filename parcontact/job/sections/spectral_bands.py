"""The `bands` section: the spectrum of a surface cut into bands, each solved on a grid of its own."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, PlainValidator, ValidationInfo

from ..text.fault import Fault, refuse
from .part import Part, Rule
from .quantities import Count, Positive, Whole, both

Auto = Literal["auto"]
AUTO: Auto = "auto"
LEAST_WAVES = 2  # longest waves along a box whose cells of wavenumbers do not reach 0
LEAST_CELLS = 2.0  # accuracy: least cells per shortest wave of a band (Nyquist)


class Bands(Part):
    """Bands of the spectrum; keys that are not given follow from `numerics.accuracy`."""

    count: Annotated[int, Field(ge=1, le=100)] | None = Field(
        default=None, description="a whole number of bands from 1 to 100"
    )
    points: Annotated[tuple[Count, Count], BeforeValidator(both)] | None = Field(
        default=None, description="a positive whole number of points"
    )
    waves: Annotated[Whole, Field(ge=LEAST_WAVES)] | None = Field(
        default=None, description="a whole number of at least 2 of the longest waves of a band along a side of its box"
    )
    samples: Count | None = Field(default=None, description="a positive whole number of surfaces of each band")
    cutoff_slope: Positive | None = Field(default=None, description="a positive rms slope [-]")


def _choose(value: Any, info: ValidationInfo) -> Bands | Auto:
    if value == AUTO:
        return AUTO
    if isinstance(value, str):
        refuse(Fault(f"must be auto, or a mapping with count, points and waves, got {value!r}"))
    return Bands.model_validate(value, context=info.context)


SomeBands = Annotated[Bands | Auto, PlainValidator(_choose, json_schema_input_type=Bands | Auto)]


def _without(name: str, why: str) -> Rule:
    """Return the rule that a job with bands does not have a section."""

    def check(bands: Any, section: Any) -> Iterator[Fault]:
        if bands is not None and section:
            yield Fault(f"cannot be used with bands: {why}", (name,))

    return Rule(("bands", name), check)


def _over_time(bands: Any, history: Any, initial: Any, output: Any) -> Iterator[Fault]:
    """Check that bands can be marched through a history: under one pressure, along x, with steps of their own."""
    if bands is None or not history or None in history:
        return
    load = "must be the same pressure in all stages of a job in bands, whose bands are marched at fixed pressures"
    for index, stage in enumerate(history):
        place = ("history", index)
        if stage.frequency:
            yield Fault("cannot oscillate in a job in bands, which are marched through slides and rests", place)
            continue
        if stage.control != "pressure":
            yield Fault(
                "cannot be used with bands, which have boxes of their own: give a pressure", (*place, stage.control)
            )
        elif not stage.load.constant or stage.load.start != (history[0].pressure or stage.load).start:
            yield Fault(load, (*place, "pressure"))
        elif not stage.load.start > 0.0:
            yield Fault("must be positive in a job in bands", (*place, "pressure"))
        if stage.velocity[1]:
            yield Fault("must be along x in a job in bands, whose surfaces are isotropic", (*place, "velocity"))
        for key in (key for key in ("time_step", "cells_per_step") if getattr(stage, key) not in (None, AUTO)):
            yield Fault("cannot be used with bands, whose steps follow their own cells; leave it out", (*place, key))
    if initial.state == "steady" and initial.pressure != history[0].load.start:
        yield Fault("must be the pressure of the history in a job in bands", ("initial", "pressure"))
    if initial.state == "steady" and (initial.velocity[1] or not initial.velocity[0]):
        yield Fault("must be along x, and not zero, in a job in bands", ("initial", "velocity"))
    if output.energy:
        yield Fault("cannot be used with bands: the work on finer bands is in no band", ("output", "energy"))


BAND_RULES = (
    Rule(("bands", "history", "initial", "output"), _over_time),
    _without("body", "a layer changes the coarsest waves only; give it a grid"),
    _without("study", "a study refines one grid"),
)

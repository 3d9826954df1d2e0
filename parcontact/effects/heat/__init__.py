"""Heat of sliding: temperatures of the rubber below the contact, their columns in tables, and their panels."""

import math
from collections.abc import Callable
from operator import attrgetter
from typing import Any

from ...capabilities import Axis, Column, ColumnPanel, Table

SECTION, EFFECT = "thermal", "ThermalColumns"
USES = ("shear",)  # see `capabilities`


def _of(name: str) -> Callable[[Any], float]:
    """Return a function that takes a point and returns one of its temperatures, or NaN if the job has no `thermal`
    section."""
    return lambda point: getattr(point.effects.get("thermal"), name, math.nan)


def _error(point: Any) -> float:
    """Return the relative error of the flash temperature of a point; NaN if this temperature is 0."""
    flash = point.effects.get("thermal")
    return ERROR * point.error_friction if flash and flash.mean else math.nan


# fitted: error of the flash temperature over that of friction, by scripts/error_coverage.py: 6.3, 1.1 to 150 times the
# true error, in 96 % of 127 scenes
ERROR = 3.0


MEASURES: Table = (
    Column(
        *("flash_temperature", "K"),
        "mean temperature rise of the contact, weighted by heat flux, or by pressure at rest (with `thermal`, "
        "{doc}`heat`)",
        _of("mean"),
        "thermal",
    ),
    Column(
        *("max_temperature", "K"), "highest rise on the surface of the body (with `thermal`)", _of("highest"), "thermal"
    ),
    Column(
        *("error_flash", ""),
        "estimated relative error of `flash_temperature`, three times the error of friction, the source of heat (with "
        "`thermal`); empty where the rise is 0",
        _error,
        "thermal",
    ),
)
STEADY: Table = (
    *MEASURES,
    Column(
        *("lower_temperature", "K"),
        "rise below which a quarter of the heat is generated (with `thermal`)",
        _of("lower"),
        "thermal",
    ),
    Column(
        *("upper_temperature", "K"),
        "rise above which a quarter of the heat is generated (with `thermal`)",
        _of("upper"),
        "thermal",
    ),
    Column(
        *("friction_cold", "", "friction without feedback (with `thermal.feedback`)"), _of("friction_cold"), "feedback"
    ),
    Column(
        *("flash_shift", ""),
        "relaxation times at the flash temperature over those at the reference (with `feedback`)",
        attrgetter("shift_factor"),
        "feedback",
    ),
    Column(
        *("rounds", "", "steady states solved until the temperature settled (with `feedback`)"),
        _of("rounds"),
        "feedback",
    ),
)
BANDS: Table = (
    Column("flash_temperature", "K", "temperature rise of the rubber in this band (with `thermal`)", when="thermal"),
)
FIELDS: Table = (
    Column("temperature", "K", "rise of the temperature of the body's surface (with `thermal`, {doc}`heat`)"),
)
FIELDS_NEED = {"temperature": "a thermal section"}  # what the maps need

RISE, FLASH = Axis("temperature rise", "K"), "flash_temperature"
RUN_PANELS = (ColumnPanel("temperature", RISE, {"flash": FLASH, "highest": "max_temperature"}),)
CURVE_PANELS = (ColumnPanel("steady flash", Axis("flash temperature", "K"), {"": FLASH}),)
BAND_PANELS = (ColumnPanel("bands heat", RISE, {"": FLASH}),)

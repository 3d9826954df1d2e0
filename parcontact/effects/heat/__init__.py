"""Heat of sliding: temperatures of the rubber below the contact.

Columns of heat.

Sentences of the warnings about heat (`doubts.Doubt`).
"""

import math
from operator import attrgetter
from typing import Any

from ...column import Column, Table

SECTION, EFFECT = "thermal", "ThermalColumns"
USES = ("shear",)  # see `capabilities`


def _worst(point: Any, name: str) -> float:
    return getattr(point.flash, name) if point.flash else math.nan


MEASURES: Table = (
    Column(
        *("flash_temperature", "K"),
        "mean temperature rise of the contact, weighted by heat flux, or by pressure at rest (with `thermal`, "
        "{doc}`heat`)",
        lambda point: _worst(point, "mean"),
        "thermal",
    ),
    Column(
        *("max_temperature", "K"),
        "highest rise on the surface of the body (with `thermal`)",
        lambda point: _worst(point, "highest"),
        "thermal",
    ),
    Column(
        *("error_flash", ""),
        "estimated relative error of `flash_temperature`, three times the error of friction, the source of heat (with "
        "`thermal`); empty where the rise is 0",
        lambda point: point.error_flash,
        "thermal",
    ),
)
STEADY: Table = (
    *MEASURES,
    Column(
        *("lower_temperature", "K"),
        "rise below which a quarter of the heat is generated (with `thermal`)",
        lambda point: _worst(point, "lower"),
        "thermal",
    ),
    Column(
        *("upper_temperature", "K"),
        "rise above which a quarter of the heat is generated (with `thermal`)",
        lambda point: _worst(point, "upper"),
        "thermal",
    ),
    Column("friction_cold", "", "friction without feedback (with `thermal.feedback`)", when="feedback"),
    Column(
        *("flash_shift", ""),
        "relaxation times at the flash temperature over those at the reference (with `feedback`)",
        attrgetter("shift_factor"),
        "feedback",
    ),
    Column("rounds", "", "steady states solved until the temperature settled (with `feedback`)", when="feedback"),
)
FIELDS: Table = (
    Column("temperature", "K", "rise of the temperature of the body's surface (with `thermal`, {doc}`heat`)"),
)
FIELDS_NEED = {"temperature": "a thermal section"}  # what the maps need


SENTENCES = {
    "decomposes": (
        "flash temperatures of {count} of {points} points are above {most:g} K, up to {rise:.3g} K at {speed:g} m/s: "
        "rubber decomposes there; take a smaller thermal.distance, velocity or pressure"
    ),
    "flash temperatures": (
        "with its flash temperature the rubber is beyond the {low:g} to {high:g} C of its measurement at {count} of "
        "{points} points, up to {hottest:.3g} C at {speed:g} m/s: the shift is an extrapolation there"
    ),
}

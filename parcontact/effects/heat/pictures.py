"""Panels of heat: the mean rise of temperature in the contact, and the highest one."""

from ...results.panels import Axis, ColumnPanel

RISE, FLASH = Axis("temperature rise", "K"), "flash_temperature"
RUN_PANELS = (ColumnPanel("temperature", RISE, {"flash": FLASH, "highest": "max_temperature"}),)
CURVE_PANELS = (ColumnPanel("steady flash", Axis("flash temperature", "K"), {"": FLASH}),)
BAND_PANELS = (ColumnPanel("bands heat", RISE, {"": FLASH}),)

"""Panels of heat: temperatures of a run, and the temperature by band."""

from collections.abc import Iterator
from dataclasses import replace

from ...results.histories import Abscissa
from ...results.panels import Axis, Panel
from ...results.plotted_run import PlottedRun

KEYS = ("temperature",)
BAND_PANELS = {"flash_temperature": ("bands heat", Axis("temperature rise", "K"))}


def panels(run: PlottedRun, along: Abscissa) -> Iterator[Panel]:
    """Yield the panel of temperatures: the mean rise in the contact, and the highest one."""
    if "flash_temperature" in run.columns:
        lines = along.series({"flash": run.columns["flash_temperature"], "highest": run.columns["max_temperature"]})
        found = Panel("temperature", along.axis, BAND_PANELS["flash_temperature"][1], lines, bottom=True)
        yield found if along.marked or along.loop else replace(found, spikes=True)

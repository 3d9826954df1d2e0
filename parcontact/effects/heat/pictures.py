"""Panel of heat: temperature by band."""

from ...results.charts import Axis

BAND_PANELS = {"flash_temperature": ("bands heat", Axis("temperature rise", "K"))}

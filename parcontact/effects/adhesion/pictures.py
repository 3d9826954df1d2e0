"""Panels of adhesion."""

from ...plotting.charts import Axis

SWEEP_PANELS = (("pull-off", Axis("pull-off force", "N"), {"pull-off": "pull_off"}),)

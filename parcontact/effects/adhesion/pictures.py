"""Panels of adhesion."""

from ...results.panels import Axis

SWEEP_PANELS = (("pull-off", Axis("pull-off force", "N"), {"pull-off": "pull_off"}),)

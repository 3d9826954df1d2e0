"""Panels of a run with adhesion."""

from ...results.panels import Axis, ColumnPanel

SWEEP_PANELS = (ColumnPanel("pull-off", Axis("pull-off force", "N"), {"pull-off": "pull_off"}),)

"""A rough counterbody that deforms, too: both bodies as one."""

SECTION, EFFECT = "counterbody", "CounterbodyThatDeforms"
MATERIAL = True  # see `capabilities`

"""A rough counterbody that deforms, too: both bodies are calculated as one."""

SECTION, EFFECT = "counterbody", "CounterbodyThatDeforms"
MATERIAL = IN_SCENE = True  # see `capabilities`

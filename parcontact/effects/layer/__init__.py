"""The rubber as a layer on a rigid base, in place of a half space."""

SECTION, EFFECT = "body", "RubberLayer"
IN_SCENE = True  # see `capabilities`

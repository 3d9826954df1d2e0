"""Heat of sliding: temperatures of the rubber below the contact."""

SECTION, EFFECT = "thermal", "ThermalColumns"
USES = ("shear",)  # see `capabilities`

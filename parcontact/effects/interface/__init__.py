"""Friction of the contact area itself: a shear stress or a coefficient."""

SECTION, EFFECT = "interface", "InterfaceColumns"
GIVES = ("shear",)  # see `capabilities`

"""Friction of the contact area itself, by a shear stress or a coefficient, and its columns in tables."""

from operator import attrgetter

from ...capabilities import Column, Table

SECTION, EFFECT = "interface", "InterfaceColumns"
GIVES = ("shear",)  # see `capabilities`


MEASURES: Table = (
    Column(
        *("friction_viscous", ""),
        "`friction` minus `friction_interface` (with `interface`): component of the viscoelastic force along the total "
        "force, over the load",
        when="interface",
    ),
    Column(
        *("friction_interface", ""),
        "component of the shear force on the corrected contact area along the total force, over the load; it may be "
        "negative after a reversal",
        when="interface",
    ),
)
STEADY: Table = (
    Column(
        *("friction_viscous", ""),
        "part of friction from the body (with `interface`)",
        lambda point: point.friction - point.measures.friction_interface,
        "shear",
    ),
    Column(
        *("friction_interface", ""),
        "part of friction from the shear of the corrected contact area (with `interface`)",
        attrgetter("measures.friction_interface"),
        "shear",
    ),
)
SHOWN = ("friction_viscous", "friction_interface")  # columns of a run whose ends a report shows

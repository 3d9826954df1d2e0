"""Strain softening of filled rubber in steady sliding (the Payne effect), its columns and its panel."""

from ...capabilities import Axis, Column, ColumnPanel, Table

SECTION = "softening"
EFFECT = "SofteningEffect"


STEADY: Table = (
    Column(
        *("strain_amplitude", ""),
        "amplitude of the shear strain that softens the rubber, weighted by power (with `softening`)",
        lambda point: point.effects["softening"],
        "softening",
    ),
)
BANDS: Table = (
    Column("strain_amplitude", "", "strain that softens the rubber of the band (with `softening`)", when="softening"),
)
BAND_PANELS = (ColumnPanel("bands strain", Axis("strain amplitude"), {"": "strain_amplitude"}),)

"""Strain softening of filled rubber in steady sliding (the Payne effect), and its columns in tables."""

from ...capabilities import Column, Table

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

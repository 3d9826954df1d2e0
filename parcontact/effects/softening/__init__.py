"""Strain softening of filled rubber in steady sliding (the Payne effect).

Columns of softening.

Sentences of the warnings about softening (`doubts.Doubt`).
"""

from ...column import Column, Table

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


SENTENCES = {
    "strains beyond the sweep": (
        "the strain is {strain:.2g} at {speed:g} m/s, beyond the {low:.3g} to {high:.3g} of the sweep at {count} of "
        "{points} points: factors of its ends are used there; measure a wider range of strains"
    )
}

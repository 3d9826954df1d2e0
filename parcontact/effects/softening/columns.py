"""Columns of softening."""

from ...column import Column, Table

STEADY: Table = (
    Column(
        *("strain_amplitude", ""),
        "amplitude of the shear strain that softens the rubber, weighted by power (with `softening`)",
        when="softening",
    ),
)

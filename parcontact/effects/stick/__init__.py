"""Stick and slip: points of the contact stick until the traction reaches its bound.

Columns of stick and slip.

Sentences of the warnings about stick and slip (`doubts.Doubt`).
"""

from ...column import Column, Table

GIVES = ("shear",)  # see `capabilities`


MEASURES: Table = (
    Column(
        *("stick_area", ""),
        "share of the box that touches and does not slip (with `interface.stick`)",
        when="interface.stick",
    ),
    Column(
        *("slip_loss", "J"),
        "energy lost in slip since the start (with `interface.stick` and `output.energy`); "
        "`work` is `stored`, `dissipated` and this",
        when="interface.stick",
    ),
)
FIELDS: Table = (
    Column("traction_x", "Pa", "traction on the body along x (with `interface.stick`)"),
    Column("traction_y", "Pa", "traction on the body along y"),
)
FIELDS_NEED = {"traction": "interface: {stick: true}"}  # what the map needs
VECTORS = ("traction",)  # maps with two components


SENTENCES = {
    "whole box sticks": (
        "{where}: all of the periodic box is in contact, where no traction moves the mean of its surface: friction of "
        "the first steps that stick may be too small; use grid.boundary: free, a smaller load or rougher heights"
    )
}

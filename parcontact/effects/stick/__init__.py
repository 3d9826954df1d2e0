"""Stick and slip: points of the contact stick until the traction reaches its bound; columns in tables."""

from ...capabilities import Column, Table

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

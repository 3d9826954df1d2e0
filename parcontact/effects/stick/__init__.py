"""Stick and slip: points of the contact stick until the traction reaches its bound."""

GIVES = ("shear",)  # see `capabilities`

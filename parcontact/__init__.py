"""Rough viscoelastic contact on parallel machines."""

__version__ = "0.1.0"

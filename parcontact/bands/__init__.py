"""Friction of a whole road: its spectrum is divided into bands, each on its own grid. Statistics couple the bands."""

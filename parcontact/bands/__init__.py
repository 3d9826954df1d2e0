"""Friction of a whole road: its spectrum in bands, each on its own grid, coupled by statistics."""

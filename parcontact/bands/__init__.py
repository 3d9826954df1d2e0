"""Friction of a whole road: its spectrum in bands, each on a grid of its own, coupled by statistics."""

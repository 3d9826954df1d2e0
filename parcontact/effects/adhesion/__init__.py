"""Adhesion: surfaces that attract each other."""

SECTION, EFFECT = "adhesion", "AdhesionColumns"

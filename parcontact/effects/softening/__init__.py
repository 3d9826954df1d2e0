"""Strain softening of filled rubber in steady sliding (the Payne effect)."""

SECTION = "softening"
EFFECT = "SofteningEffect"

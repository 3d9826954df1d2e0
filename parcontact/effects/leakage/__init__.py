"""Leakage through the gap of a contact."""

SECTION, EFFECT = "leakage", "LeakageColumns"

"""Leakage through the gap of a contact."""

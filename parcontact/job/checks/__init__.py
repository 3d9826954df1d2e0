"""Checks of a job beyond single keys: limits of computing, resolution, physical meaning, size."""

"""Checks of an installation: exact answers, ranks, files, and times."""

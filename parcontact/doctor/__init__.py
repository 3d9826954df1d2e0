"""Checks of an installation: exact solutions, ranks, files, and times."""

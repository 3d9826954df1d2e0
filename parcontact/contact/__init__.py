"""Solvers for contact problems. They work on arrays, and read and write no files."""

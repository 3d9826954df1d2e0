"""Solvers for contact problems. They work on arrays and import no physics and no files."""

"""Errors of friction and contact area: their sources, their sum, and the tolerances and steps that follow."""

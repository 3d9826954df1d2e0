"""Steady sliding, solved on nested grids: as the start of a march, and along friction curves."""

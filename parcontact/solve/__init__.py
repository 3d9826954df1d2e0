"""Numbers only: no physics names, no files."""

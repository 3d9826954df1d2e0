"""How wrong friction and contact area are: sources of error, their sum, and what follows for tolerances and steps."""

"""What leaks through the gap of a contact."""

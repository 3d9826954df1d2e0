"""Tractions of a contact that sticks and slips."""

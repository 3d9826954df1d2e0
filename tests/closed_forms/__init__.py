"""Closed forms against which results are tested; those that users call are in `parcontact.theory`."""

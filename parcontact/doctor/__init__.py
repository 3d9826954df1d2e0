"""Hard cases: what a contact code may get wrong, small enough to be examined anywhere in seconds."""

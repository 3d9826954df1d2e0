"""Contact with adhesion: the gap is the unknown, under a law of traction over gap."""

"""The door holds the verbs of the command line, the Python interface, and the manual."""

"""What users call: verbs of the command line, the Python interface, and the manual."""

"""The user's access to the program: verbs of the command line, the Python interface, and the manual."""

"""The command line: arguments, verbs, and the ranks that print."""

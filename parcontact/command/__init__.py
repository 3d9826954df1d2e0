"""The command line: what its words mean, what each verb does, who speaks, and how the program ends."""

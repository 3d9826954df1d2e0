"""A run that survives: from a job to its output directory, restarts, signals and time limits."""

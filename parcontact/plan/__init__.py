"""The plan of a job before it runs: effects, memory, steps and time."""

"""The sections of a job: each key with its type, range, unit and default."""

"""Runs of jobs in output directories, with restarts, signals and time limits."""

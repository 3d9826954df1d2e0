"""Calculations for a job, or from the files of its run: Persson's theory, and leakage over time."""

"""What is calculated for a job, or from what its run has left: Persson's theory, and leakage over time."""

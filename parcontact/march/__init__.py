"""Calculate a job, in steps of time or in steady sliding: choices, objects of the calculation, and estimated errors."""

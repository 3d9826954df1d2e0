"""From a job to its steps in time or to steady sliding: objects of the calculation, decisions, and error estimates."""

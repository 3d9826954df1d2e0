"""One step of a history, the loop over steps, rest made in one step, and errors of failed steps."""

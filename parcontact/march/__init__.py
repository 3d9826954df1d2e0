"""One step of a history and the loop over steps; rest made in one step; what to say of a step that failed."""

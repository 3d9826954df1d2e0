"""Pictures of runs, panel by panel."""

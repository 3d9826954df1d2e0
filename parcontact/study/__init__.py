"""Studies of accuracy: a job with coarser and finer settings, the limits of its results, and their costs."""

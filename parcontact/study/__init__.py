"""Studies of accuracy: a job run with coarser and finer settings, the limit that its results go to, and the price."""

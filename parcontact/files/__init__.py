"""This room has the output directories, and the runs of jobs that write their results into these directories."""

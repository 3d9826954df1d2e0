"""Measured roads: files of many instruments, their treatment, statistics, and heights on a grid."""

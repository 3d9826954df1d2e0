"""Measured roads: files of many instruments, their treatment, their spectra, and heights on a grid."""

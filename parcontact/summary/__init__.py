"""Summaries of a run, a sweep or a friction curve: figures, tables and references to cite."""

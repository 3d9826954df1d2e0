"""Results of a run, a sweep or a friction curve in short: figures, tables and references to cite."""

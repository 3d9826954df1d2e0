"""What a run, a sweep or a friction curve comes to: figures, tables and references to cite."""

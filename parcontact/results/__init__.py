"""This room shows the results in output directories: as tables, texts, pictures and reports."""

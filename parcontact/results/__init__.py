"""Results of output directories: tables, sentences, pictures and reports."""

"""Results of runs, curves, sweeps and studies: tables, texts, pictures and reports."""

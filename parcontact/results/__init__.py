"""Results of runs, curves, sweeps and studies as tables, texts, pictures and reports."""

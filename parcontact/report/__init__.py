"""A report in one HTML file: job, results, costs and provenance."""

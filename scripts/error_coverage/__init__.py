"""Parts of scripts/error_coverage.py."""

"""Output directories and the runs that fill them."""

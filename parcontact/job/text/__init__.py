"""Reading of YAML text or Python data as plain data, with the place of each value."""

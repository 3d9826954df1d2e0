"""Contact with operators that are not symmetric: steady sliding."""

"""The manual: its pages, and their texts for a terminal."""

"""Counterbody that deforms, too."""

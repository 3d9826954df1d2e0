"""Sentences of the warnings about stick and slip (`doubts.Doubt`)."""

SENTENCES = {
    "whole box sticks": (
        "{where}: all of the periodic box is in contact, where no traction moves the mean of its surface: friction of "
        "the first steps that stick may be too small; use grid.boundary: free, a smaller load or rougher heights"
    )
}

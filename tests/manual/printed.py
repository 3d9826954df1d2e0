"""Comparison of the output shown on a page with the output of a run."""

import re

import pytest

NUMBER = r"\d[\d.]*(?:e-?\d+)?"


def compare_lines(text: str, log: str) -> None:
    """Hold each line to the one of the log that has the same words. Another machine may round elsewhere: 5 %."""
    for line in text.replace("\n  ", " ").splitlines():  # a line that begins with blanks goes on
        words = ".*".join(map(re.escape, re.split(NUMBER, line)))
        (found,) = set(re.findall(words, log))
        expected = [float(number) for number in re.findall(NUMBER, line)]
        assert [float(number) for number in re.findall(NUMBER, found)] == pytest.approx(expected, rel=0.05)

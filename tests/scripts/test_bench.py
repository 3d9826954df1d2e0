"""What scripts/bench.py counts and concludes; what it times is judged by nobody but its reader."""

import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from marching import load_script


@pytest.fixture(scope="module")
def peers() -> ModuleType:
    return load_script("bench.peers")


@pytest.mark.parametrize(
    ("begins", "needs"),
    [(-2.0, 1e-3), (-4.0, 1e-3)],  # the first tolerance is too loose, or tighter than it need be
)
def test_the_loosest_tolerance_is_found(peers: ModuleType, begins: float, needs: float) -> None:
    """A program whose error is its tolerance, and which takes a second for each digit."""
    code = "def attempt(tolerance):\n    return -float(np.log10(tolerance)), tolerance"
    given = {"heights": np.zeros((2, 2)), "load": 1.0, "wanted": needs * (1.0 + 1e-12)}
    found = peers.search(Path(sys.executable), peers.Task("it", code, begins), given)
    assert found.reached
    assert found.seconds == pytest.approx(3.0)
    assert found.error == pytest.approx(1e-3)


def test_a_program_that_is_too_slow(peers: ModuleType) -> None:
    """What its last try took at least counts, or a longer one before."""
    first = [{"began": 0.0}, {"seconds": 100.0, "error": 1e-5}, {"began": 120.0}]
    assert peers.judge(first, 1e-7).seconds == peers.LIMIT - 120.0
    assert not peers.judge(first, 1e-7).reached
    assert peers.judge([*first[:2], {"began": 400.0}], 1e-7).seconds == 100.0


def test_a_slide_goes_on_for_as_many_rounds_as_are_asked_for() -> None:
    """Also past the length of the box, whose surface comes round again."""
    slide = load_script("bench.work").Slide(64)
    for _ in range(66):
        slide.step()
    assert slide.march.row.distance == pytest.approx(65e-3 / 64, rel=1e-12)  # the first step is the jump of the load

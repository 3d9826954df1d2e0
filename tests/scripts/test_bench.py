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


@pytest.mark.parametrize("name", ["rough, elastic, middle", "rough, elastic, strong", "rough, rubber, middle"])
def test_a_resolved_step_with_adhesion(name: str) -> None:
    """It takes at most three times the operator calls of the same step without, and more than half of them: both are
    solved to the same tolerance, or the one without to errors that are no larger."""
    sticking = load_script("bench.sticking")
    job = sticking.job_of(sticking.SCENES[name], 128)
    plain = {key: value for key, value in job.items() if key != "adhesion"}
    steps, without = sticking.count(job), sticking.count(plain)
    exact = sticking.as_exact(job, plain, steps)
    resolved = steps.front <= 1.0
    assert resolved.sum() >= 5
    assert not without.front.any()
    for others in (exact, without):
        assert 0.5 < steps.calls[resolved].sum() / others.calls[resolved].sum() < 3.0
    own, allowed = (one.errors(sticking.count(each, 2e-5)) for one, each in ((exact, plain), (steps, job)))
    assert own[0] <= allowed[0]
    assert own[1] <= allowed[1]

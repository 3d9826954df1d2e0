"""Results that are not finite never pass for results, and a certificate that is not a number is none."""

import math
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from conftest import Main
from marching import begun
from short_job import JOB

from parcontact.history.timeline import Timeline
from parcontact.march.failure import StepError
from parcontact.physics.measures import Measures
from parcontact.physics.probe import Probe
from parcontact.solve.certificate import Certificate

NAN, INF = math.nan, math.inf


@pytest.mark.parametrize("wrong", [NAN, INF])
@pytest.mark.parametrize("place", range(3))
def test_no_certificate(wrong: float, place: int) -> None:
    parts = [0.0, 0.0, 0.0]
    parts[place] = wrong
    assert not Certificate(*parts).worst <= 1.0


@pytest.mark.parametrize("wrong", [NAN, INF, 1e308])
def test_heights_that_are_not_finite(wrong: float) -> None:
    """Whatever the solver makes of them: no row, and the state is as it was."""
    march = begun(JOB)
    first, second = islice(Timeline.of(march.scene.job), 2)
    march.advance(first)
    before, pressure = march.row, march.field("pressure")
    motion: Any = march.scene.motion
    heights = motion.at(second.position)
    heights.parts[0][...] = wrong
    motion.at = lambda position: heights
    with np.errstate(all="ignore"), pytest.raises(StepError):
        march.advance(second)
    assert march.row is before
    assert np.array_equal(march.field("pressure"), pressure)


@pytest.fixture
def overflowing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measures one of which overflows, of solves that are as they should be."""
    measures = Probe.measure

    def overflow(self: Probe, *words: Any) -> Measures:
        return replace(measures(self, *words), force_y=INF)

    monkeypatch.setattr(Probe, "measure", overflow)


CURVE = ("steady", "--velocities", "0.1,1", "--pressures", "1e4")


@pytest.mark.usefixtures("overflowing")
@pytest.mark.parametrize(
    ("words", "said", "times"),
    [
        (("run",), "step 1 at t = 0 s (stage 'press'): force_y would not be finite", 1),
        (CURVE, "its results would not be finite", 2),  # of each point
    ],
)
def test_no_run_and_no_point_of_a_curve_is_one(
    main: Main, tmp_path: Path, words: tuple[str, ...], said: str, times: int
) -> None:
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(JOB))
    code, shown, errors = main(words[0], "job.yaml", *words[1:], "--quiet")
    assert (code, (shown + errors).count(said)) == (1, times)

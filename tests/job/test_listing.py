"""Sections of a job as lines to read."""

from parcontact.job import Stage
from parcontact.job.sections import listing


def test_words_have_no_unit() -> None:
    """A stage that chooses its steps says auto, and not auto s."""
    line = listing.line(Stage.model_validate({"pressure": 1.0e5, "duration": 1.0}))
    assert line.endswith("duration 1 s, time_step auto")
    line = listing.line(Stage.model_validate({"pressure": 1.0e5, "duration": 1.0, "time_step": 0.5}))
    assert line.endswith("time_step 0.5 s")

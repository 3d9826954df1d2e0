"""A job as lines to read, and as a file to run again."""

from pathlib import Path

from parcontact.job import Stage
from parcontact.job.sections import listing

from .texts import SMALL, job_of


def test_words_have_no_unit() -> None:
    """A stage that chooses its steps says auto, and not auto s."""
    line = listing.line(Stage.model_validate({"pressure": 1.0e5, "duration": 1.0}))
    assert line.endswith("duration 1 s, time_step auto")
    line = listing.line(Stage.model_validate({"pressure": 1.0e5, "duration": 1.0, "time_step": 0.5}))
    assert line.endswith("time_step 0.5 s")


def test_a_resolved_job_keeps_what_is_given(tmp_path: Path) -> None:
    """Values chosen by the accuracy are a comment, and chosen again; equal values that are given make another job."""
    chosen, given = (job_of(tmp_path, SMALL, *words) for words in ((), ("numerics.tolerance=5e-3",)))
    assert chosen.resolved().endswith("# chosen by numerics.accuracy: tolerance 0.005, branch_error 0.001\n")
    assert chosen != given
    for job, names in ((chosen, {"tolerance", "branch_error"}), (given, {"branch_error"})):
        again = job_of(tmp_path, job.resolved(), name="job.resolved.yaml")
        assert set(again.numerics.chosen) == names
        assert again.numerics.tolerance == 5e-3

"""The arithmetic of the error budget: sums over steps, and what judges its constants."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from parcontact.march import budget, time_error
from parcontact.march.budget import ErrorSums, estimate
from parcontact.march.time_error import RunProperties, StepObservation

ROOT = Path(__file__).resolve().parents[2]
KNOWN = RunProperties(10_000, cells_per_wave=8.0, folded=1e-4)
SEEN = StepObservation(1e-3, 0.02, 0.1, 0.095, slope=0.02, difference=4e-4)


def test_fitted_constants_of_the_budget_name_what_judges_them() -> None:
    """A script or a test that exists; a script also names the constant."""
    stated = vars(time_error) | vars(budget)
    fits = {name: fit.found_by for name, fit in stated.items() if isinstance(fit, time_error.Fit)}
    assert fits
    for name, found_by in fits.items():
        text = (ROOT / found_by).read_text()
        assert found_by.startswith("tests") or re.search(rf"\b{name}\b", text), name


def test_all_other_fitted_constants_name_what_judges_them() -> None:
    """In the comment, or in the comment above, by a path that exists."""
    paths = (ROOT / "parcontact").rglob("*.py")
    fitted = [line for path in paths for line in path.read_text().splitlines() if re.search(r"# fitted\b", line)]
    assert fitted
    for line in fitted:
        named = re.search(r"(?:scripts|tests)/[\w/]+\.py", line)
        assert named, line
        assert (ROOT / named[0]).exists(), line


def test_summary() -> None:
    """Without a slide means over time, of friction in proportion to it; in sentences."""
    slower = replace(SEEN, complementarity=3e-3, slope=0.01, friction=0.01)
    seen = SEEN, slower, replace(SEEN, friction=0.0, corrected=0.1)
    first, second, third = (estimate(KNOWN, each) for each in seen)
    summary = ErrorSums().plus(first, 0.02, 3.0).plus(second, 0.01, 2.0).plus(third, 0.0, 1.0)
    assert first.friction is not None
    assert second.friction is not None
    assert summary.friction is not None
    assert summary.area is not None
    mean = (0.06 * first.friction.solver + 0.02 * second.friction.solver) / 0.08
    assert summary.friction.solver == pytest.approx(mean)
    mean = (3 * first.area.solver + 2 * second.area.solver + third.area.solver) / 6
    assert summary.area.solver == pytest.approx(mean)
    friction, area = summary.lines((0.012, 0.010))
    assert friction.startswith("estimated error of friction: ")
    assert "solver 0.078 %" in friction
    assert "try" not in friction
    assert area.startswith("estimated error of the corrected contact area: ")
    assert area.endswith("; more than the 1 % that numerics.accuracy asks for: try a finer grid")
    assert ErrorSums().lines((0.012, 0.012)) == []
    assert ", mean over time; more than the" in area
    assert summary.lines((0.012, 0.010), ["mesh"])[1].endswith(": try a smaller numerics.accuracy")


def test_a_rest_does_not_dilute_what_a_slide_says() -> None:
    """A slide of 1 mm, then an hour at rest under other errors: the slide's, but for nothing."""
    summary, slide = ErrorSums(), estimate(KNOWN, SEEN)
    rest = estimate(KNOWN, StepObservation(5e-2, 0.01, 0.1, 0.05, slope=0.02, difference=0.1))
    summary = summary.plus(rest, 0.0, 1e-3)
    summary = summary.plus(slide, 0.02, 1e-2, slid=1e-3)
    summary = summary.plus(rest, 0.01, 3600.0)
    assert summary.friction is not None
    assert summary.area is not None
    assert slide.friction is not None
    assert summary.friction == pytest.approx(slide.friction, rel=1e-12)
    assert summary.area == pytest.approx(slide.area, rel=1e-12)
    assert all(", mean over the distance slid" in line for line in summary.lines((0.012, 0.010)))


def test_steps_that_last_no_time_count_where_none_does() -> None:
    """Three loads without duration: their mean; next to a step that lasts they do not count."""
    stills = [StepObservation(error, 0.0, 0.1, 0.1) for error in (1e-3, 2e-3, 6e-3, 8e-3)]
    *loads, lasting = (estimate(KNOWN, still) for still in stills)
    summary = ErrorSums()
    for of_load in loads:
        summary = summary.plus(of_load, 0.0, 0.0)
    assert summary.friction is None
    assert summary.area is not None
    assert summary.area.solver == pytest.approx(sum(budget.area.solver for budget in loads) / 3.0)
    area = summary.plus(lasting, 0.0, 1e-9).area
    assert area is not None
    assert area.solver == pytest.approx(lasting.area.solver)

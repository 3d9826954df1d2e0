"""What is said of an error and the accuracy that was asked for."""

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from parcontact.files.recorder import StepRow
from parcontact.files.tables import Wanted
from parcontact.job import Job
from parcontact.march.budget import ErrorBudget, ErrorParts, ErrorSums, advice
from parcontact.march.curve import EarlierPoint, describe_missed
from parcontact.results import page


def test_an_error_that_is_printed_like_its_limit_is_within_it() -> None:
    """Three digits are printed: 1.004 % of 1 % is no miss, 1.02 % is one."""
    reported = [advice(ErrorParts(solver=error, time=0.0, folded=0.0, mesh=0.0), 0.01) for error in (0.01004, 0.0102)]
    assert reported[0] == "; within the 1 % that numerics.accuracy asks for"
    assert reported[1] == "; more than the 1 % that numerics.accuracy asks for: try a smaller numerics.tolerance"


@pytest.mark.parametrize(("numerics", "key"), [({}, "accuracy"), ({"tolerance": 1e-2}, "tolerance")])
def test_a_curve_advises_the_key_that_was_given(numerics: dict[str, Any], key: str) -> None:
    """The accuracy, where it has chosen the tolerance of the solver."""
    data = {
        "grid": {"points": 16, "size": 1e-3},
        "surface": {"shape": "flat"},
        "material": {"model": "elastic", "shear_modulus": 1e6},
        "steady": {"velocities": [1.0], "pressures": [1e4]},
        "numerics": {"accuracy": 0.05, **numerics},
    }
    errors = ErrorBudget(None, ErrorParts(solver=0.06, time=0.0, folded=0.0, mesh=0.01))
    point: Any = SimpleNamespace(errors=errors, speed=1.0, pressure=1e4, temperature=math.nan)
    (reported,) = describe_missed([point], Job.model_validate(data))
    assert str(reported).endswith(f"try a smaller numerics.{key}")


def test_a_curve_that_goes_on_counts_earlier_points() -> None:
    """With those of now, whose parts are known; and alone, where no point of now is wrong."""
    data = {
        "grid": {"points": 16, "size": 1e-3},
        "surface": {"shape": "flat"},
        "material": {"model": "elastic", "shear_modulus": 1e6},
        "steady": {"velocities": [1.0], "pressures": [1e4]},
        "numerics": {"accuracy": 0.05},
    }
    job, earlier = Job.model_validate(data), [EarlierPoint(Wanted(2.0, 1e4), (0.1, 0.2))]
    for solver, reported in ((0.06, ["10 %, at 2 m/s", "7 % ("]), (0.01, ["10 %, at 2 m/s", "20 %, at 2 m/s"])):
        errors = ErrorBudget(None, ErrorParts(solver=solver, time=0.0, folded=0.0, mesh=0.01))
        point: Any = SimpleNamespace(errors=errors, speed=1.0, pressure=1e4, temperature=math.nan)
        of_friction, of_area = map(str, describe_missed([point], job, earlier))
        assert f"friction at 1 of {1 + 1} points: up to {reported[0]}" in of_friction
        assert f"area at {1 + (solver > 0.05)} of 2 points: up to {reported[1]}" in of_area


@pytest.mark.parametrize(("mesh", "stated"), [(0.3, 0.31), (0.75, 1.0), (6.0, 6.01)])
def test_friction_of_which_most_may_be_error_is_unknown(mesh: float, stated: float, tmp_path: Path) -> None:
    """Of two of 120 random scenes it was six times as wrong as itself, where 0.76 was stated: 1 or more is, in tables,
    in facts and in sentences, from which reports read it; the area and the parts stay as they are."""
    parts = ErrorParts(solver=0.01, time=0.0, folded=0.0, mesh=mesh)
    budget = ErrorBudget(parts, parts)
    assert StepRow(0, 0.0, 0.0, errors=budget).error_friction == pytest.approx(stated)
    assert StepRow(0, 0.0, 0.0, errors=budget).error_area == pytest.approx(0.01 + mesh)
    sums = ErrorSums().plus(budget, 0.1, 1.0)
    assert sums.facts(0.01)["friction"]["total"] == pytest.approx(stated)
    friction, area, *further = sums.lines((0.01, 0.01))
    assert (" or more (solver 1 %, mesh" in friction) == bool(further) == (stated >= 1.0)
    assert "or more" not in area
    (tmp_path / "run.log").write_text(f"{friction}\n{area}\n")
    assert page.read_logs(tmp_path).estimates == [friction, area]

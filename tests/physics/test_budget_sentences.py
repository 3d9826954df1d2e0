"""What is said of an error and the accuracy that was asked for."""

import math
from types import SimpleNamespace
from typing import Any

import pytest

from parcontact.job import Job
from parcontact.physics.budget import ErrorBudget, Parts, advice
from parcontact.steady_sliding.table import describe_missed


def test_an_error_that_is_printed_like_its_limit_is_within_it() -> None:
    """Three digits are printed: 1.004 % of 1 % is no miss, 1.02 % is one."""
    told = [advice(Parts(solver=error, time=0.0, folded=0.0, mesh=0.0), 0.01) for error in (0.01004, 0.0102)]
    assert told[0] == "; within the 1 % that numerics.accuracy asks for"
    assert told[1] == "; more than the 1 % that numerics.accuracy asks for: try a smaller numerics.tolerance"


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
    errors = ErrorBudget(None, Parts(solver=0.06, time=0.0, folded=0.0, mesh=0.01))
    point: Any = SimpleNamespace(errors=errors, speed=1.0, pressure=1e4, temperature=math.nan)
    (told,) = describe_missed([point], Job.model_validate(data))
    assert told.endswith(f"try a smaller numerics.{key}")

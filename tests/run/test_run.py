"""What a run advises where it is more wrong than asked for."""

from typing import Any

import pytest

from parcontact.job import Job
from parcontact.run.run import chosen_by_accuracy


@pytest.mark.parametrize(
    ("slide", "numerics", "parts"),
    [
        ({}, {}, {"solver", "time", "folded"}),
        ({"cells_per_step": 1}, {}, {"solver", "folded"}),
        ({}, {"accuracy": 0.03, "tolerance": 1e-4}, {"time", "folded"}),
        ({}, {"tolerance": 1e-4, "branch_error": 0.0}, {"time"}),
        ({}, {"tolerance": 5e-3, "branch_error": 1e-3}, {"time"}),  # given, though they are what would be chosen
    ],
)
def test_what_a_smaller_accuracy_would_help(slide: dict[str, Any], numerics: dict[str, Any], parts: set[str]) -> None:
    """The settings that it has chosen; steps are those of the slide, whatever a press has."""
    data = {
        "grid": {"points": 16, "size": 1e-3},
        "surface": {"shape": "flat"},
        "material": {"model": "elastic", "shear_modulus": 1e6},
        "history": [
            {"pressure": 1e4, "duration": 1e-3, "time_step": 1e-4},
            {"pressure": 1e4, "velocity": 0.1, "distance": 1e-4, **slide},
        ],
        "numerics": numerics,
    }
    assert chosen_by_accuracy(Job.model_validate(data)) == parts

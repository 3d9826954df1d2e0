"""`parcontact check` names the distance of heat that a job does not give."""

from typing import Any

from parcontact.job import Job

HEAT = {"conductivity": 0.2, "diffusivity": 1e-7}


def facts(**thermal: Any) -> tuple[str, ...]:
    data = {
        "grid": {"points": [32, 4], "size": [1e-3, 1e-4]},
        "surface": {"shape": "flat"},
        "material": {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 4e6, "relaxation_time": 1e-4}]},
        "steady": {"velocities": [1.0], "pressures": [1e5]},
        "thermal": {**HEAT, **thermal},
    }
    return Job.model_validate(data).facts


def test_the_distance_that_is_not_given_is_told() -> None:
    """The longer side of the box; no word where it is given."""
    assert facts(distance=0.1) == ()
    (told,) = facts()
    assert "the rubber has slid 0.001 m, the longer side of the box" in told

"""What is told of a random surface as one sample, and of a slide that comes round its box."""

from typing import Any

import pytest

from parcontact.job import Job
from parcontact.job.checks.advice import describe_sample

ROUGH = {"shape": "rough", "hurst": 0.8, "long_wavelength": 2.5e-4, "short_wavelength": 6.25e-5, "rms_slope": 0.1}
WAVE = {"shape": "wave", "amplitude": 1e-6, "waves": [4, 0]}
RUBBER = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-2}]}
ROUND = {"pressure": 1e4, "velocity": 0.1, "distance": 9.5e-4, "cells_per_step": 1}


def sample(slides: bool = True, **changes: Any) -> str:
    found = job(**changes)
    return describe_sample(found.grid, found.surface, slides)


def job(slide: dict[str, Any] = ROUND, **changes: Any) -> Job:
    data = {"grid": {"points": 128, "size": 1e-3}, "surface": ROUGH, "material": RUBBER, "history": [slide]}
    return Job.model_validate(data | changes)


@pytest.mark.parametrize(
    ("grid", "shares"),
    [
        ({"points": 128, "size": 1e-3}, ("6 %", "4.2 %", "4 x 4")),
        ({"points": [256, 128], "size": [2e-3, 1e-3]}, ("4.2 %", "3 %", "8 x 4")),
        ({"points": [1024, 1], "size": [8e-3, 1e-3]}, ("4.2 %", "3 %", "32")),
    ],
)
def test_another_seed(grid: dict[str, Any], shares: tuple[str, str, str]) -> None:
    """It differs by the root of the number of long waves in the box; 1/4 of 24 % and 17 % with 4 x 4."""
    friction, area, waves = shares
    text = sample(grid=grid)
    assert f"friction by about {friction} and the contact area by about {area}" in text
    assert f": {waves} of its longest waves" in text
    assert "friction" not in sample(slides=False, grid=grid)


def test_waves_have_no_seed() -> None:
    assert sample(surface=WAVE) == ""


@pytest.mark.parametrize(
    ("changes", "start"),
    [
        ({}, "0.0009 m of its 0.00095 m"),  # 0.4 of the longest wave before the box is round
        ({"velocity": [0.06, 0.08], "distance": 5.5e-3}, "0.0049 m of its 0.0055 m"),  # 3 boxes along x, 4 along y
        ({"velocity": [0.06, 0.0799], "distance": 5.5e-3}, "0.0049 m"),
    ],
)
def test_a_slide_round_the_box(changes: dict[str, Any], start: str) -> None:
    """The imprint is that of 4 boxes before: told with the distance from which."""
    (text,) = (text for text in job(ROUND | changes).warnings if "imprint" in text)
    assert text.startswith(f"history.0: after {start}")
    assert "remembers for 0.01 s" in text


@pytest.mark.parametrize(
    "changes",
    [
        {"history": [ROUND | {"distance": 8.9e-4}]},
        {"history": [ROUND | {"velocity": [0.06, 0.08], "distance": 4.8e-3}]},
        {"material": RUBBER | {"branches": [{"modulus": 1e6, "relaxation_time": 8e-4}]}},  # it has forgotten
        {"material": {"model": "elastic", "shear_modulus": 1e6}},
        {"grid": {"points": 128, "size": 1e-3, "boundary": "free"}},
        {"surface": WAVE},
        {"surface": ROUGH | {"long_wavelength": 2.5e-3}, "history": [ROUND | {"distance": 5e-4}]},
        {"initial": {"state": "steady", "velocity": 0.1, "pressure": 1e4}},
    ],
)
def test_a_slide_that_meets_no_imprint(changes: dict[str, Any]) -> None:
    assert not [text for text in job(**changes).warnings if "imprint" in text]


def test_stages_of_one_slide_count_together() -> None:
    half = ROUND | {"distance": 4.75e-4}
    (text,) = (text for text in job(history=[half, half | {"pressure": 2e4}]).warnings if "imprint" in text)
    assert text.startswith("history.0: after 0.0009 m of its 0.00095 m")

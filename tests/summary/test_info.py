"""`parcontact info`: what a surface that was pulled has come to, and what it says of friction."""

from pathlib import Path

import pytest
from drawing import SLIDE, WAVE, ZENER, ran

from parcontact.summary import info


def test_the_lowest_load_of_the_way_back_is_the_pull_off() -> None:
    columns = {"pressure": [-4.0, 2.0, -3.0, -1.0], "time": [0.0, 1.0, 2.0, 3.0], "approach": [0.0, 1e-6, -1e-6, -2e-6]}
    assert list(info.describe_pull_off(columns, 0.5)) == ["lowest load: -1.5 N, -3 Pa, at t = 2 s, approach -1 um"]


def test_a_surface_that_is_pressed_has_none() -> None:
    columns = {"pressure": [0.0, 2.0], "time": [0.0, 1.0], "approach": [0.0, 1e-6]}
    assert not list(info.describe_pull_off(columns, 0.5))


@pytest.mark.parametrize(("history", "told"), [(SLIDE, True), ("history: [{pressure: 1.0e3}]\n", False)])
def test_friction_is_told_where_something_slides(tmp_path: Path, history: str, told: bool) -> None:
    said, sound = info.describe(ran(tmp_path, WAVE + ZENER + history))
    assert sound
    assert "last row: pressure 1 kPa, " in said
    assert (", friction " in said) == told

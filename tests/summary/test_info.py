"""`parcontact info`: what it says of friction."""

from pathlib import Path

import pytest
from drawing import SLIDE, WAVE, ZENER, ran

from parcontact.summary import info


@pytest.mark.parametrize(("history", "told"), [(SLIDE, True), ("history: [{pressure: 1.0e3}]\n", False)])
def test_friction_is_told_where_something_slides(tmp_path: Path, history: str, told: bool) -> None:
    said, sound = info.describe(ran(tmp_path, WAVE + ZENER + history))
    assert sound
    assert "last row: pressure 1 kPa, " in said
    assert (", friction " in said) == told

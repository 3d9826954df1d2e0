"""Sections of effects, as a job's own keys."""

from pathlib import Path

import pytest

from parcontact.errors import InputError
from parcontact.job import added_sections

from .texts import SMALL, job_of


@pytest.mark.parametrize("section", added_sections.names())
def test_an_empty_section_of_an_effect_is_an_absent_one(tmp_path: Path, section: str) -> None:
    assert job_of(tmp_path, SMALL + f"{section}:\n") == job_of(tmp_path, SMALL)
    with pytest.raises(InputError, match=f"zzzzzz is not a known key; there are .*\\b{section}\\b"):
        job_of(tmp_path, SMALL + "zzzzzz: 1\n")

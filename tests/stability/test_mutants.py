"""The changes that scripts/mutants.py makes are still changes of what the code says."""

from typing import Any

import pytest
from marching import ROOT, load_script

MUTANTS = load_script("mutants").MUTANTS


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_what_is_changed_stands_there_once(mutant: Any) -> None:
    text = (ROOT / "parcontact" / mutant.file).read_text()
    assert text.count(mutant.old) == 1

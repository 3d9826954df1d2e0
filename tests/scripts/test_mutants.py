"""scripts/mutants.py finds something to break in each of its parts, and its parts and their tests are there."""

import ast
import random

import pytest
from marching import ROOT, load_script

MUTANTS = load_script("mutants")


@pytest.mark.parametrize("part", MUTANTS.PARTS)
def test_a_part_can_be_broken_in_many_places(part: str) -> None:
    text = (ROOT / "parcontact" / part).read_text()
    assert len(list(MUTANTS.changes(ast.parse(text)))) >= 8
    what, changed = MUTANTS.draw(part, random.Random(0))
    assert what
    assert ast.dump(ast.parse(changed)) != ast.dump(ast.parse(text))
    assert all((ROOT / name).exists() for name in MUTANTS.PARTS[part])

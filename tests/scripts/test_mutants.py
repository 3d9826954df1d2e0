"""scripts/mutants.py finds files with tests of their own, and something to break in each of them."""

import ast
import random

import pytest
from marching import ROOT, load_script

MUTANTS = load_script("mutants")
PARTS = MUTANTS.parts()


def test_enough_is_broken() -> None:
    """Most of what computes has tests of its own name, and the scenarios that are named are there."""
    assert len(PARTS) >= 20
    assert set(MUTANTS.OTHERS) <= set(PARTS)
    assert all((ROOT / name).exists() for part in PARTS for name in MUTANTS.tests_of(part))


@pytest.mark.parametrize("part", PARTS)
def test_a_part_can_be_broken(part: str) -> None:
    text = (ROOT / "parcontact" / part).read_text()
    what, changed = MUTANTS.draw(part, random.Random(0))
    assert what
    assert ast.dump(ast.parse(changed)) != ast.dump(ast.parse(text))

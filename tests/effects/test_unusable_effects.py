"""Effects of users that cannot be used: a sentence, nothing written, and all that does not need them works."""

import json
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import short_job
import yaml
from conftest import WORLD, Main

from parcontact.effects.effect import touching_of
from parcontact.job.reading import load

from .tread_wear import forget, install, shown

pytestmark = pytest.mark.skipif(WORLD.size > 1, reason="for one process")

JOB = {**short_job.JOB, "wear": {"coefficient": 1e-12}}
BAD_INPUT = 2
MEMBER = 'section, columns = WearSection, ("wear_depth",)'
CHANGES = {
    "a value too many": ("return memory[1:]", "return 1.0, 2.0", r"number for each of its columns \(wear_depth\)"),
    "no value": ("return memory[1:]", "return None", r"number for each of its columns \(wear_depth\), got None"),
    "words": ("return memory[1:]", "return ['deep']", "number for each of its columns"),
    "a column of ours": (MEMBER, MEMBER.replace("wear_depth", "friction"), "has a column friction: its effect must"),
    "a comma": (MEMBER, MEMBER.replace("wear_depth", "a,b"), "its columns must be a tuple of different names"),
    "no columns": (MEMBER, "section = WearSection", "has no attribute 'columns'"),
    "no section": (MEMBER, "columns = ()", "has no attribute 'section'"),
    "an exit": ("import numpy as np", "raise SystemExit(0)", "which cannot be used: SystemExit: 0"),
    "no Python": ("import numpy as np", "import import", "which cannot be used: SyntaxError"),
}


@pytest.fixture
def changed(main: Main, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str, str], None]]:
    """Install the manual's effect with a change, next to two jobs of which one asks for it."""
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(JOB))
    (tmp_path / "plain.yaml").write_text(yaml.safe_dump({key: JOB[key] for key in JOB if key != "wear"}))
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def change(old: str, new: str) -> None:
        assert old in shown()
        install(tmp_path, shown().replace(old, new))
        forget()

    yield change
    forget()


@pytest.mark.parametrize("name", CHANGES)
def test_refused_where_a_job_asks_for_it(
    main: Main, changed: Callable[[str, str], None], tmp_path: Path, name: str
) -> None:
    old, new, reason = CHANGES[name]
    changed(old, new)
    before = set(tmp_path.rglob("*"))
    code, _, said = main("job.yaml", "--quiet", "--out", "out")
    assert code == BAD_INPUT
    assert re.search(reason, said), said
    assert len(said.splitlines()) == 1
    assert set(tmp_path.rglob("*")) == before


def test_the_rest_works_without_it(main: Main, changed: Callable[[str, str], None]) -> None:
    changed("import numpy as np", "import import")
    assert main("plain.yaml", "--quiet", "--out", "out")[0] == 0
    assert main("plan", "plain.yaml", "--seconds", "0.01", "--ranks", "1")[0] == 0
    code, shown, said = main("schema")
    assert code == 0
    assert "interface" in json.loads(shown)["properties"]
    assert "wear" not in json.loads(shown)["properties"]
    assert re.fullmatch(r"warning: wear .*cannot be used: SyntaxError.*; the schema does not include it\n", said)


def test_a_section_without_a_schema(main: Main, changed: Callable[[str, str], None]) -> None:
    """Its keys are of a class of somebody's own, of which JSON has none: the sentence names the effect."""
    key = next(line for line in shown().splitlines() if line.strip().startswith("coefficient: "))
    changed(key, "    model_config = {'arbitrary_types_allowed': True}\n    coefficient: np.ndarray")
    code, printed, said = main("schema")
    assert code == 0
    assert json.loads(printed)["properties"].keys() & {"wear", "interface"} == {"interface"}
    assert said.startswith("warning: the effect wear (tread_wear:Wear) has no JSON schema: PydanticInvalidFor")
    assert said.endswith("; the schema does not include it\n")
    assert said.count("\n") == 1


FAILURES = {
    "in a step": ("def follow(self, instant", "ZeroDivisionError: division by zero"),
    "to end the program": ("def values(self, memory", "SystemExit: 0"),
    "in its decision": ("def decide(job", "ZeroDivisionError: division by zero"),
}


@pytest.mark.parametrize("name", FAILURES)
def test_what_fails_in_a_run_names_the_effect(main: Main, changed: Callable[[str, str], None], name: str) -> None:
    """In one sentence and with the code of a failure, whatever it raises."""
    start, reason = FAILURES[name]
    line = next(line for line in shown().splitlines() if start in line)
    raising = "raise SystemExit(0)" if "SystemExit" in reason else "1 / 0"
    changed(line, f"{line}\n        {raising}")
    code, _, said = main("job.yaml", "--quiet", "--out", "out")
    assert code == 1
    assert said.count("\n") == 1
    assert f"the effect wear (tread_wear:Wear) has failed: {reason}" in said
    assert main("plan", "plain.yaml", "--seconds", "0.01", "--ranks", "1")[0] == 0, "it is not asked for there"


def test_maps_are_read_only(main: Main, changed: Callable[[str, str], None]) -> None:
    line = next(line for line in shown().splitlines() if "def follow(self, instant" in line)
    changed(line, f"{line}\n        instant.pressure[...] = 0.0")
    code, _, said = main("job.yaml", "--quiet", "--out", "out")
    assert code == 1
    assert "the effect wear (tread_wear:Wear) has failed: ValueError: assignment destination is read-only" in said


def test_steady_sliding_has_no_law_of_an_effect(main: Main, changed: Callable[[str, str], None]) -> None:
    """Its solver has the usual one, and would leave out what the effect brings."""
    changed("    def follow(", "    def law(self):\n        return None\n\n    def follow(")
    code, _, said = main("check", "job.yaml", "--set", "steady={velocities: [0.1], pressures: [1e5]}")
    assert code == BAD_INPUT
    assert "steady cannot be used with wear: steady sliding is solved without its contact law" in said
    assert main("check", "job.yaml")[0] == 0


def test_a_law_of_an_effect_says_where_saved_maps_touch(
    main: Main, changed: Callable[[str, str], None], tmp_path: Path
) -> None:
    """Pictures and `leak` read maps of the pressure and of the gap, without a scene."""
    touches = "    @staticmethod\n    def touches(job, pressure, gap):\n        return pressure > 2.0\n\n"
    changed("    def follow(", touches + "    def follow(")
    pressure = np.array([[1.0, 2.0, 3.0]])
    for name, expected in (("job.yaml", [False, False, True]), ("plain.yaml", [True, True, True])):
        assert touching_of(load(tmp_path / name), pressure, 0.0 * pressure)[0].astype(bool).tolist() == expected


def test_a_law_that_fails_is_named(main: Main, changed: Callable[[str, str], None]) -> None:
    law = (
        "    def __init__(self, scene):\n"
        "        self.slab, self.rate, self.scene = scene.slab, 1.0, scene\n\n"
        "    def law(self):\n"
        "        from parcontact.march.laws import DryLaw\n"
        "        class Mine(DryLaw):\n"
        "            def solve(self, *given):\n"
        "                return {}['x']\n"
        "        return Mine(self.scene)\n\n"
    )
    changed("    def follow(", law + "    def follow(")
    code, _, said = main("job.yaml", "--quiet", "--out", "out")
    assert code == 1
    assert re.search(r"the effect wear \(tread_wear:Wear\) has failed: KeyError: 'x'", said), said
    assert "Traceback" not in said

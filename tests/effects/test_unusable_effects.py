"""Effects of users that cannot be used: a sentence, nothing written, and all that does not need them works."""

import json
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from conftest import WORLD, Main

from parcontact.job import added_sections, model
from parcontact.manual import texts

pytestmark = pytest.mark.skipif(WORLD.size > 1, reason="for one process")

JOB: dict[str, Any] = {
    "grid": {"points": 16, "size": 1e-3},
    "surface": {"shape": "wave", "amplitude": 1e-6, "waves": [2, 1]},
    "material": {"model": "elastic", "shear_modulus": 1e6},
    "history": [{"pressure": 1e4}],
    "wear": {"coefficient": 1e-12},
}
BAD_INPUT = 2
MEMBER = 'section, columns = WearSection, ("wear_depth",)'
CHANGES = {
    "a value too many": ("return (self.deepest,)", "return 1.0, 2.0", r"number for each of its columns \(wear_depth\)"),
    "no value": ("return (self.deepest,)", "return None", r"number for each of its columns \(wear_depth\), got None"),
    "words": ("return (self.deepest,)", "return ['deep']", "number for each of its columns"),
    "a column of ours": (MEMBER, MEMBER.replace("wear_depth", "friction"), "has a column friction: an effect must"),
    "a comma": (MEMBER, MEMBER.replace("wear_depth", "a,b"), "its columns must be a tuple of different names"),
    "no columns": (MEMBER, "section = WearSection", "has no attribute 'columns'"),
    "no section": (MEMBER, "columns = ()", "has no attribute 'section'"),
    "an exit": ("import numpy as np", "raise SystemExit(0)", "which cannot be used: SystemExit: 0"),
    "no Python": ("import numpy as np", "import import", "which cannot be used: SyntaxError"),
}


def forget() -> None:
    for found in (added_sections._registered, added_sections._load, added_sections.why_unusable, model.extended):
        found.cache_clear()
    sys.modules.pop("tread_wear", None)


@pytest.fixture
def install(main: Main, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str, str], None]]:
    """Install the manual's effect with a change, beside two jobs of which one asks for it."""
    package = tmp_path / "tread_wear-1.0.dist-info"
    package.mkdir()
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: tread-wear\nVersion: 1.0\n")
    (package / "entry_points.txt").write_text("[parcontact.effects]\nwear = tread_wear:Wear\n")
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(JOB))
    (tmp_path / "plain.yaml").write_text(yaml.safe_dump({key: JOB[key] for key in JOB if key != "wear"}))
    shown = re.findall(r"```python\n(# tread_wear.py\n.*?)```", texts.page("effects"), re.S)[0]
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def change(old: str, new: str) -> None:
        assert old in shown
        (tmp_path / "tread_wear.py").write_text(shown.replace(old, new))
        forget()

    yield change
    forget()


@pytest.mark.parametrize("name", CHANGES)
def test_refused_where_a_job_asks_for_it(
    main: Main, install: Callable[[str, str], None], tmp_path: Path, name: str
) -> None:
    old, new, reason = CHANGES[name]
    install(old, new)
    before = set(tmp_path.rglob("*"))
    code, _, said = main("job.yaml", "--quiet", "--out", "out")
    assert code == BAD_INPUT
    assert re.search(reason, said), said
    assert len(said.splitlines()) == 1
    assert set(tmp_path.rglob("*")) == before


def test_the_rest_works_without_it(main: Main, install: Callable[[str, str], None]) -> None:
    install("import numpy as np", "import import")
    assert main("plain.yaml", "--quiet", "--out", "out")[0] == 0
    assert main("plan", "plain.yaml", "--seconds", "0.01", "--ranks", "1")[0] == 0
    code, shown, said = main("schema")
    assert code == 0
    assert "interface" in json.loads(shown)["properties"]
    assert "wear" not in json.loads(shown)["properties"]
    assert re.fullmatch(r"warning: wear .*cannot be used: SyntaxError.*; the schema is without it\n", said)

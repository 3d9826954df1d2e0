"""The page on the architecture names what there is."""

import importlib
import re
from pathlib import Path

import pytest
from marched_jobs import ROOT

import parcontact
from parcontact.door import manual_texts

HOUSE = Path(parcontact.__file__).parent
ROOMS = {path.stem for path in HOUSE.iterdir() if not path.name.startswith("__")} | {"__main__"}
QUOTED = set(re.findall(r"`([^`\n]+)`", manual_texts.page("architecture")))
NAMES = sorted(name for name in QUOTED if re.fullmatch(r"[\w.]+", name) and name.split(".")[0] in ROOMS and "." in name)
FILES = sorted(name for name in QUOTED if re.fullmatch(r"[\w/]+(/|\.py|\.yaml|\.md)", name))
METHODS = ("begin", "commit", "displacement", "entries", "restored", "at_rest", "start_from")


def test_names_are_found() -> None:
    assert len(NAMES) > 40
    assert len(FILES) > 8


@pytest.mark.parametrize("name", NAMES)
def test_a_name(name: str) -> None:
    parts = name.split(".")
    module = next(".".join(parts[:end]) for end in range(len(parts), 0, -1) if is_module(parts[:end]))
    found = importlib.import_module(f"parcontact.{module}")
    for part in parts[module.count(".") + 1 :]:
        found = getattr(found, part)


def is_module(parts: list[str]) -> bool:
    path = HOUSE.joinpath(*parts)
    return path.with_suffix(".py").is_file() or path.is_dir()


@pytest.mark.parametrize("name", FILES)
def test_a_file(name: str) -> None:
    assert (ROOT / name).exists() or (HOUSE / name).exists()


def test_methods_of_a_body() -> None:
    from parcontact.physics.body import ElasticBody

    assert all(f"`{name}`" in manual_texts.page("architecture") and hasattr(ElasticBody, name) for name in METHODS)

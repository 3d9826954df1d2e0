"""Reference of every key of a job: generated from the types, each with its meaning and an example."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from ..job import schema
from ..job.schema import Key, SectionSchema
from ..job.sections.part import kind_key

MEANINGS = Path(__file__).parent / "keys.yaml"


@cache
def meanings() -> dict[str, dict[str, Any]]:
    """Return `[meaning, example]` by the names of the parts, then of their keys."""
    found: dict[str, dict[str, Any]] = yaml.safe_load(MEANINGS.read_text(encoding="utf-8"))
    return found


def keys() -> str:
    """All sections of a job and their keys, as Markdown."""
    return "\n".join(line for section in schema.sections() for line in _section(section))


def heading(section: SectionSchema) -> str:
    """Return the name of a section: its place in a job, and its kind where there are several."""
    kind = kind_key(section.part)
    named = f"{kind}: {section.part.model_fields[kind].default}" if kind else ""
    more = section.part.label.removeprefix(named.replace(":", "")).strip()
    detail = f" {more}" if named and more else f": {more}" if more not in ("", section.place) else ""
    place = f"`{section.place}`, `{named}`" if named else f"`{section.place}`"
    return f"{place}{detail}" if section.place else "The sections of a job"


def _section(section: SectionSchema) -> Iterator[str]:
    yield f"\n## {heading(section)}\n"
    yield f"{' '.join((section.part.__doc__ or '').split())}\n"
    for word in section.part.one_of:
        yield f"Exactly one of {_words(word)} is given.\n"
    for word in section.part.at_most_one:
        yield f"At most one of {_words(word)} is given.\n"
    known = meanings().get(section.part.__name__, {})
    for key in section.keys:
        yield from _key(key, *known.get(key.word, ("", "")))


def _key(key: Key, meaning: str, example: str) -> Iterator[str]:
    facts = [f"must be {key.must_be}"]
    facts += [f"range: {key.within}"] if key.within else []
    facts += [f"unit: {key.unit}"] if key.unit not in ("", "-") else []
    facts.append("required" if key.required else f"default: `{key.default}`" if key.default else "optional")
    yield f"`{key.word}`\n: {meaning} *{_capital('; '.join(facts))}.*"
    yield f"  Example: `{key.word}: {example}`\n" if example != "" else ""


def _words(words: tuple[str, ...]) -> str:
    return ", ".join(f"`{word}`" for word in words)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]

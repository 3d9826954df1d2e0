"""Facts about every key of a job, from the types of its sections, for the manual."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, get_args

from . import added_sections
from .model import Job
from .schema import SchemaOfKeys
from .sections.part import Part, kind_key, literal_words
from .sections.quantities import LARGEST, MOST
from .text.fault import choices

BOUNDS = {
    "exclusiveMinimum": "above {:g}",
    "minimum": "{:g} or more",
    "exclusiveMaximum": "below {:g}",
    "maximum": "at most {:g}",
}


@dataclass(frozen=True)
class Key:
    """One key of a section: what it must be, with its unit, the range of its numbers and its default, '' for none."""

    word: str
    must_be: str
    unit: str
    within: str
    default: str
    required: bool


@dataclass(frozen=True)
class Section:
    """A part of a job, where it stands in it ('surface', 'material.branches'), and its keys."""

    place: str
    part: type[Part]
    keys: tuple[Key, ...]


def sections() -> list[Section]:
    """Return every part of a job, in the order of the job, with those of the effects of this package."""
    found: dict[type[Part], Section] = {Job: Section("", Job, tuple(_keys(Job)))}
    for name, field in Job.model_fields.items():
        _collect(name, field, found)
    for name, effect in added_sections.effects_of(added_sections.OURS).items():
        _collect(name, effect.section, found)
    return list(found.values())


def _parts_of(annotation: Any) -> Iterator[type[Part]]:
    """Yield the parts that an annotation or a field names, in their order."""
    kind = getattr(annotation, "annotation", annotation)
    if isinstance(kind, type) and issubclass(kind, Part):
        yield kind
    for inner in get_args(kind):
        yield from _parts_of(inner)


def _collect(place: str, annotation: Any, found: dict[type[Part], Section]) -> None:
    for part in _parts_of(annotation):
        if part not in found:
            found[part] = Section(place, part, tuple(_keys(part)))
            for name, field in part.model_fields.items():
                _collect(f"{place}.{name}", field, found)


def _keys(part: type[Part]) -> Iterator[Key]:
    found = part.model_json_schema(schema_generator=SchemaOfKeys)
    for word, schema in found["properties"].items():
        words = literal_words(part.model_fields[word].annotation)
        text = schema.get("description") or (choices(words) if words else "a mapping of the keys below")
        units = [unit for unit in re.findall(r"\[([^\]]+)\]", text) if "," not in unit]
        needed = word in found.get("required", ()) or word == kind_key(part)
        bounds = dict(_bounds(schema))
        within = " and ".join(said.format(bounds[name]) for name, said in BOUNDS.items() if name in bounds)
        yield Key(word, text, (units or [""])[-1], within, _text(schema.get("default")), needed)


def _bounds(schema: Any) -> Iterator[tuple[str, float]]:
    """Yield the bounds of the numbers in all forms of a value, without those of all numbers."""
    for name, value in schema.items() if isinstance(schema, dict) else enumerate(schema):
        if name in BOUNDS and abs(value) not in (LARGEST, MOST):
            yield name, value
        elif isinstance(value, dict | list):
            yield from _bounds(value)


def _text(default: Any) -> str:
    if default is None or isinstance(default, dict) or default == []:
        return ""
    if isinstance(default, bool):
        return "true" if default else "false"
    if isinstance(default, list):
        return f"[{', '.join(map(str, default))}]"
    return f"{default:g}" if isinstance(default, float) else str(default)

"""What the types of the sections say of every key of a job: for the manual, and for the schema that editors read."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from . import extension
from .model import Job
from .sections.geometry import Rough
from .sections.part import Part, literal_words
from .text.fault import choices

FILLED: dict[type[Part], tuple[str, ...]] = {Rough: ("rolloff_wavelength",)}  # their defaults depend on other keys
KINDS = ("shape", "model", "law")  # keys that say which kind of part it is
BOUNDS = {"gt": "above {:g}", "ge": "{:g} or more", "lt": "below {:g}", "le": "at most {:g}"}


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
    """Every part of a job, in the order of the job, with those of the effects of this package."""
    found = {"": Section("", Job, tuple(_keys(Job)))}
    for name, field in Job.model_fields.items():
        _collect(name, field.annotation, found)
    for name, effect in extension.effects_of(extension.OURS).items():
        _add(name, effect.section, found)
    return list(found.values())


def parts_of(annotation: Any) -> Iterator[type[Part]]:
    """The parts that an annotation names, in their order."""
    if isinstance(annotation, type) and issubclass(annotation, Part):
        yield annotation
    for inner in get_args(annotation):
        yield from parts_of(inner)


def kind_key(part: type[Part]) -> str:
    """The key that says which kind of part it is, '' for parts of which there is one kind."""
    return next((word for word in KINDS if word in part.model_fields and _is_kind(part.model_fields[word])), "")


def first_sentence(part: type[Part]) -> str:
    """What a part is, by its docstring."""
    text = " ".join((part.__doc__ or "").split())
    return re.split(r"(?<=\.) (?=[A-Z])", text)[0]


def _is_kind(field: FieldInfo) -> bool:
    return get_origin(field.annotation) is Literal and len(get_args(field.annotation)) == 1


def _collect(place: str, annotation: Any, found: dict[str, Section]) -> None:
    for part in parts_of(annotation):
        _add(place, part, found)


def _add(place: str, part: type[Part], found: dict[str, Section]) -> None:
    if any(section.part is part for section in found.values()):
        return
    found[f"{place} {part.__name__}"] = Section(place, part, tuple(_keys(part)))
    for name, field in part.model_fields.items():
        _collect(f"{place}.{field.alias or name}", field.annotation, found)


def _keys(part: type[Part]) -> Iterator[Key]:
    for name, field in part.model_fields.items():
        word = field.alias or name
        words = literal_words(field.annotation)
        text = _description(field) or (choices(words) if words else "a mapping of the keys below")
        filled = word in FILLED.get(part, ())
        units = [unit for unit in re.findall(r"\[([^\]]+)\]", text) if "," not in unit]
        needed = (field.is_required() and not filled) or word == kind_key(part)
        yield Key(word, text, (units or [""])[-1], _within(field), _default(field), needed)


def _description(field: FieldInfo) -> str:
    """What a key must be, also where only the type within its annotation says so."""
    inner = [one for item in get_args(field.annotation) for one in getattr(item, "__metadata__", ())]
    found = [one.description for one in (field, *inner) if isinstance(one, FieldInfo) and one.description]
    return found[0] if found else ""


def _within(field: FieldInfo) -> str:
    """The range of the numbers of a field in words."""
    found = {}
    for limit in limits((field.annotation, *field.metadata)):
        for name, text in BOUNDS.items():
            if (bound := getattr(limit, name, None)) is not None:
                found[name] = text.format(bound)
    return " and ".join(found.values())


def limits(items: Any) -> Iterator[Any]:
    """The bounds among the metadata of a field or within its annotation."""
    for item in items:
        if isinstance(item, FieldInfo):
            yield from limits(item.metadata)
        elif get_args(item):
            yield from limits((*get_args(item), *getattr(item, "__metadata__", ())))
        elif not isinstance(item, type):
            yield item


def _default(field: FieldInfo) -> str:
    default = field.get_default(call_default_factory=True)
    if (
        field.is_required()
        or default is PydanticUndefined
        or default is None
        or isinstance(default, Part)
        or default == ()
    ):
        return ""
    if isinstance(default, bool):
        return "true" if default else "false"
    if isinstance(default, tuple):
        return f"[{', '.join(map(str, default))}]"
    return f"{default:g}" if isinstance(default, float) else str(default)

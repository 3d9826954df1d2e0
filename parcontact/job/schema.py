"""A JSON Schema (draft 2020-12) of job files, for editors, generated from the types of the sections.

It says of each key what the types say: words, numbers and their ranges, which keys exclude each other, defaults. What
needs several sections at once (resolution, files, loads that belong to a grid) only `parcontact check` knows.
"""

from __future__ import annotations

import types
from collections.abc import Callable, Sequence
from itertools import combinations
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BeforeValidator
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from . import extension, keys
from .model import Job
from .sections.height_arrays import Heights
from .sections.materials import Material
from .sections.part import Part
from .sections.stages import Ramp, numbers
from .sections.values import along_x, both, listed

Schema = dict[str, Any]
DRAFT = "https://json-schema.org/draft/2020-12/schema"
RANGE: Schema = {"type": "string", "pattern": "^[^:]+:[^:]+:[0-9]+$", "description": "first:last:count"}
SINGLE: set[Callable[..., Any]] = {both, along_x, listed}  # let one value stand for several
LIMITS = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}


def schema() -> Schema:
    """The schema of a whole job, with the sections of all effects that are installed."""
    found = _object(Job, required=("grid", "surface", "material"))
    for name, effect in extension.find_effects().items():
        found["properties"][name] = _object(effect.section)
    found["properties"]["material"] = {"anyOf": [_included(), found["properties"]["material"]]}
    shapes = found["properties"]["surface"]["items"]
    found["properties"]["surface"] = {"anyOf": [shapes, found["properties"]["surface"]]}
    found["properties"]["sweep"] = _sweep()
    found["anyOf"] = [{"required": ["history"]}, {"required": ["steady"]}]
    return {"$schema": DRAFT, "title": "A job of parcontact", **found}


def _sweep() -> Schema:
    values = {"anyOf": [{"type": "array", "minItems": 1}, RANGE]}
    mapping = {"type": "object", "minProperties": 1, "additionalProperties": values}
    text = "Cases: all combinations of the mappings; the keys within one mapping move together."
    return {"anyOf": [{"type": "array", "items": mapping}, mapping], "description": text}


def _included() -> Schema:
    """A material from a file: any of its keys may be given beside `include`, and replaces that of the file."""
    properties: Schema = {"include": {"type": "string", "description": "Must be the name of a material file."}}
    for kind in keys.parts_of(Material):
        for word, value in _object(kind)["properties"].items():
            properties[word] = True if word in properties else value
    return {"type": "object", "required": ["include"], "properties": properties, "additionalProperties": False}


def _object(part: type[Part], required: Sequence[str] | None = None) -> Schema:
    """The schema of a part, and what its keys ask of each other."""
    fields = {part_field.alias or name: part_field for name, part_field in part.model_fields.items()}
    needed = [word for word, field in fields.items() if _needed(part, word, field)]
    rules: list[Schema] = [{"oneOf": [{"required": [word]} for word in group]} for group in part.one_of]
    rules += [{"not": {"required": list(pair)}} for group in part.at_most_one for pair in combinations(group, 2)]
    found: Schema = {
        "type": "object",
        "description": keys.first_sentence(part),
        "properties": {word: _key(part, word, field) for word, field in fields.items()},
        "additionalProperties": False,
        "required": list(needed if required is None else required),
    }
    if rules:
        found["allOf"] = rules
    return found


def _needed(part: type[Part], word: str, field: FieldInfo) -> bool:
    return (field.is_required() and word not in keys.FILLED.get(part, ())) or word == keys.kind_key(part)


def _key(part: type[Part], word: str, field: FieldInfo) -> Schema:
    if word == keys.kind_key(part):
        return {"const": field.default, "description": f"The kind: {keys.first_sentence(part)}"}
    found = _value(field.annotation, field.metadata)
    if field.description:
        found = {**found, "description": f"Must be {field.description}."}
    default = field.get_default()
    if default is not PydanticUndefined and isinstance(default, bool | int | float | str):
        found["default"] = default
    return found


def _value(annotation: Any, metadata: Sequence[Any] = ()) -> Schema:
    """The schema of what an annotation means, in all forms in which it may be written."""
    if get_origin(annotation) is Annotated:
        inner, *more = get_args(annotation)
        return _value(inner, [*more, *metadata])
    found = _plain(annotation)
    for limit in keys.limits((annotation, *metadata) if get_origin(annotation) is None else metadata):
        for name, word in LIMITS.items():
            if (bound := getattr(limit, name, None)) is not None:
                found[word] = bound
    read = {one.func for one in metadata if isinstance(one, BeforeValidator)}
    if read & {*SINGLE, numbers}:
        words = [{"const": one} for one in metadata if isinstance(one, str)]
        return {"anyOf": [found["items"], found, *([RANGE] if numbers in read else []), *words]}
    return found


def _plain(annotation: Any) -> Schema:
    """Without the other forms in which it may be written."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if annotation in _SIMPLE:
        return dict(_SIMPLE[annotation])
    if origin is Literal:
        return {"enum": list(inner)}
    if origin is tuple:
        return _list(inner)
    if origin in (Union, types.UnionType):
        kinds = [one for one in inner if one is not type(None)]
        return _value(kinds[0]) if len(kinds) == 1 else {"anyOf": [_value(kind) for kind in kinds]}
    if annotation is Ramp:
        ends = {end: {"type": "number"} for end in ("from", "to")}
        ramp = {"type": "object", "properties": ends, "required": list(ends), "additionalProperties": False}
        return {"anyOf": [{"type": "number"}, ramp]}
    if isinstance(annotation, type) and issubclass(annotation, Part):
        return _object(annotation)
    return {}  # anything: what it must be stands in its description


def _list(inner: Sequence[Any]) -> Schema:
    if len(inner) == 2 and inner[1] is Ellipsis:
        return {"type": "array", "items": _value(inner[0])}
    return {"type": "array", "items": _value(inner[0]), "minItems": len(inner), "maxItems": len(inner)}


_SIMPLE: dict[Any, Schema] = {
    bool: {"type": "boolean"},
    int: {"type": "integer"},
    float: {"type": "number"},
    str: {"type": "string"},
    Path: {"type": "string"},
    Heights: {"allOf": [False]},  # nothing that a file could say
}

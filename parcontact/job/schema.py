"""The JSON Schema (draft 2020-12) of job files, for editors, and a table of all keys, from the types of the sections.

The schema has the words, ranges, exclusions and defaults of each key. Rules between sections (resolution, files, loads)
are checked by `parcontact check` only."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, get_args

from pydantic.json_schema import GenerateJsonSchema

from . import listing
from .materials import Dma, Elastic, Zener
from .model import Job, extended_model
from .parts import (
    AUTO,
    FROM_SURFACE,
    LARGEST,
    MOST,
    Part,
    along_x,
    both,
    bounded,
    countable,
    kind_key,
    listed,
    literal_words,
    unit_in,
)
from .reading import materials
from .stages import Stage, expand_range
from .yaml_text import list_words

Schema = dict[str, Any]
DRAFT = "https://json-schema.org/draft/2020-12/schema"
RANGE: Schema = {"type": "string", "pattern": "^[^:]+:[^:]+:[0-9]+$", "description": "first:last:count"}
LIMITS: dict[Any, float] = {bounded: LARGEST, countable: MOST}  # largest magnitude that a validator accepts
BOUNDS = {
    "exclusiveMinimum": "above {:g}",
    "minimum": "{:g} or more",
    "exclusiveMaximum": "below {:g}",
    "maximum": "at most {:g}",
}
SHORT = (both, along_x, listed, expand_range)  # validators that accept one value in place of several


class SchemaOfKeys(GenerateJsonSchema):
    """Pydantic's generator of schemas, extended by the short forms of values."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        """Return False: pydantic would otherwise add a title, the key itself, to each key."""
        return False

    def function_before_schema(self, schema: Any) -> Schema:
        """Return the schema of a list and its short forms: a single value, or a range of numbers."""
        found, function = self.generate_inner(schema["schema"]), schema["function"]["function"]
        if function not in SHORT:
            return found
        array = next(one for one in found.get("anyOf", [found]) if one.get("type") == "array")
        one_value = array["items"] if "items" in array else array["prefixItems"][0]
        words = [FROM_SURFACE, *([AUTO] if one_value.get("type") == "integer" else [])]
        ranges = [RANGE] if function is expand_range else [{"enum": words}] if function is both else []
        return {"anyOf": [one_value, array, *ranges]}

    def function_after_schema(self, schema: Any) -> Schema:
        """Return the schema of a number with its range. A range without a lower or an upper end gets the limits that
        hold for every number in a job."""
        found, most = super().function_after_schema(schema), LIMITS.get(schema["function"]["function"])
        if most is None:
            return found
        low = {} if {"minimum", "exclusiveMinimum"} & found.keys() else {"minimum": -most}
        return {**found, **low, "maximum": most}


def without_schema() -> dict[str, str]:
    """Return, for each section of an effect that has no schema, the reason."""
    reasons = {}
    for name, effect in listing.find_effects().items():
        try:
            effect.section.model_json_schema(schema_generator=SchemaOfKeys)
        except (Exception, SystemExit) as error:  # code of other packages may raise anything
            reasons[name] = f"has no JSON schema: {type(error).__name__}: {str(error).splitlines()[0]}"
    return reasons


def json_schema() -> Schema:
    """Return the schema of a whole job, with the sections of all installed effects that have a schema."""
    kind = extended_model(tuple(name for name in listing.find_effects() if name not in without_schema()))
    found = kind.model_json_schema(schema_generator=SchemaOfKeys)
    properties = found["properties"]
    for name in materials():
        properties[name] = {"anyOf": [_included(found["$defs"]), properties[name]]}
    properties["surface"] = {"anyOf": [properties["surface"]["items"], properties["surface"]]}
    properties["sweep"] = _sweep()
    found["anyOf"] = [{"required": ["history"]}, {"required": ["steady"]}]
    found["required"].remove("grid")
    found["allOf"].append({"anyOf": [{"required": ["grid"]}, {"required": ["bands"]}]})
    return {"$schema": DRAFT, **found, "title": "A job of parcontact"}


def _sweep() -> Schema:
    values = {"anyOf": [{"type": "array", "minItems": 1}, RANGE]}
    mapping = {"type": "object", "minProperties": 1, "additionalProperties": values}
    text = "Cases: all combinations of the mappings; the keys within one mapping move together."
    return {"anyOf": [{"type": "array", "items": mapping}, mapping], "description": text}


def _included(definitions: Schema) -> Schema:
    """Return the schema of an included material: keys other than `include` replace keys of the file."""
    properties: Schema = {"include": {"type": "string", "description": "the name of a material file"}}
    for kind in (Elastic, Zener, Dma):
        for word, value in definitions[kind.__name__]["properties"].items():
            properties[word] = True if word in properties else value
    return {"type": "object", "required": ["include"], "properties": properties, "additionalProperties": False}


# -- facts about every key, for the manual -----------------------------------------------------------------------------


@dataclass(frozen=True)
class Key:
    """A key of a section: a description of its values, and their unit, range and default, each '' if there is none."""

    word: str
    must_be: str
    unit: str
    within: str
    default: str
    required: bool


@dataclass(frozen=True)
class SectionSchema:
    """A part of a job, its place in the job ('surface', 'material.branches'), and its keys."""

    place: str
    part: type[Part]
    keys: tuple[Key, ...]


def sections() -> list[SectionSchema]:
    """Return all parts of a job in the order of the job, including the sections of this package's effects."""
    found: dict[type[Part], SectionSchema] = {Job: SectionSchema("", Job, tuple(_keys(Job)))}
    for name, field in Job.model_fields.items():
        _collect(name, field, found)
    for name, effect in listing.effects_of(listing.own_sections()).items():
        _collect(name, effect.section, found)
        if hasattr(effect, "stage"):  # what it adds to stages
            keys = (key for key in _keys(effect.stage) if key.word not in Stage.model_fields)
            found[effect.stage] = SectionSchema("history", effect.stage, tuple(keys))
    return list(found.values())


def _parts_of(annotation: Any) -> Iterator[type[Part]]:
    """Yield the parts that an annotation, a field or a validator names, in order."""
    kind = getattr(annotation, "annotation", getattr(annotation, "json_schema_input_type", annotation))
    if isinstance(kind, type) and issubclass(kind, Part):
        yield kind
    for inner in get_args(kind):
        yield from _parts_of(inner)


def _collect(place: str, annotation: Any, found: dict[type[Part], SectionSchema]) -> None:
    for part in _parts_of(annotation):
        if part not in found:
            found[part] = SectionSchema(place, part, tuple(_keys(part)))
            for name, field in part.model_fields.items():
                _collect(f"{place}.{name}", field, found)


def _keys(part: type[Part]) -> Iterator[Key]:
    found = part.model_json_schema(schema_generator=SchemaOfKeys)
    for word, schema in found.get("properties", {}).items():
        words = literal_words(part.model_fields[word].annotation)
        text = schema.get("description") or (list_words(words) if words else "a mapping of the keys below")
        needed = word in found.get("required", ()) or word == kind_key(part)
        bounds = dict(_bounds(schema))
        within = " and ".join(said.format(bounds[name]) for name, said in BOUNDS.items() if name in bounds)
        yield Key(word, text, unit_in(text), within, _text(schema.get("default")), needed)


def _bounds(schema: Any) -> Iterator[tuple[str, float]]:
    """Yield the bounds of the numbers in all forms of a value, except the limits of all numbers."""
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

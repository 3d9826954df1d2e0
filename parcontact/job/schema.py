"""A JSON Schema (draft 2020-12) of job files, for editors, generated from the types of the sections.

It says of each key what the types say: words, numbers and their ranges, which keys exclude each other, defaults. What
needs several sections at once (resolution, files, loads that belong to a grid) only `parcontact check` knows.
"""

from __future__ import annotations

from typing import Any

from pydantic.json_schema import GenerateJsonSchema
from pydantic_core.core_schema import (
    AfterValidatorFunctionSchema,
    BeforeValidatorFunctionSchema,
    ComputedField,
    ModelField,
    TypedDictField,
)

from . import added_sections
from .model import extended
from .sections.materials import Dma, Elastic, Zener
from .sections.quantities import (
    AUTO_POINTS,
    FROM_SURFACE,
    LARGEST,
    MOST,
    along_x,
    both,
    bounded,
    countable,
    listed,
)
from .sections.stages import numbers

Schema = dict[str, Any]
DRAFT = "https://json-schema.org/draft/2020-12/schema"
RANGE: Schema = {"type": "string", "pattern": "^[^:]+:[^:]+:[0-9]+$", "description": "first:last:count"}
LIMITS: dict[Any, float] = {bounded: LARGEST, countable: MOST}  # the size of a number at most
SHORT = (both, along_x, listed, numbers)  # validators that let one value stand for several


class SchemaOfKeys(GenerateJsonSchema):
    """Pydantic's generator, with the short forms in which values may be written."""

    def field_title_should_be_set(self, schema: ModelField | TypedDictField | ComputedField | Any) -> bool:
        """Keys have no titles beside their names."""
        return False

    def function_before_schema(self, schema: BeforeValidatorFunctionSchema) -> Schema:
        """Return the forms of a list: one of its values, the list itself, a range of numbers."""
        found, function = self.generate_inner(schema["schema"]), schema["function"]["function"]
        if function not in SHORT:
            return found
        array = next(one for one in found.get("anyOf", [found]) if one.get("type") == "array")
        one_value = array["items"] if "items" in array else array["prefixItems"][0]
        words = [FROM_SURFACE, *([AUTO_POINTS] if one_value.get("type") == "integer" else [])]
        ranges = [RANGE] if function is numbers else [{"enum": words}] if function is both else []
        return {"anyOf": [one_value, array, *ranges]}

    def function_after_schema(self, schema: AfterValidatorFunctionSchema) -> Schema:
        """Return the range of a number, as large as any may be where its type leaves that open."""
        found, most = super().function_after_schema(schema), LIMITS.get(schema["function"]["function"])
        if most is None:
            return found
        low = {} if {"minimum", "exclusiveMinimum"} & found.keys() else {"minimum": -most}
        return {**found, **low, "maximum": most}


def schema() -> Schema:
    """Return the schema of a whole job, with the sections of all effects that are installed."""
    kind = extended(tuple(added_sections.find_effects()))
    found = kind.model_json_schema(schema_generator=SchemaOfKeys)
    properties = found["properties"]
    properties["material"] = {"anyOf": [_included(found["$defs"]), properties["material"]]}
    properties["surface"] = {"anyOf": [properties["surface"]["items"], properties["surface"]]}
    properties["sweep"] = _sweep()
    found["anyOf"] = [{"required": ["history"]}, {"required": ["steady"]}]
    return {"$schema": DRAFT, **found, "title": "A job of parcontact"}


def _sweep() -> Schema:
    values = {"anyOf": [{"type": "array", "minItems": 1}, RANGE]}
    mapping = {"type": "object", "minProperties": 1, "additionalProperties": values}
    text = "Cases: all combinations of the mappings; the keys within one mapping move together."
    return {"anyOf": [{"type": "array", "items": mapping}, mapping], "description": text}


def _included(definitions: Schema) -> Schema:
    """Return the schema of a material from a file: any key beside `include` replaces that of the file."""
    properties: Schema = {"include": {"type": "string", "description": "the name of a material file"}}
    for kind in (Elastic, Zener, Dma):
        for word, value in definitions[kind.__name__]["properties"].items():
            properties[word] = True if word in properties else value
    return {"type": "object", "required": ["include"], "properties": properties, "additionalProperties": False}

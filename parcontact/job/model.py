"""The job as an object that does not change. Its sections are in SI units. This module needs no MPI and reads no maps.

The JSON Schema (draft 2020-12) of job files, for editors, and a table of all keys follow from the types of the
sections. The schema has the words, ranges, exclusions and defaults of each key. Rules between sections (resolution,
files, loads) are checked by `parcontact check` only.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, get_args

from pydantic import Field, PrivateAttr, ValidationInfo, create_model, model_validator
from pydantic.json_schema import GenerateJsonSchema

from ..errors import SAID, Doubt
from . import advice, limits, listing, meaning, surfaces
from .calculation import BAND_RULES, Checkpoint, Grid, Numerics, Output, SomeBands, Study
from .materials import Dma, Elastic, Material, Zener, describe_temperature, heated
from .parts import (
    AUTO,
    FROM_SURFACE,
    LARGEST,
    MOST,
    Instead,
    Origin,
    Part,
    Rule,
    along_x,
    both,
    bounded,
    countable,
    kind_key,
    listed,
    literal_words,
    unit_in,
)
from .stages import Initial, Stage, Steady, expand_range
from .surfaces import Shape
from .yaml_text import Fault, dump, is_array, list_words

OF_A_SECTION = {  # keys that are often written at the top of a job by mistake
    **dict.fromkeys(("load", "pressure", "force", "velocity"), Instead("give it to the stages of history")),
    "temperature": Instead("give it to the material"),
}


NO_GRID = {"points": 1, "size": 1.0}  # grid of a job with bands, which have their own grids


class Job(Part):
    """A whole job. Its sections have the same names as in the job file. Two jobs are equal if all their keys have equal
    values."""

    title: str = Field(default="", description="text (put numbers in quotes)")
    grid: Grid = Field(description="a mapping with points and size")
    surface: tuple[Shape, ...] = Field(description="one shape, or a list of shapes")
    material: Material = Field(description="a mapping with model: elastic | zener | dma")
    initial: Initial = Initial()
    history: tuple[Stage, ...] = Field(default=(), description="a list of stages")
    numerics: Numerics = Numerics()
    output: Output = Output()
    checkpoint: Checkpoint = Checkpoint()
    steady: Steady | None = None
    study: Study | None = None
    bands: SomeBands | None = Field(default=None, description="auto, or a mapping with count, points and waves")

    _origin: Origin = PrivateAttr(default=Origin())

    foreign = OF_A_SECTION
    rules = (*limits.RULES, *(Rule(("output",), check) for check in limits.no_field.values()), *BAND_RULES)
    at_most_one = (("grid", "bands"),)

    @classmethod
    def filled(cls, data: dict[str, Any], context: Origin | None) -> dict[str, Any]:
        """Return the sections `data` with defaults where nothing is given: names of stages, the convolution kernel that
        suits the boundary, and an output directory called after the job file."""
        data = prepared(data)
        if data.get("bands") is not None:
            data.setdefault("grid", dict(NO_GRID))
        boundary = data["grid"].get("boundary") if isinstance(data.get("grid"), dict) else None
        padded = boundary == "free" or (isinstance(boundary, list | tuple) and "free" in boundary)
        _default(data, "numerics", "kernel", "love" if padded else "spectral")
        _default(data, "output", "directory", str(Path("out", context.path.stem if context else "job")))
        return data

    @model_validator(mode="wrap")
    @classmethod
    def _with_sections_of_effects(cls, data: Any, handler: Callable[[Any], Any], info: ValidationInfo) -> Any:
        """Validate a job that has sections of effects by the model extended with them."""
        if cls is Job and isinstance(data, dict):
            others = [key for key, value in data.items() if key not in cls.model_fields and value is not None]
            if added := listing.effects_of(others):
                return extended_model(tuple(sorted(added))).model_validate(data, context=info.context)
        return handler(data)

    def model_post_init(self, context: Any) -> None:
        if isinstance(context, Origin):
            self._origin = context
        for change in self.asked("changed_material") if type(self) is not Job else ():
            self.__dict__["material"] = change(self)  # before it is frozen, and rules see it

    @classmethod
    def words(cls) -> tuple[str, ...]:
        """Return the names of all sections, including `sweep`, and the sections of this package's effects."""
        return (*dict.fromkeys((*super().words(), *listing.own_sections())), "sweep")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Job) and dict(self) == dict(other)

    def __hash__(self) -> int:
        return hash(self.resolved())

    @property
    def origin(self) -> Origin:
        return self._origin

    def with_origin(self, origin: Origin) -> Job:
        """Return the same job with another origin (`parts.Origin`)."""
        copy = self.model_copy()
        copy._origin = origin
        return copy

    @property
    def path(self) -> Path:
        """Return the absolute path of the job file."""
        return self._origin.path

    @property
    def included(self) -> str:
        """Return a text with a line for each file of an included material."""
        return "\n".join(map(str, self._origin.included))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return all warnings about the job as sentences."""
        return tuple(map(str, self.doubts))

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Return all warnings about the job. With `numerics.strict` they count as errors."""
        given = self.material.given
        of_fit = given.doubts if isinstance(given, Dma) else ()
        tests = meaning.ON_A_GRID if self.bands is None else meaning.IN_BANDS
        said = self._said("doubts")
        of_effects = (each if isinstance(each, Doubt) else SAID("", {"text": str(each)}) for each in said)
        return (*of_fit, *(doubt for test in tests for doubt in test(self)), *of_effects)

    @property
    def facts(self) -> tuple[str, ...]:
        """Return a sentence on the temperature of the material, and the sentences in which effects say what their
        sections mean for this job."""
        material: Any = self.material.given
        return tuple(filter(None, (describe_temperature(material), *self._said("facts"))))

    def _said(self, what: str) -> Iterator[Any]:
        """Yield the `doubts` or `facts` of the effects whose sections are given."""
        for section, effect in listing.effects_of(self._added_sections()).items():
            with listing.naming_effect(section):
                found = list(getattr(effect, what, lambda job: ())(self))
            yield from found

    @property
    def directions(self) -> list[tuple[float, float]]:
        """Return the different sliding directions (unit vectors); opposite directions count once."""
        return advice.directions_of(self.history, self.initial, self.steady)

    @property
    def measured(self) -> bool:
        """Return True if the material states in which range of frequencies or of temperatures it was measured."""
        body = self.material.fitted
        return isinstance(body, Zener) and (body.band is not None or body.temperatures is not None)

    @property
    def depends_on_heights(self) -> bool:
        """Return True if warnings need the heights of the surface: to find the slope of the surface, or to compare the
        heights with an approach, or with a length such as the thickness of a layer."""
        compared = any(compares(self) for compares in self.asked("compares_heights"))
        compared |= any(stage.control == "approach" for stage in self.history)
        return compared or not meaning.says_all(self.surface)

    def at_temperature(self, temperature: float) -> Job:
        """Return the job with its material at another temperature [deg C]. Raises InputError without a shift."""
        return self.model_copy(update={"material": heated(self.material, temperature)})

    def left_out(self) -> tuple[str, ...]:
        return ("grid",) if self.bands is not None else ()

    def section(self, name: str) -> Any:
        """Return the section of an effect, or None if the job does not have it."""
        return getattr(self, name, None)

    def asked(self, name: str) -> list[Any]:
        """Return the attributes called `name` that classes of effects have (see `effects.effect.Effect`). Only effects
        whose sections the job has are asked; effects without the attribute are left out."""
        found = listing.effects_of(self._added_sections()).values()
        return [getattr(effect, name) for effect in found if hasattr(effect, name)]

    def _added_sections(self) -> list[str]:
        return [name for name in type(self).model_fields if name not in Job.model_fields and self.section(name)]

    @property
    def remembers(self) -> bool:
        """Return True if contacts depend on earlier ones, because the body relaxes or an effect has a memory."""
        return self.material.fitted.remembers or any(asked(self) for asked in self.asked("remembers"))

    @property
    def sheared_first(self) -> bool:
        """Return True if an effect shears the contact before the surface slides over it."""
        return any(asked(self) for asked in self.asked("sheared_first"))

    def resolved(self) -> str:
        """Return the job as YAML text with every default; loading the text returns an equal job.

        Values that `numerics.accuracy` chose are written as comments, so that they are chosen again when the text is
        loaded.
        """
        chosen = ", ".join(f"{name} {value!r}" for name, value in self.numerics.chosen.items())
        return dump(listing.plain_data(self)) + (f"# chosen by numerics.accuracy: {chosen}\n" if chosen else "")


SEPARATOR = ":"  # separates the sections in the class name of an extended job, by which other ranks find the class


@cache
def extended_model(sections: tuple[str, ...]) -> type[Job]:
    """Return the model of a job with the sections of effects, and with the keys that these effects add to stages.

    If a rule of one effect needs the section of another effect, it applies only to jobs that have both sections.
    """
    effects = listing.effects_of(sections)
    fields: dict[str, Any] = {
        name: (effect.section | None, Field(default=None, description="a mapping of keys"))
        for name, effect in effects.items()
    }
    for stage in (effect.stage for effect in effects.values() if hasattr(effect, "stage")):
        fields["history"] = (tuple[stage, ...], Job.model_fields["history"])  # type: ignore[valid-type]
    made = create_model(SEPARATOR.join(("Job", *sections)), __base__=Job, __module__=__name__, **fields)
    every = ((name, rule) for name, effect in effects.items() for rule in getattr(effect, "rules", ()))
    own = [_named_rule(name, rule) for name, rule in every if made.model_fields.keys() >= set(rule.needs)]
    laws = (limits.refuse_steady(name) for name, effect in effects.items() if getattr(effect, "brings_law", False))
    on_a_grid = (name for name, effect in effects.items() if not getattr(effect, "in_bands_over_time", False))
    single = map(limits.refuse_bands_over_time, on_a_grid)
    lifted = [check for effect in effects.values() for check in getattr(effect, "lifts", ())]
    kept = (rule for rule in Job.rules if rule.check not in lifted)
    made.rules = (*kept, *laws, *single, *own)
    return made


def _named_rule(section: str, rule: Rule) -> Rule:
    """Return a rule that raises RunError with the name of its effect if it fails."""

    def check(*values: Any) -> Iterator[Fault]:
        with listing.naming_effect(section):
            found = list(rule.check(*values))
        yield from found

    return rule if listing.is_ours(section) else rule._replace(check=check)


def __getattr__(name: str) -> Any:
    """Return the class of an extended job by its name, for unpickling on other ranks."""
    head, *sections = name.split(SEPARATOR)
    if head == "Job" and sections:
        return extended_model(tuple(sections))
    raise AttributeError(name)


def prepared(data: dict[str, Any]) -> dict[str, Any]:
    """Return the data of a job with `surface` as a list of shapes, and with names for stages that have none."""
    data = dict(data)
    if isinstance(data.get("surface"), dict | list) or is_array(data.get("surface")):
        data["surface"] = surfaces.with_shapes(data["surface"])
    if isinstance(data.get("history"), list):
        data["history"] = list(data["history"])
        for index, stage in enumerate(data["history"]):
            if isinstance(stage, dict) and stage.get("name") is None:
                data["history"][index] = {**stage, "name": f"stage {index + 1}"}
    return data


def _default(data: dict[str, Any], section: str, key: str, value: Any) -> None:
    given = data.get(section, {})
    if isinstance(given, dict) and given.get(key) is None:
        data[section] = {**given, key: value}


def describe_job(job: Job) -> str:
    """Return a table of the job with every default and unit, followed by the lengths of a cell and by the duration of
    the history."""
    rows = list(listing.rows(job))
    if job.bands is not None:
        return listing.layout(rows)
    rows.append(("cell", listing.text((job.grid.dx, job.grid.dy)), "m"))
    seconds = math.fsum(stage.seconds for stage in job.history)
    rows.append(("time", listing.text(seconds), "s"))
    return listing.layout(rows)


# -- the JSON Schema of job files --------------------------------------------------------------------------------------

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
    """Return the sections of effects that have no schema, with the reason for each."""
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
    for name in listing.materials():
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
    """A key of a section: a description of its values, and their unit, range and default. Each of these texts is '' if
    there is none."""

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

"""Sections that effects add to jobs, and jobs with all defaults as plain data and as tables with units.

Plain data are written as YAML, and compared with those of other jobs.

An effect of this package is found by its folder (`capabilities`). Another package registers an effect by an entry
point with the name of the effect's section and the effect's class (`effects.effect`):

    [project.entry-points."parcontact.effects"]
    wear = "tread_wear:Wear"

Effects are imported only for jobs that have their sections.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any

from .. import capabilities
from ..errors import InputError, RunError
from .calculation import Numerics
from .parts import Part, unit_in
from .stages import Oscillation, Ramp, Swing
from .surfaces import HeightArray
from .yaml_text import Fault, refuse

MOST_BRANCHES = 6  # largest number of branches that a table shows; of more it shows the first and the last


def plain_data(value: Any) -> Any:
    """Return a value of a job as plain data: numbers, texts, lists and mappings. Keys without a value are left out, and
    keys whose values `numerics.accuracy` chose."""
    if isinstance(value, HeightArray):
        return value.stored()
    if isinstance(value, Part):
        chosen = value.chosen if isinstance(value, Numerics) else ()
        return {key: plain_data(inner) for key, inner in items(value) if key not in chosen}
    if isinstance(value, Ramp):
        velocity = {"velocity": value.velocity} if value.velocity else {}
        start, end = plain_data(value.start), plain_data(value.end)
        return start if value.constant else {"from": start, "to": end, **velocity}
    if isinstance(value, Oscillation):
        return asdict(value)
    if isinstance(value, Swing):
        return {"amplitude": list(value), "frequency": value.frequency}
    if isinstance(value, tuple):
        return [plain_data(inner) for inner in value]
    return str(value) if isinstance(value, Path) else value


def items(part: Part) -> Iterator[tuple[str, Any]]:
    """Yield the keys of a part that have a value, with these values. A value that is a part itself is returned as the
    job gives it (`Part.given`)."""
    names = (name for name in type(part).model_fields if name not in part.left_out())
    for name in names:
        if (value := getattr(part, name)) is not None:
            yield name, value.given if isinstance(value, Part) else value


def plain_job(job: Any) -> dict[str, Any]:
    """Return a job as plain data for its fingerprint, with checksums of input files in place of their paths."""
    data: dict[str, Any] = plain_data(job)
    data["numerics"] |= job.numerics.chosen
    sections = [(data[name], value) for name, value in items(job) if isinstance(value, Part)]
    for part, given in (*zip(data["surface"], job.surface, strict=True), *sections):
        for key in ("path", "spectrum"):
            if isinstance(path := getattr(given, key, None), Path):
                del part[key]
                part["content"] = f"{zlib.crc32(path.read_bytes()):08x}"
        if isinstance(given, HeightArray):
            del part["path"]
            part["content"] = given.heights.checksum
    return data


def unit(kind: type[Part], key: str) -> str:
    """Return the unit of a key, which stands in brackets in the description of the key. Return '' for a key without a
    unit."""
    return unit_in(kind.model_fields[key].description).removeprefix("-")


def unit_of_path(path: str) -> str:
    """Return the unit of a key such as history.1.velocity if all keys called velocity have the same unit. Otherwise
    return ''."""
    units = _units().get(path.split(".")[-1], set())
    return next(iter(units)) if len(units) == 1 else ""


@cache
def _units() -> dict[str, set[str]]:
    """Return the units of all keys by their names."""
    capabilities.offers("effect", "__name__")  # imports all sections
    found, kinds = dict[str, set[str]](), [Part]
    for kind in kinds:
        kinds += kind.__subclasses__()
        for key in kind.model_fields:
            found.setdefault(key, set()).add(unit(kind, key).replace("deg C", "°C").replace("^2", "²"))
    return found


def rows(part: Part, path: str = "") -> Iterator[tuple[str, str, str]]:
    """Yield the key, the value and the unit of each row of a table that lists all keys of a part. A list of parts has
    one row for each of its items."""
    for key, value in items(part):
        name = f"{path}{key}"
        if isinstance(value, Part):
            yield from rows(value, f"{name}.")
        elif isinstance(value, tuple) and value and isinstance(value[0], Part):
            shown = list(enumerate(value))
            if key == "branches" and len(value) > MOST_BRANCHES:
                shown = [shown[0], shown[-1]]
            for index, item in shown:
                yield f"{name}.{index}", listed_line(item), ""
                if index == 0 and len(shown) < len(value):
                    yield f"{name}.1 to {len(value) - 2}", "are in job.resolved.yaml", ""
        elif value != "":
            yield name, text(value), _unit_of(value, part, key)


def _unit_of(value: Any, part: Part, key: str) -> str:
    """Return the unit of a number, with the velocity of a ramp or the frequency of an oscillation, or '' for words such
    as auto, and for mappings."""
    if isinstance(value, Ramp) and value.velocity:
        return f"{unit(type(part), key)} at {text(value.velocity)} m/s"
    if isinstance(value, Oscillation | Swing):
        return f"{unit(type(part), key)} at {text(value.frequency)} Hz"
    return "" if isinstance(value, str | Part) else unit(type(part), key)


def listed_line(part: Part) -> str:
    """Return the keys and values of a part as one line of text."""
    pairs = [(key, value, _unit_of(value, part, key)) for key, value in items(part)]
    return ", ".join(f"{key} {text(value)} {unit}".rstrip() for key, value, unit in pairs)


def text(value: Any) -> str:
    """Return a value as text. Numbers have six digits."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Ramp):
        return text(value.start) if value.constant else f"{text(value.start)} to {text(value.end)}"
    if isinstance(value, Oscillation):
        return f"{text(value.mean)} ± {text(value.amplitude)}"
    if isinstance(value, Part):
        return f"({listed_line(value)})"
    if isinstance(value, tuple):
        more = "±" * isinstance(value, Swing)
        return f"{more}[{', '.join(text(inner) for inner in value)}]"
    return str(value)


def layout(lines: list[tuple[str, str, str]]) -> str:
    """Return rows of key, value and unit as an aligned table, with an empty line between sections."""
    key_width = max(len(key) for key, _, _ in lines)
    value_width = max([len(value) for _, value, unit in lines if unit], default=0)
    out: list[str] = []
    section = lines[0][0].split(".")[0]
    for key, value, unit_text in lines:
        if section != key.split(".")[0]:
            section = key.split(".")[0]
            out.append("")
        out.append(f"{key:<{key_width}}  {value:<{value_width}}  {unit_text}".rstrip())
    return "\n".join(out)


GROUP = "parcontact.effects"


def find_effects() -> dict[str, Any]:
    """Return all usable registered effects, by the name of their section."""
    return {section: _load(section) for section in _registered() if not why_unusable(section)}


def effects_of(sections: Iterable[str]) -> dict[str, Any]:
    """Return the effects registered for some sections, by section, in the order in which they act after a step. Raises
    ValidationError for an unusable effect."""
    found = [section for section in sections if section in _registered()]
    for section in found:
        if reason := why_unusable(section):
            refuse(Fault(reason, (section,), at_key=True))
    ours = _folders()
    needs = {section: capabilities.needs_of(ours.get(section) or _load(section)) for section in found}
    return {section: _load(section) for section in capabilities.in_order(needs)}


def answers(module: str, name: str, job: Any = None) -> list[Any]:
    """Return all objects called `name` that effects have. Effects of this package have such objects in their `module`,
    effects of other packages as attributes of their class. If a `job` is given, only effects whose sections it has are
    asked."""
    others = [section for section in _registered() if not is_ours(section) and not why_unusable(section)]
    asked = [section for section in others if job is None or job.section(section) is not None]
    found = [(section, getattr(_load(section), name)) for section in asked if hasattr(_load(section), name)]
    return [*capabilities.offers(module, name, job), *(_named(*each) for each in found)]


def _named(section: str, offered: Any) -> Any:
    """Return what an effect of another package offers; functions name it in their errors."""

    def call(*given: Any) -> Iterator[Any]:
        with naming_effect(section):
            found = list(offered(*given))
        yield from found

    return call if callable(offered) else offered


@contextmanager
def naming_effect(section: str) -> Iterator[None]:
    """Return a context for code of the effect of a `section`. If the code fails, or tries to end the program, a
    RunError that names the effect is raised."""
    try:
        yield
    except (InputError, RunError):
        raise
    except (Exception, SystemExit) as error:
        raise RunError(f"{describe_effect(section)} has failed: {type(error).__name__}: {error}") from error


def describe_effect(section: str) -> str:
    """Return the name of the effect of a section, and the entry point of its class."""
    return f"the effect {section} ({_registered()[section].value})"


def is_ours(section: str) -> bool:
    """Return True if an effect of this package adds the section."""
    return section in own_sections()


def unusable() -> list[str]:
    """Return a sentence for each registered effect that cannot be used."""
    return [f"{section} {reason}" for section in _registered() if (reason := why_unusable(section))]


@cache
def _registered() -> dict[str, EntryPoint]:
    """Return the effects of other packages and, also if another package takes the same name, those of this package."""
    return {entry.name: entry for entry in entry_points(group=GROUP)} | {
        name: EntryPoint(name, f"{each.__name__}.effect:{each.EFFECT}", GROUP) for name, each in _folders().items()
    }


def _folders() -> dict[str, ModuleType]:
    """Return the packages of this package's effects by section."""
    return {each.SECTION: each for each in capabilities.folders() if hasattr(each, "SECTION")}


def own_sections() -> list[str]:
    """Return the sections that effects of this package add."""
    return sorted(_folders())


def materials() -> list[str]:
    """Return the names of all sections that have the keys of a material: `material`, and those of effects."""
    return ["material", *(each.SECTION for each in capabilities.folders() if getattr(each, "MATERIAL", False))]


@cache
def _load(section: str) -> Any:
    return _registered()[section].load()


@cache
def why_unusable(section: str) -> str:
    """Return the reason why the effect of a section cannot be used, or '' if it can."""
    try:
        effect = _load(section)
        base = f"{Part.__module__}.{Part.__name__}"
        reason = "" if issubclass(effect.section, Part) else f"its section is not a subclass of {base}"
        columns = effect.columns
        different = isinstance(columns, tuple | list) and len(set(columns)) == len(columns)
        if not different or not all(isinstance(name, str) and name.isidentifier() for name in columns):
            reason = f"its columns must be a tuple of different names, of letters, digits and _, got {columns!r}"
    except (Exception, SystemExit) as error:  # code of other packages may raise anything
        reason = f"{type(error).__name__}: {error}"
    return reason and f"belongs to the effect {_registered()[section].value}, which cannot be used: {reason}"

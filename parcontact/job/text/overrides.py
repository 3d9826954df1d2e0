"""The data of one job from a YAML file: applies overrides and reads included materials."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

from ... import capabilities
from .fault import quote, shorten
from .places import UNREADABLE, Key, Place, Source
from .python_data import source_of
from .sweep_cases import SWEEP, Setting, Sweep, refuse_overrides, take_sweep
from .yamltext import parse, read_source, read_with_content

OURS = Path(__file__).parents[2] / "materials"  # compounds that come with the program


class Included(NamedTuple):
    """An included file: its absolute path, and the SHA-256 of its content."""

    path: Path
    sha256: str
    section: str = "material"

    def __str__(self) -> str:
        return f"{self.section}: included from {self.path} (SHA-256 {self.sha256})"


class Reading(NamedTuple):
    """The data of a job or a case, the files of its included materials, and its sweep (None if it has mistakes)."""

    source: Source
    included: tuple[Included, ...]
    sweep: Sweep | None


Changes = Iterable[str | tuple[str, Any]]  # `key.path=value`, or a key and Python data


def read_job(path: Path, changes: Changes, case: int = 0, given: Source | None = None) -> Reading:
    """Return the data of a job with its overrides, the settings of a case of its sweep, and the included material.

    `given` data are used in place of the file.
    """
    source = given or read_source(path, str(path))
    overrides = [override for change in changes if (override := _parse(change, source))]
    for override in overrides:
        if override.path[:1] == SWEEP:
            _apply(source, override)
    sweep = take_sweep(source)
    overrides = [override for override in overrides if override.path[:1] != SWEEP]
    if sweep is None:
        source.data = UNREADABLE
    elif sweep:
        refuse_overrides(sweep, overrides, source)
        overrides += sweep.case(min(max(case, 0), len(sweep) - 1))
    owns = {name: dict(_material(source, name)) for name in materials()}
    first = [key for name in owns for key in ((name,), (name, "include"))]
    for override in overrides:
        if override.path in first:
            _apply(source, override)
    included = [_include(source, path, name, {} if "include" in own else own) for name, own in owns.items()]
    for override in overrides:
        if override.path not in first:
            _apply(source, override)
    return Reading(source, tuple(filter(None, included)), sweep)


def _parse(change: str | tuple[str, Any], source: Source) -> Setting | None:
    """Return a change as a setting; None if it has mistakes, which are added to `source`."""
    if isinstance(change, str):
        place = Place(f"--set {shorten(change)}")
        name, equals, value = change.partition("=")
        name = ".".join(key.strip() for key in name.split("."))
        if not equals or not all(name.split(".")):
            source.note(place, "must have the form key.path=value, like grid.points=512")
            return None
        parsed = parse(value, str(place), whole=place)
    else:
        name, place = change[0], Place(f"set {shorten(change[0])}")
        parsed = source_of(change[1], place)
    source.mistakes += parsed.mistakes
    return None if parsed.mistakes else Setting(name, parsed.data, place, place)


def _apply(source: Source, override: Setting) -> None:
    """Set the value at the path of an override, and create missing mappings on the path.

    `surface.0` also names a surface that is a single mapping. `auto` is replaced by a mapping of the keys that
    overrides set.
    """
    if not isinstance(source.data, dict):
        return
    node: Any = source.data
    found, given = Key(), override.path
    if given[:2] == ("surface", "0") and isinstance(node.get("surface"), dict):
        given = ("surface", *given[2:])
    for index, name in enumerate(given):
        if isinstance(node, list) and str(name).isdecimal() and int(name) < len(node):
            name = int(name)
        elif not isinstance(node, dict):
            if node is not UNREADABLE:
                source.note(override.key_place, _dead_end(node, ".".join(map(str, found)), str(name)))
            return
        found = (*found, name)
        if index == len(given) - 1:
            source.put(found, override.value, override.key_place, override.place)
        elif isinstance(node, dict) and _leaves_open(node.get(name), str(given[index + 1])):
            source.put(found, {}, override.key_place, override.key_place)
        node = node[name]


def _leaves_open(value: Any, name: str) -> bool:
    """Return True if a mapping with a key of this name can replace the value: no value, or `auto`."""
    return value is None or (value == "auto" and not name.isdecimal())


def _dead_end(node: Any, shown: str, name: str) -> str:
    """Return why a path does not exist below a value of the job, and the remedy."""
    if not isinstance(node, list):
        return f"{shown} is {quote(node)}, not a mapping of keys, and has no {name}; give {shown} as a whole"
    if not node:
        return f"{shown} is an empty list; give {shown} as a whole"
    entries = f"entries {shown}.0 to {shown}.{len(node) - 1}" if len(node) > 1 else f"one entry, {shown}.0"
    there = f"{shown} is a list with {entries}, and has no {name}"
    return there if name.isdecimal() else f"{there}; did you mean {shown}.0.{name}?"


# -- materials from other files ---------------------------------------------------------------------------------------


def materials() -> list[str]:
    """Return the sections that are materials."""
    return ["material", *(each.SECTION for each in capabilities.folders() if getattr(each, "MATERIAL", False))]


def _material(source: Source, section: str) -> dict[str, Any]:
    """Return the material of a section of a job, an empty mapping if it has none."""
    found = source.data.get(section) if isinstance(source.data, dict) else None
    return found if isinstance(found, dict) else {}


def _include(source: Source, job: Path, section: str, own: dict[str, Any]) -> Included | None:
    """Replace `material: {include: name, ...}` by the keys of the included file, updated by the other keys given; or
    another `section` that is a material. `own` are the keys of a material that the job file describes without an
    include.
    """
    given, root = _material(source, section), (section,)
    name, place = given.get("include"), source.locate((section, "include")).place
    if name is None:
        return None
    del given["include"]
    found = _find(name, job)
    if isinstance(found, str):
        source.note(place, f"{section}.include must name a material file, got {quote(name)} ({found})")
        source.data[section] = UNREADABLE
        return None
    content, included = read_with_content(found, _shown(found))
    source.mistakes += included.mistakes
    start: Key = ("material",) if isinstance(included.data, dict) and list(included.data) == ["material"] else ()
    material, at = included.data["material"] if start else included.data, included.locate(start).place
    if not isinstance(material, dict):
        if material is not UNREADABLE:
            source.note(at, "must be one mapping with the keys of a material")
        source.data[section] = UNREADABLE
        return None
    if hidden := [key for key in own if key in material and key in given]:
        sentence = f"has no effect on {', '.join(hidden)}, which the job gives itself"
        source.note(place, f"{sentence}; use --set {section}={{include: {name}}} to replace the material")
    items = included.places.items()
    places = {(*root, *key[len(start) :]): known for key, known in items if key != start}
    for key in given:
        own_place = source.locate((*root, key))
        places = {path: known for path, known in places.items() if path[1] != key}
        places[*root, key] = own_place.key_place, own_place.place
    places |= {path: known for path, known in source.places.items() if path[:1] == root and len(path) > 2}
    source.put(root, material | given, source.locate(root).key_place, at)
    source.places |= places
    return Included(found.absolute(), hashlib.sha256(content).hexdigest(), section)


def _find(name: Any, job: Path) -> Path | str:
    """Return the included file, or a text on where it was searched.

    A path is relative to the job file; a name is searched in the directory of the job, in its materials/, and among the
    program's own materials.
    """
    directory = job.absolute().parent
    own = f"among the program's own: {', '.join(sorted(path.stem for path in OURS.glob('*.yaml')))}"
    if not isinstance(name, str):
        return f"a name or a path; {own}"
    try:
        if name.endswith((".yaml", ".yml")):
            candidates, where = [directory / Path(name).expanduser()], "looked from the job file"
        else:
            candidates = [place / f"{name}.yaml" for place in (directory, directory / "materials", OURS)]
            places = f"{shorten(name)}.yaml and materials/{shorten(name)}.yaml in the directory of the job file"
            where = f"looked for {places}, and {own}"
        return next((path for path in candidates if path.is_file() and path != job.absolute()), where)
    except (OSError, RuntimeError) as error:  # a name that is too long, a user that does not exist
        return shorten(getattr(error, "strerror", None) or str(error))


def _shown(path: Path) -> str:
    """Return a path relative to the working directory if it is below that."""
    relative = os.path.relpath(path)
    return str(path) if relative.startswith("..") else relative

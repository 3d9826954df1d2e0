"""Changes of a job: overrides (`--set`), included materials, and the cases of a `sweep`.

A sweep is a list of mappings from keys of the job to lists of values. Keys within one mapping change together; cases
are all combinations of the mappings, numbered from 0, with the last mapping changing fastest.
"""

from __future__ import annotations

import hashlib
import itertools
import math
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from .. import capabilities
from .parts import Included, log_range
from .yaml_text import UNREADABLE, Key, Place, Source, parse, quote, read_source, read_with_content, shorten, source_of

SWEEP: Key = ("sweep",)
MAX_CASES = 1000  # tuning: most cases of a sweep
FIXED = ("sweep", "output.directory")  # keys that cannot be swept


class Setting(NamedTuple):
    """A value for a key, from a sweep, the command line or Python, with the places of key and value."""

    name: str
    value: Any
    key_place: Place
    place: Place

    @property
    def path(self) -> Key:
        return tuple(self.name.split("."))

    def __str__(self) -> str:
        return f"{self.name} = {self.value}"


Axis = list[tuple[Setting, ...]]  # of one mapping: for each of its values, the settings of all its keys


class Sweep:
    """The mappings of a sweep; an empty list for a job without a sweep."""

    def __init__(self, axes: list[Axis], place: Place) -> None:
        self.axes, self.place = axes, place

    def __len__(self) -> int:
        """Return the number of cases; 0 if the job has no sweep."""
        return math.prod(map(len, self.axes)) if self.axes else 0

    def case(self, index: int) -> tuple[Setting, ...]:
        """Return the settings of a case."""
        moves = next(itertools.islice(itertools.product(*self.axes), index, None))
        return tuple(itertools.chain(*moves))


def take_sweep(source: Source) -> Sweep | None:
    """Remove the sweep from the data of a job and return it; None for a sweep with mistakes, which `source` notes."""
    data = source.data if isinstance(source.data, dict) else {}
    section, place = data.get("sweep"), source.locate(SWEEP).place
    mistakes = len(source.mistakes)
    sweep = Sweep([] if section is None else list(_axes(section, source)), place)
    count = math.prod(map(len, sweep.axes)) if sweep.axes else 0  # may be too large for len()
    if count > MAX_CASES:
        source.note(place, f"sweep has {quote(count)} cases; at most {MAX_CASES} are allowed")
    sound = len(source.mistakes) == mistakes and source.locate(SWEEP).readable
    data.pop("sweep", None)
    return sweep if sound else None


def _axes(section: Any, source: Source) -> Iterator[Axis]:
    seen: dict[str, Place] = {}
    listed = isinstance(section, list)
    for index, mapping in enumerate(section if listed else [section]):
        path: Key = (*SWEEP, index) if listed else SWEEP
        if not isinstance(mapping, dict) or not mapping:
            what = "sweep must be a list of mappings from keys to lists of values"
            source.note(source.locate(path).place, f"{what}, got {quote(mapping)}")
            continue
        columns = [_column(name, values, path, source, seen) for name, values in mapping.items()]
        if all(columns) and len({len(column) for column in columns}) > 1:
            counts = ", ".join(f"{len(column)} of {shorten(column[0].name)}" for column in columns)
            what = "keys of one mapping change together and need equal numbers of values"
            source.note(source.locate(path).place, f"{what}, got {counts}")
            continue
        yield list(zip(*columns, strict=False))  # lengths are equal, unless one column has mistakes


def _column(name: str, values: Any, path: Key, source: Source, seen: dict[str, Place]) -> list[Setting]:
    """Return the settings of one key; an empty list, and a mistake in `source`, if its values are wrong."""
    at = source.locate((*path, name))
    place, key_place = at.place, at.key_place
    settings: list[Setting] = []
    if any(name == fixed or name.startswith(f"{fixed}.") for fixed in FIXED):
        source.note(key_place, f"{shorten(name)} cannot be swept")
    elif other := next((one for one in seen if _overlap(one, name)), ""):
        source.note(key_place, f"{shorten(name)} is swept a second time, first as {shorten(other)} at {seen[other]}")
    elif not all(name.split(".")):
        source.note(key_place, f"must be a key of the job like grid.points, got {quote(name)}")
    elif isinstance(values, list) and values:
        places = [source.locate((*path, name, index)).place for index in range(len(values))]
        settings = [Setting(name, value, key_place, one) for value, one in zip(values, places, strict=True)]
    else:
        try:
            numbers = [float(f"{value:.12g}") for value in log_range(str(values))]  # 1e5, not 99999.99999999999
            settings = [Setting(name, value, key_place, place) for value in numbers]
        except ValueError:
            sentence = f"{shorten(name)} needs a list of values or a range first:last:count, got {quote(values)}"
            source.note(place, sentence)
    seen[name] = key_place
    return settings


def _overlap(one: str, other: str) -> bool:
    """Return True if one key is equal to the other or within it."""
    return f"{one}.".startswith(f"{other}.") or f"{other}.".startswith(f"{one}.")


def refuse_overrides(sweep: Sweep, overrides: list[Setting], source: Source) -> None:
    """Note a mistake for each override of a key that is swept."""
    names = {setting.name for axis in sweep.axes for setting in axis[0]}
    for override in overrides:
        if found := next((swept for swept in names if _overlap(swept, override.name)), ""):
            advice = f"change the sweep instead, like --set 'sweep=[{{{shorten(found)}: [...]}}]'"
            source.note(override.place, f"{shorten(found)} is swept; {advice}")


OURS = Path(__file__).parents[1] / "materials"  # compounds that come with the program


class Reading(NamedTuple):
    """The data of a job or a case, the files of its included materials, and its sweep (None if it has mistakes)."""

    source: Source
    included: tuple[Included, ...]
    sweep: Sweep | None


Changes = Iterable[str | tuple[str, Any]]  # `key.path=value`, or a key and Python data


def read_job(path: Path, changes: Changes, case: int = 0, given: Source | None = None) -> Reading:
    """Return the data of a job with its overrides, the settings of a case of its sweep, and the included material.

    If `given`, this source replaces the file.
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
    """Return the names of the sections that are materials."""
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

"""From a YAML file and command-line overrides to a `Source`: overrides put in place, included materials read."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import Any, NamedTuple

from .fault import quote
from .python_data import source_of
from .source import Key, Mistake, Place, Source, shorten
from .sweep_cases import SWEEP, Setting, Sweep, refuse_overrides, take
from .yamltext import parse, read, read_with_content

MATERIAL: Key = ("material",)
INCLUDE: Key = ("material", "include")
OURS = Path(__file__).parents[2] / "materials"  # compounds that come with the program


class Override(NamedTuple):
    """`key.path=value` from the command line, or of a case of a sweep; `place` is that of the key."""

    path: Key
    source: Source
    place: Place

    @property
    def name(self) -> str:
        return ".".join(map(str, self.path))


class Reading(NamedTuple):
    """What was read: the data of one job, or of one case, the file of its material, and its sweep if that is sound."""

    source: Source
    included: Included | None
    sweep: Sweep | None


Overrides = tuple[str | tuple[str, Any], ...]


class Included(NamedTuple):
    """A file that a job includes: its absolute path, and the SHA-256 of what was read from it."""

    path: Path
    sha256: str

    def __str__(self) -> str:
        return f"material: included from {self.path} (SHA-256 {self.sha256})"


def read_job(path: Path, overrides: Overrides, case: int = 0, given: Source | None = None) -> Reading:
    """The source of a job with its overrides, the settings of a case if it has a sweep, and its included material.

    Data that are `given` stand for the file.
    """
    source = given or read(path, str(path))
    if () in source.broken:
        source.data = None
    parsed = [_parse(override, source) for override in overrides]
    of_job = [override for override in parsed if override is not None]
    for override in of_job:
        if override.path[:1] == SWEEP:
            _apply(source, override)
    sweep = take(source)
    wanted = [override for override in of_job if override.path[:1] != SWEEP]
    if sweep is None:
        source.broken.add(())
    elif sweep:
        refuse_overrides(sweep, [(override.name, override.place) for override in wanted], source)
        wanted += [_of_case(setting) for setting in sweep.case(min(max(case, 0), len(sweep) - 1))]
    early = [override for override in wanted if override.path in (MATERIAL, INCLUDE)]
    before = tuple(_given(source))
    for override in early:
        _apply(source, override)
    included = _include(source, path, () if "include" in before else before)
    for override in wanted:
        if override not in early:
            _apply(source, override)
    return Reading(source, included, sweep)


def _of_case(setting: Setting) -> Override:
    path: Key = tuple(setting.name.split("."))
    return Override(path, Source(setting.value, {(): setting.place}), setting.key_place)


def _given(source: Source) -> dict[str, Any]:
    """The keys of the material as the job file has them."""
    found = source.data.get("material") if isinstance(source.data, dict) else None
    return found if isinstance(found, dict) else {}


def _parse(given: str | tuple[str, Any], source: Source) -> Override | None:
    """An override as a text `key.path=value`, or as a key and Python data."""
    if not isinstance(given, str):
        place = Place(f"set {shorten(given[0])}")
        data = source_of(given[1], place)
        source.mistakes += data.mistakes
        return None if data.mistakes else Override(tuple(given[0].split(".")), data, place)
    text = given
    place = Place(f"--set {shorten(text)}")
    name, equals, value = text.partition("=")
    keys = [key.strip() for key in name.split(".")]
    if not equals or not all(keys):
        source.mistakes.append(Mistake(place, "must have the form key.path=value, like grid.points=512"))
        return None
    parsed = parse(value, str(place), whole=place)
    source.mistakes += parsed.mistakes
    return None if parsed.mistakes else Override(tuple(keys), parsed, place)


def _apply(source: Source, override: Override) -> None:
    """Puts the value of an override where its path leads, making the mappings on the way."""
    if () in source.broken or not isinstance(source.data, dict):
        return
    node: Any = source.data
    path: Key = ()
    for name in override.path[:-1]:
        step = _step(source, node, name, path, override)
        if step is None:
            return
        path = (*path, *step)
        if step and node[step[0]] is None:
            node[step[0]] = {}
        node = node[step[0]] if step else node
    step = _step(source, node, override.path[-1], path, override)
    if step is None:
        return
    path = (*path, *step)
    source.forget(path)
    source.graft(path, override.source)
    source.keys[path] = override.place
    if step:
        node[step[0]] = override.source.data
    else:
        source.data["surface"] = override.source.data


def _step(source: Source, node: Any, name: str | int, path: Key, override: Override) -> Key | None:
    """One step of an override's path: a key, an index, or nothing where a lone mapping stands for a list of one."""
    shown = ".".join(map(str, path)) or "the job"
    if isinstance(node, dict) and path == ("surface",) and name == "0":
        return ()
    if isinstance(node, dict):
        key = str(name)
        if key not in node:
            node[key] = None
            source.values[(*path, key)] = source.keys[(*path, key)] = override.place
        return (key,)
    if isinstance(node, list) and str(name).isdecimal() and int(name) < len(node):
        return (int(name),)
    if isinstance(node, list):
        sentence = f"{shown} is a list of {len(node)}, numbered from 0; it has no {name}"
    else:
        sentence = f"{shown} is {quote(node)}, which has no key {name}"
    source.mistakes.append(Mistake(override.place, sentence))
    return None


def _include(source: Source, job: Path, own: tuple[str, ...]) -> Included | None:
    """Replaces `material: {include: name, ...}` by the keys of the included file and those given beside it.

    `own` are the keys of a material that the job file describes without an include.
    """
    beside = _given(source)
    if beside.get("include") is None:
        return None
    name = beside.pop("include")
    place = source.place(INCLUDE)
    found = _find(name, job)
    if isinstance(found, str):
        source.mistakes.append(
            Mistake(place, f"material.include must name a material file, got {quote(name)} ({found})")
        )
        source.broken.add(MATERIAL)
        return None
    content, included = read_with_content(found, _shown(found))
    included = _unwrapped(included)
    if not isinstance(included.data, dict):
        if () not in included.broken:
            included.mistakes.append(Mistake(included.place(()), "must be one mapping with the keys of a material"))
        included.broken.add(())
        included.data = {}
    if hidden := [key for key in own if key in included.data and key in beside]:
        sentence = f"has no effect on {', '.join(hidden)}, which the job gives itself"
        advice = f"use --set material={{include: {name}}} to replace the material"
        source.mistakes.append(Mistake(place, f"{sentence}; {advice}"))
    source.data["material"] = {**included.data, **beside}
    _merge_places(source, included, beside)
    return Included(found.absolute(), hashlib.sha256(content).hexdigest())


def _merge_places(source: Source, included: Source, beside: dict[str, Any]) -> None:
    """Takes the places of the included keys, unless the key is given beside the include."""
    for key in beside:
        included.forget((key,))
    included.broken = {path for path in included.broken if path[:1] not in {(key,) for key in beside}}
    source.graft(MATERIAL, included)


def _unwrapped(source: Source) -> Source:
    """A file whose only key is `material` means what is in it."""
    if not isinstance(source.data, dict) or list(source.data) != ["material"]:
        return source
    inner = Source(data=source.data["material"], mistakes=source.mistakes)
    inner.values = {path[1:]: place for path, place in source.values.items() if path[:1] == MATERIAL}
    inner.keys = {path[1:]: place for path, place in source.keys.items() if path[:1] == MATERIAL and len(path) > 1}
    inner.broken = {path[1:] for path in source.broken}
    return inner


def _is_path(name: Any) -> bool:
    return isinstance(name, str) and name.endswith((".yaml", ".yml"))


def _find(name: Any, job: Path) -> Path | str:
    """The file that an include means, or else where it was looked for: a path from the job file; a name in the job's
    own directory, in materials/ there, or among the compounds that come with the program."""
    directory = job.absolute().parent
    own = f"among the program's own: {', '.join(sorted(path.stem for path in OURS.glob('*.yaml')))}"
    if not isinstance(name, str):
        return f"a name or a path; {own}"
    try:
        if _is_path(name):
            candidates, where = [directory / Path(name).expanduser()], "looked from the job file"
        else:
            file = f"{name}.yaml"
            candidates = [directory / file, directory / "materials" / file, OURS / file]
            where = f"looked for {shorten(name)}.yaml and materials/{shorten(name)}.yaml beside the job file, and {own}"
        return next(
            (candidate for candidate in candidates if candidate.is_file() and candidate != job.absolute()), where
        )
    except (OSError, RuntimeError) as error:  # a name that is too long, a user that does not exist
        return shorten(getattr(error, "strerror", None) or str(error))


def _shown(path: Path) -> str:
    """A path as short as it can be said from the working directory."""
    relative = os.path.relpath(path)
    return str(path) if relative.startswith("..") else relative

"""From a YAML file and command-line overrides to a `Source`: overrides put in place, included materials read."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, NamedTuple

from .fault import quote
from .source import Key, Mistake, Place, Source, parse, read

MATERIAL: Key = ("material",)
INCLUDE: Key = ("material", "include")
OURS = Path(__file__).parents[1] / "materials"  # compounds that come with the program


class Override(NamedTuple):
    """`key.path=value` from the command line."""

    path: Key
    source: Source
    place: Place


def read_job(path: Path, overrides: tuple[str, ...]) -> Source:
    """The source of a job with its overrides and its included material."""
    source = read(path, str(path))
    if () in source.broken:
        source.data = None
    parsed = [_parse(text, source) for text in overrides]
    wanted = [override for override in parsed if override is not None]
    early = [override for override in wanted if override.path in (MATERIAL, INCLUDE)]
    for override in early:
        _apply(source, override)
    _include(source, path)
    for override in wanted:
        if override not in early:
            _apply(source, override)
    return source


def _parse(text: str, source: Source) -> Override | None:
    place = Place(f"--set {text}")
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


def _include(source: Source, job: Path) -> None:
    """Replaces `material: {include: name, ...}` by the keys of the included file and those given beside it."""
    beside = source.data.get("material") if isinstance(source.data, dict) else None
    if not isinstance(beside, dict) or beside.get("include") is None:
        return
    name = beside.pop("include")
    found = _find(name, job)
    if found is None:
        own = ", ".join(sorted(path.stem for path in OURS.glob("*.yaml")))
        upwards = f"for materials/{name}.yaml from the job file upwards, and among the program's own: {own}"
        where = "from the job file" if _is_path(name) else upwards
        sentence = f"material.include must name a material file, got {quote(name)} (looked {where})"
        source.mistakes.append(Mistake(source.place(INCLUDE), sentence))
        source.broken.add(MATERIAL)
        return
    included = _unwrapped(read(found, _shown(found)))
    if not isinstance(included.data, dict):
        if () not in included.broken:
            included.mistakes.append(Mistake(included.place(()), "must be one mapping with the keys of a material"))
        included.broken.add(())
        included.data = {}
    source.data["material"] = {**included.data, **beside}
    _merge_places(source, included, beside)


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


def _find(name: Any, job: Path) -> Path | None:
    """The file that an include means: a path from the job file, or the first materials/<name>.yaml on the way up, or a
    compound that comes with the program."""
    if not isinstance(name, str):
        return None
    directory = job.absolute().parent
    if _is_path(name):
        candidates = [directory / Path(name).expanduser()]
    else:
        candidates = [folder / "materials" / f"{name}.yaml" for folder in (directory, *directory.parents)]
        candidates.append(OURS / f"{name}.yaml")
    return next((candidate for candidate in candidates if candidate.is_file()), None)


def _shown(path: Path) -> str:
    """A path as short as it can be said from the working directory."""
    relative = os.path.relpath(path)
    return str(path) if relative.startswith("..") else relative

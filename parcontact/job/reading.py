"""Reading of job files: one job, or the cases of a sweep; mistakes are reported with file, line and column.

The data of a job are those of its file after overrides (`--set`) and the settings of a case, with included materials.
The stored job of an output directory is read as far as pictures and texts need it.

A sweep is a list of mappings from keys of the job to lists of values. Keys within one mapping change together; cases
are all combinations of the mappings, numbered from 0, with the last mapping changing fastest. Warnings about the cases
are shown once for each subject.
"""

from __future__ import annotations

import hashlib
import itertools
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from ..errors import Doubt, InputError, JobError, SweepWarnings
from . import yaml_text
from .listing import materials
from .model import NO_GRID, Job
from .parts import Included, Origin, log_range
from .yaml_text import (
    NOWHERE,
    UNREADABLE,
    Key,
    Mistake,
    Place,
    Source,
    faults_of,
    parse,
    quote,
    read_source,
    shorten,
    source_of,
)

SWEEP: Key = ("sweep",)
MAX_CASES = 1000  # tuning: most cases of a sweep
FIXED = ("sweep", "output.directory")  # keys that cannot be swept


class Setting(NamedTuple):
    """A value for a key, from a sweep, the command line or Python, with the places at which messages locate the key and
    the value."""

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


@dataclass(frozen=True)
class Sweep:
    """The sweep of a job. `axes` has one axis for each mapping of the sweep, and is empty for a job without a sweep.
    `place` is the place of the sweep in the job file."""

    axes: list[Axis]
    place: Place

    def __len__(self) -> int:
        """Return the number of cases, or 0 if the job has no sweep."""
        return math.prod(map(len, self.axes)) if self.axes else 0

    def case(self, index: int) -> tuple[Setting, ...]:
        """Return the settings of a case."""
        moves = next(itertools.islice(itertools.product(*self.axes), index, None))
        return tuple(itertools.chain(*moves))


def take_sweep(source: Source) -> Sweep | None:
    """Remove the sweep from the data of a job, and return the sweep. Return None if the sweep has mistakes, which are
    added to the mistakes of `source`."""
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
    elif other := next((one for one in seen if _overlap(source.data, one, name)), ""):
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


def _path_in(data: dict[str, Any], name: str) -> Key:
    """Return the path of a key in the data of a job, where `surface.0` also names a surface that is one mapping."""
    path = tuple(name.split("."))
    return ("surface", *path[2:]) if path[:2] == ("surface", "0") and isinstance(data.get("surface"), dict) else path


def _overlap(data: dict[str, Any], one: str, other: str) -> bool:
    """Return True if one key of the data of a job is equal to the other or within it."""
    outer, inner = sorted((_path_in(data, one), _path_in(data, other)), key=len)
    return inner[: len(outer)] == outer


def refuse_overrides(sweep: Sweep, overrides: list[Setting], source: Source) -> None:
    """Add a mistake to `source` for each override of a key that is swept."""
    names = {setting.name for axis in sweep.axes for setting in axis[0]}
    for override in overrides:
        if found := next((swept for swept in names if _overlap(source.data, swept, override.name)), ""):
            advice = f"change the sweep instead, like --set 'sweep=[{{{shorten(found)}: [...]}}]'"
            source.note(override.place, f"{shorten(found)} is swept; {advice}")


OURS = Path(__file__).parents[1] / "materials"  # compounds that come with the program


Change = str | tuple[str, Any]  # `key.path=value`, or a key and Python data


def read_job(
    path: Path, changes: Iterable[Change], case: int = 0, given: Source | None = None
) -> tuple[Source, tuple[Included, ...], Sweep | None]:
    """Return three things: the data of one case of a job, with overrides and included materials; the files of these
    materials; and the sweep of the job, or None if the sweep has mistakes.

    The file at `path` is not read if `given` is its content.
    """
    source = given or read_source(path, str(path))
    overrides = [override for change in changes if (override := _parse(change, source))]
    for override in (one for one in overrides if one.path[:1] == SWEEP):
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
    for override in (one for one in overrides if one.path in first):
        _apply(source, override)
    included = [_include(source, path, name, {} if "include" in own else own) for name, own in owns.items()]
    for override in (one for one in overrides if one.path not in first):
        _apply(source, override)
    return source, tuple(filter(None, included)), sweep


def _parse(change: Change, source: Source) -> Setting | None:
    """Return a change as a setting, or None if it has mistakes, which are added to `source`."""
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

    `auto` is replaced by a mapping of the keys that overrides set.
    """
    if not isinstance(source.data, dict):
        return
    node: Any = source.data
    found, given = Key(), _path_in(node, override.name)
    for index, name in enumerate(given):
        if isinstance(node, list) and str(name) in map(str, range(len(node))):
            name = int(name)
        elif not isinstance(node, dict):
            if node is not UNREADABLE:
                source.note(override.key_place, _dead_end(node, ".".join(map(str, found)), shorten(str(name))))
            return
        found = (*found, name)
        if index == len(given) - 1:
            source.put(found, override.value, override.key_place, override.place)
        elif isinstance(node, dict) and (
            node.get(name) is None or (node[name] == "auto" and not str(given[index + 1]).isdecimal())
        ):  # no value, or `auto`
            source.put(found, {}, override.key_place, override.key_place)
        node = node[name]


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
    relative = os.path.relpath(found)
    included = read_source(found, str(found) if relative.startswith("..") else relative)
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
    return Included(found.absolute(), hashlib.sha256(included.content).hexdigest(), section)


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


# -- jobs and cases ---------------------------------------------------------------------------------------------------


MANY_MISTAKES = 40  # tuning: largest number of mistakes that are all shown
SHOWN_MISTAKES = 20  # tuning: number of mistakes that are shown if there are more
STRICT = "an error with numerics.strict"
Given = str | os.PathLike[str] | Mapping[str, Any]
Changes = Sequence[str] | Mapping[str, Any]
FillGrid = Callable[[Source, Origin], Origin]
CASES = "cases"  # directory of all cases in the output directory of a job


class Case(NamedTuple):
    """A case of a sweep: its number, the values of the swept keys, and its job, with an output directory of its own.

    A job without a sweep is one case without settings, with the output directory of the job.
    """

    number: int
    settings: dict[str, Any]
    job: Job

    def __str__(self) -> str:
        settings = ", ".join(f"{key} = {value}" for key, value in self.settings.items())
        return f"case {self.number}: {settings}"


def load(given: Given, overrides: Changes = (), case: int | None = None, *, fill_grid: FillGrid | None = None) -> Job:
    """Return the job in a job file, or in a mapping with the same keys, whose paths start at the working directory.

    `overrides` are texts like `grid.points=512`, or a mapping of such keys to values. `fill_grid` replaces words of the
    grid, such as `points: auto`, by numbers (see `mesh.load`); if it is None, these words are mistakes. Raises JobError
    with all mistakes.

    For a job with a sweep `case` is the number of a case. Raises InputError if the sweep has no case of this number,
    and JobError if no number is given.
    """
    if case is not None:
        return select_cases(load_cases(given, overrides, fill_grid=fill_grid), case)[0].job
    found, mistakes, sweep = _read(given, overrides, 0, fill_grid)
    if found is None:
        raise _job_error(given, mistakes)
    if sweep:
        advice = "choose one of them (--case) or leave it out (--set sweep=null)"
        sentence = f"sweep has {len(sweep)} cases, numbered from 0; {advice}"
        raise JobError([str(Mistake(sweep.place, sentence))])
    return found.job


def load_cases(given: Given, overrides: Changes = (), *, fill_grid: FillGrid | None = None) -> tuple[Case, ...]:
    """Return all cases of a job, read as by `load`. A job without a sweep is one case. If only some cases have a
    mistake, its message names the first of these cases."""
    first, mistakes, sweep = _read(given, overrides, 0, fill_grid)
    if not sweep:
        if first is None:
            raise _job_error(given, mistakes)
        return (first,)
    read = [(first, mistakes), *(_read(given, overrides, index, fill_grid)[:2] for index in range(1, len(sweep)))]
    common = set(mistakes).intersection(*(found for _, found in read))
    first_with = {mistake: index for index, (_, found) in reversed(list(enumerate(read))) for mistake in found}
    if first_with:
        raise _job_error(given, [_in_case(*one, sweep, one[0] in common) for one in first_with.items()])
    return tuple(case for case, _ in read if case)


def select_cases(cases: Sequence[Case], number: int | None) -> Sequence[Case]:
    """Return all cases if `number` is None, else only the case with this number. Raises InputError if it does not
    exist."""
    if number is None:
        return cases
    if not cases[0].settings:
        raise InputError(f"--case {number}: the job has no sweep")
    if not 0 <= number < len(cases):
        raise InputError(f"--case {number}: the sweep has {len(cases)} cases, numbered from 0")
    return cases[number : number + 1]


def sentences_of(cases: Sequence[Case], doubts: Callable[[Job], Iterable[Doubt]]) -> list[str]:
    """Return the warnings about the jobs of cases as sentences, one per subject. If there are several cases, a sentence
    names those to which it belongs."""
    if len(cases) == 1:
        return list(dict.fromkeys(map(str, doubts(cases[0].job))))
    noted = SweepWarnings(at_once=False)
    for case in cases:
        noted.begin(case.number)
        for doubt in doubts(case.job):
            noted.shows(doubt)
    jobs = [case.job for case in cases]
    between = dict.fromkeys(asked for job in jobs for asked in job.asked("doubt_cases"))
    return [*noted.summary([noted.kinds]), *(str(doubt) for asked in between for doubt in asked(jobs))]


def _in_case(mistake: Mistake, index: int, sweep: Sweep, common: bool) -> Mistake:
    """Return a mistake with the number of its case, unless all cases have it or its place is in the sweep."""
    settings = sweep.case(index)
    if common or any(mistake.place in (one.place, one.key_place) for one in settings):
        return mistake
    return mistake._replace(sentence=f"{mistake.sentence} (in case {index}: {', '.join(map(str, settings))})")


def _read(
    given: Given, overrides: Changes, index: int, fill_grid: FillGrid | None
) -> tuple[Case | None, list[Mistake], Sweep | None]:
    """Return a case, or None; its mistakes; and its sweep, or None if the sweep has mistakes."""
    _refuse_no_job(given, overrides)
    from_python = isinstance(given, Mapping)
    path = Path("job.yaml" if isinstance(given, Mapping) else given)
    changes = overrides.items() if isinstance(overrides, Mapping) else overrides
    source, included, sweep = read_job(path, changes, index, source_of(given) if from_python else None)
    if source.data is UNREADABLE:
        return None, source.mistakes, sweep
    data = source.data if isinstance(source.data, dict) else {}
    output, stages = data.get("output"), data.get("history")
    names_directory = isinstance(output, dict) and output.get("directory") is not None
    texts = from_python or isinstance(overrides, Mapping)
    origin = Origin(path.absolute(), included, not from_python, texts, names_directory)
    keys = [("history", index, "approach") for index in range(len(stages) if isinstance(stages, list) else 0)]
    written = tuple(str(source.locate(key).place) for key in keys)
    strict = str(source.locate(("numerics", "strict")).place)
    origin = (fill_grid(source, origin) if fill_grid else origin)._replace(approaches=written, strict=strict)
    try:
        job = Job.model_validate(source.data, context=origin)
    except ValidationError as error:
        return None, [*source.mistakes, *_mistakes(source, error)], sweep
    if job.numerics.strict:
        for doubt in job.doubts:
            key = tuple(int(step) if step.isdigit() else step for step in (doubt.place or "numerics.strict").split("."))
            place = NOWHERE if from_python else source.locate(key).place
            source.mistakes.append(Mistake(place, f"{doubt} ({STRICT})"))
    if source.mistakes:
        return None, source.mistakes, sweep
    return _case(job, index, sweep), [], sweep


def _refuse_no_job(given: Any, overrides: Any) -> None:
    """Raise JobError for arguments from Python of a wrong type."""
    if not isinstance(given, str | os.PathLike | Mapping):
        raise JobError([f"the job must be the path of a file or a mapping, got {shorten(repr(given), 60)}"])
    if not isinstance(overrides, Sequence | Mapping) or isinstance(overrides, str):
        raise JobError([f"set must be a mapping of keys and values, got {shorten(repr(overrides), 60)}"])
    if wrong := [key for key in overrides if not isinstance(key, str)]:
        key = shorten(repr(wrong[0]), 60)
        raise JobError([f"set has a key that is not a text, {key}; use keys like 'grid.points'"])


def _case(job: Job, index: int, sweep: Sweep | None) -> Case:
    if not sweep or index >= len(sweep):
        return Case(index, {}, job)
    output = job.output.model_copy(update={"directory": job.output.directory / CASES / f"{index:03d}"})
    settings = {setting.name: setting.value for setting in sweep.case(index)}
    return Case(index, settings, job.model_copy(update={"output": output}))


def _job_error(given: Given, mistakes: list[Mistake]) -> JobError:
    """Return the error with the mistakes in the order of the file, and mistakes in other files last; a long list is
    cut."""
    own = "" if isinstance(given, Mapping) else str(Path(given))
    ordered = sorted(mistakes, key=lambda mistake: (mistake.place.origin != own, mistake.place))
    sentences = list(dict.fromkeys(map(str, ordered)))
    if len(sentences) > MANY_MISTAKES:
        sentences[SHOWN_MISTAKES:] = [f"... and {len(sentences) - SHOWN_MISTAKES} more mistakes"]
    return JobError(sentences)


def _mistakes(source: Source, error: ValidationError) -> Iterator[Mistake]:
    """Yield the faults of the sections with their places, except for data that could not be read."""
    for fault in faults_of(error):
        found = source.locate(fault.path)
        if found.readable:
            name = ".".join(shorten(str(step)) for step in found.path) or "the job"
            yield Mistake(found.key_place if fault.at_key else found.place, f"{name} {fault.predicate}")


SHOWN = (
    "title",
    "grid",
    "surface",
    "material",
    "initial",
    "history",
    "steady",
    "numerics",
    "adhesion",
    "interface",
    "counterbody",
    "body",
    "leakage",
    "bands",
)  # sections that pictures and texts need; others may differ between versions
SHOWN_NUMERICS = ("accuracy", "tolerance", "integrator")
LAST = "checkpoint"  # last section of a job with every default
FILES = ("file", "topography")  # shapes that come from files


def shown_job(path: Path) -> Job:
    """Return the stored job of an output directory, with flat shapes in place of files of heights and spectra, which
    may no longer exist."""
    try:
        text = path.read_bytes()
        data = yaml_text.parse(text, str(path)).data
        if not text.endswith(b"\n") or not isinstance(data, dict) or LAST not in data:
            raise InputError(f"{path} is incomplete: it lacks the section {LAST}; restore the whole file")
        data = {name: data[name] for name in SHOWN if name in data}
        numerics = data.get("numerics") or {}
        data["numerics"] = {name: numerics[name] for name in SHOWN_NUMERICS if name in numerics}
        data["surface"] = [
            {"shape": "flat"} if shape["shape"] in FILES or "spectrum" in shape else shape for shape in data["surface"]
        ]
        if data.pop("bands", None) is not None:  # pictures show tables only
            data["grid"], data["surface"] = NO_GRID, [{"shape": "flat"}]
        return Job.model_validate(data)
    except (OSError, KeyError, TypeError, ValidationError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error).partition("\n")[0]
        raise InputError(f"{path} cannot be read: {reason}") from error

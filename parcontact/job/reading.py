"""Reading of job files: one job, or the cases of a sweep; mistakes are reported with file, line and column.

The stored job of an output directory is read as far as pictures and texts need it.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from ..errors import InputError, JobError
from . import yaml_text
from .model import NO_GRID, Job
from .overrides import Sweep, read_job
from .parts import Origin
from .yaml_text import NOWHERE, UNREADABLE, Mistake, Place, Source, faults_of, shorten, source_of

MANY_MISTAKES = 40  # tuning: largest number of mistakes that are all shown
SHOWN_MISTAKES = 20  # tuning: number of mistakes that are shown if there are more
STRICT = "an error with numerics.strict"
Given = str | os.PathLike[str] | Mapping[str, Any]
Changes = Sequence[str] | Mapping[str, Any]
FillGrid = Callable[[Source, Origin], Origin]
CASES = "cases"  # directory of all cases in the output directory of a job


class Case(NamedTuple):
    """A case of a sweep: its number, its settings of the swept keys, and its job, with an output directory of its own.

    A job without a sweep is one case without settings, with the output directory of the job.
    """

    number: int
    settings: dict[str, Any]
    job: Job

    def __str__(self) -> str:
        settings = ", ".join(f"{key} = {value}" for key, value in self.settings.items())
        return f"case {self.number}: {settings}"


def leave_grid(source: Source, origin: Origin) -> Origin:
    """Return `origin` and leave words such as `points: auto` in the source, where they then count as mistakes."""
    return origin


def load(given: Given, overrides: Changes = (), case: int | None = None, *, fill_grid: FillGrid = leave_grid) -> Job:
    """Return the job in a job file, or in a mapping with the same keys, whose paths start at the working directory.

    `overrides` are texts like `grid.points=512`, or a mapping of such keys to values. `fill_grid` replaces words of the
    grid by numbers (see `mesh.load`). Raises JobError with all mistakes.

    For a job with a sweep `case` selects the case; raises InputError if there is none, or if none is selected.
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


def load_cases(given: Given, overrides: Changes = (), *, fill_grid: FillGrid = leave_grid) -> tuple[Case, ...]:
    """Return all cases of a job (one without a sweep), read as by `load`. A mistake names the first case that has
    it."""
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
    """Return all cases, or only the case with a number; raises InputError if there is none."""
    if number is None:
        return cases
    if not cases[0].settings:
        raise InputError(f"--case {number}: the job has no sweep")
    if not 0 <= number < len(cases):
        raise InputError(f"--case {number}: the sweep has {len(cases)} cases, numbered from 0")
    return cases[number : number + 1]


def _in_case(mistake: Mistake, index: int, sweep: Sweep, common: bool) -> Mistake:
    """Return a mistake with the number of its case, unless all cases have it or its place is in the sweep."""
    settings = sweep.case(index)
    if common or any(mistake.place in (one.place, one.key_place) for one in settings):
        return mistake
    return mistake._replace(sentence=f"{mistake.sentence} (in case {index}: {', '.join(map(str, settings))})")


def _read(
    given: Given, overrides: Changes, index: int, fill_grid: FillGrid
) -> tuple[Case | None, list[Mistake], Sweep | None]:
    """Return a case, or None; its mistakes; and its sweep, or None if the sweep has mistakes."""
    _refuse_no_job(given, overrides)
    from_python = isinstance(given, Mapping)
    path = Path("job.yaml" if isinstance(given, Mapping) else given)
    changes = overrides.items() if isinstance(overrides, Mapping) else overrides
    source, included, sweep = read_job(path, changes, index, source_of(given) if from_python else None)
    if source.data is UNREADABLE:
        return None, source.mistakes, sweep
    output = source.data.get("output") if isinstance(source.data, dict) else None
    names_directory = isinstance(output, dict) and output.get("directory") is not None
    texts = from_python or isinstance(overrides, Mapping)
    origin = Origin(path.absolute(), included, not from_python, texts, names_directory)
    stages = source.data.get("history") if isinstance(source.data, dict) else None
    count = len(stages) if isinstance(stages, list) else 0
    written = tuple(str(source.locate(("history", index, "approach")).place) for index in range(count))
    strict = str(source.locate(("numerics", "strict")).place)
    origin = fill_grid(source, origin)._replace(approaches=written, strict=strict)
    try:
        job = Job.model_validate(source.data, context=origin)
    except ValidationError as error:
        return None, [*source.mistakes, *_mistakes(source, error)], sweep
    if job.numerics.strict:
        places = [NOWHERE if from_python else _locate(source, doubt.place) for doubt in job.doubts]
        doubts = zip(places, job.doubts, strict=True)
        source.mistakes += [Mistake(place, f"{doubt} ({STRICT})") for place, doubt in doubts]
    if source.mistakes:
        return None, source.mistakes, sweep
    return _case(job, index, sweep), [], sweep


def _locate(source: Source, key: str) -> Place:
    """Return the place of a key such as `surface.0.amplitude`, or of `numerics.strict` without a key."""
    steps = tuple(int(step) if step.isdigit() else step for step in key.split("."))
    return source.locate(steps if key else ("numerics", "strict")).place


def _refuse_no_job(given: Any, overrides: Any) -> None:
    """Raise JobError for arguments from Python of a wrong type."""
    if not isinstance(given, str | os.PathLike | Mapping):
        raise JobError([f"the job must be the path of a file or a mapping, got {shorten(repr(given), 60)}"])
    if not isinstance(overrides, Sequence | Mapping) or isinstance(overrides, str):
        raise JobError([f"set must be a mapping of keys and values, got {shorten(repr(overrides), 60)}"])
    if wrong := [key for key in overrides if not isinstance(key, str)]:
        raise JobError(
            [f"set has a key that is not a text, {shorten(repr(wrong[0]), 60)}; use keys like 'grid.points'"]
        )


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
    "adhesion",
    "interface",
    "counterbody",
    "leakage",
    "bands",
)  # sections that pictures and texts need; others may differ between versions
LAST = "checkpoint"  # last section of a job with every default
FILES = ("file", "topography")  # shapes that come from files


def shown_job(path: Path) -> Job:
    """Return the stored job of an output directory, with flat shapes in place of files, which may no longer exist."""
    try:
        text = path.read_bytes()
        data = yaml_text.parse(text, str(path)).data
        if not text.endswith(b"\n") or not isinstance(data, dict) or LAST not in data:
            raise InputError(f"{path} is incomplete: it lacks the section {LAST}; restore the whole file")
        data = {name: data[name] for name in SHOWN if name in data}
        data["surface"] = [
            {"shape": "flat"} if shape["shape"] in FILES or "spectrum" in shape else shape for shape in data["surface"]
        ]
        if data.pop("bands", None) is not None:  # pictures show tables only
            data["grid"], data["surface"] = NO_GRID, [{"shape": "flat"}]
        return Job.model_validate(data)
    except (OSError, KeyError, TypeError, ValidationError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error).partition("\n")[0]
        raise InputError(f"{path} cannot be read: {reason}") from error

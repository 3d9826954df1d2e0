"""From a job file to jobs: one, or the cases of a sweep; every mistake is named with file, line and column."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from ..errors import InputError, JobError
from .measured import take_grid
from .model import Job, Origin
from .sections.part import Context
from .text.fault import faults_of
from .text.overrides import read_job
from .text.python_data import NOWHERE, numbers_for_texts, source_of
from .text.source import Key, Mistake, Place, Source, shorten
from .text.sweep_cases import Sweep

MANY_MISTAKES = 40  # more are not shown one by one
SHOWN_MISTAKES = 20  # of so many
STRICT = "an error with numerics.strict"
Given = str | os.PathLike[str] | Mapping[str, Any]
Changes = Sequence[str] | Mapping[str, Any]
CASES = "cases"  # where in the output directory of a job its cases have theirs


class Case(NamedTuple):
    """One case of a sweep: its number, what distinguishes it, and its job, with an output directory of its own.

    The only case of a job without a sweep has no settings, and the output directory of the job.
    """

    number: int
    settings: dict[str, Any]
    job: Job

    def __str__(self) -> str:
        settings = ", ".join(f"{key} = {value}" for key, value in self.settings.items())
        return f"case {self.number}: {settings}"


def load(given: Given, overrides: Changes = (), case: int | None = None) -> Job:
    """Reads a job file, or takes a mapping like one, whose files are looked for from the working directory.

    `overrides` are texts like `grid.points=512`, or values by such keys. Raises JobError with every mistake.

    Of a job with a sweep it reads one `case`, and raises InputError if none is chosen or there is no such case.
    """
    if case is not None:
        return choose(load_cases(given, overrides), case)[0].job
    found, mistakes, sweep = _read(given, overrides, 0)
    if found is None:
        raise JobError(_told(given, mistakes))
    if sweep:
        advice = "choose one of them (--case) or leave it out (--set sweep=null)"
        sentence = f"sweep has {len(sweep)} cases, numbered from 0; {advice}"
        raise JobError([str(Mistake(sweep.place, sentence))])
    return found.job


def load_cases(given: Given, overrides: Changes = ()) -> tuple[Case, ...]:
    """Reads all cases of a job, one if it has no sweep; else as `load`. A mistake names the first case that has it."""
    first, mistakes, sweep = _read(given, overrides, 0)
    if not sweep:
        if first is None:
            raise JobError(_told(given, mistakes))
        return (first,)
    read = [(first, mistakes), *(_read(given, overrides, index)[:2] for index in range(1, len(sweep)))]
    common = set(mistakes).intersection(*(told for _, told in read))
    found = {mistake: index for index, (_, told) in reversed(list(enumerate(read))) for mistake in told}
    if found:
        raise JobError(_told(given, [_in_case(*one, sweep, one[0] in common) for one in found.items()]))
    return tuple(case for case, _ in read if case)


def choose(cases: Sequence[Case], number: int | None) -> Sequence[Case]:
    """All cases, or the one of a number; raises InputError if there is none."""
    if number is None:
        return cases
    if not cases[0].settings:
        raise InputError(f"--case {number}: the job has no sweep")
    if not 0 <= number < len(cases):
        raise InputError(f"--case {number}: the sweep has {len(cases)} cases, numbered from 0")
    return cases[number : number + 1]


def _in_case(mistake: Mistake, index: int, sweep: Sweep, common: bool) -> Mistake:
    """A mistake, with the case that has it unless all have it or it points at the sweep itself."""
    settings = sweep.case(index)
    if common or any(mistake.place in (one.place, one.key_place) for one in settings):
        return mistake
    return mistake._replace(sentence=f"{mistake.sentence} (in case {index}: {', '.join(map(str, settings))})")


def _read(given: Given, overrides: Changes, index: int) -> tuple[Case | None, list[Mistake], Sweep | None]:
    """A case, or its mistakes; and the sweep that it belongs to, if that is sound."""
    _refuse_no_job(given, overrides)
    changes = tuple(overrides.items()) if isinstance(overrides, Mapping) else tuple(overrides)
    source, included, sweep = read_job(_path(given), changes, index, _data(given))
    if () not in source.broken:
        try:
            context = Context(_path(given).absolute(), included)
            take_grid(source, context)
            job = _validated(source, context)
            if job.numerics.strict:
                source.mistakes += [Mistake(_place(given), f"{text} ({STRICT})") for text in job.warnings]
            if not source.mistakes:
                origin = Origin(not isinstance(given, Mapping), _names_directory(source.data))
                return _case(job.of(origin), index, sweep), [], sweep
        except ValidationError as error:
            source.mistakes += _mistakes(source, error)
    return None, source.mistakes, sweep


def _refuse_no_job(given: Any, overrides: Any) -> None:
    """What Python gives may be anything."""
    if not isinstance(given, str | os.PathLike | Mapping):
        raise JobError([f"the job must be the path of a file or a mapping, got {shorten(repr(given), 60)}"])
    if not isinstance(overrides, Sequence | Mapping) or isinstance(overrides, str):
        raise JobError([f"set must be a mapping of keys and values, got {shorten(repr(overrides), 60)}"])
    if wrong := [key for key in overrides if not isinstance(key, str)]:
        raise JobError([f"set has a key that is no word, {shorten(repr(wrong[0]), 60)}; give words like 'grid.points'"])


def _path(given: Given) -> Path:
    return Path("job.yaml") if isinstance(given, Mapping) else Path(given)


def _place(given: Given) -> Place:
    return NOWHERE if isinstance(given, Mapping) else Place(str(Path(given)))


def _data(given: Given) -> Source | None:
    return source_of(given) if isinstance(given, Mapping) else None


def _validated(source: Source, context: Context) -> Job:
    """The job of a source; texts of Python data at which it fails are tried as numbers."""
    try:
        return Job.model_validate(source.data, context=context)
    except ValidationError as error:
        if not numbers_for_texts(source, [source.written(fault.path) for fault in faults_of(error)]):
            raise
    return _validated(source, context)


def _names_directory(data: Any) -> bool:
    output = data.get("output")
    return isinstance(output, dict) and output.get("directory") is not None


def _case(job: Job, index: int, sweep: Sweep | None) -> Case:
    if not sweep or index >= len(sweep):
        return Case(index, {}, job)
    output = job.output.model_copy(update={"directory": job.output.directory / CASES / f"{index:03d}"})
    settings = {setting.name: setting.value for setting in sweep.case(index)}
    return Case(index, settings, job.model_copy(update={"output": output}))


def _told(given: Given, mistakes: list[Mistake]) -> list[str]:
    ordered = sorted(mistakes, key=lambda mistake: (mistake.place.origin != _place(given).origin, mistake.place))
    return _first(list(dict.fromkeys(map(str, ordered))))


def _first(mistakes: list[str]) -> list[str]:
    """All mistakes, or the first of them and a count where they are more than anybody reads."""
    if len(mistakes) <= MANY_MISTAKES:
        return mistakes
    return [*mistakes[:SHOWN_MISTAKES], f"... and {len(mistakes) - SHOWN_MISTAKES} more mistakes"]


def _mistakes(source: Source, error: ValidationError) -> Iterator[Mistake]:
    """The faults that the sections found, at their places; not those about data that could not be read."""
    untrusted = source.untrusted()
    for fault in faults_of(error):
        path = source.written(fault.path)
        if path in untrusted or source.within_broken(path):
            continue
        place = source.key_place(path) if fault.at_key else source.place(path)
        yield Mistake(place, f"{_name(path)} {fault.predicate}")


def _name(path: Key) -> str:
    return ".".join(shorten(str(step)) for step in path) or "the job"

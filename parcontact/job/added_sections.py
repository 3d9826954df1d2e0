"""Sections that effects add to a job.

An effect of this package is found by its folder (`capabilities`). One of another package is registered under the name
of its section by an entry point that names its class (`effects.effect`):

    [project.entry-points."parcontact.effects"]
    wear = "tread_wear:Wear"

Effects are imported only for jobs that have their sections.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from types import ModuleType
from typing import Any

from .. import capabilities
from ..errors import InputError, RunError
from .sections.part import Part
from .text.fault import Fault, refuse

GROUP = "parcontact.effects"


def find_effects() -> dict[str, Any]:
    """Return all usable registered effects, by the name of their section."""
    return {section: _load(section) for section in _registered() if not why_unusable(section)}


def effects_of(sections: Iterable[str]) -> dict[str, Any]:
    """Return the effects registered for some sections, by section, in the order in which they follow a step. Raises
    ValidationError for an unusable effect."""
    found = [section for section in sections if section in _registered()]
    for section in found:
        if reason := why_unusable(section):
            refuse(Fault(reason, (section,), at_key=True))
    ours = {each.SECTION: each for each in capabilities.folders() if hasattr(each, "SECTION")}
    needs = {section: capabilities.needs_of(ours.get(section) or _load(section)) for section in found}
    return {section: _load(section) for section in capabilities.in_order(needs)}


def answers(module: str, name: str) -> list[Any]:
    """Return what capabilities offer under a name: those of this package in modules of one name, others in their
    classes."""
    others = (section for section in _registered() if not is_ours(section) and not why_unusable(section))
    found = [(section, getattr(_load(section), name)) for section in others if hasattr(_load(section), name)]
    return [*capabilities.offers(module, name), *(_named(*each) for each in found)]


def _named(section: str, offered: Any) -> Any:
    """Return what an effect of another package offers; functions name it in their errors."""

    def call(*given: Any) -> Iterator[Any]:
        with naming_effect(section):
            found = list(offered(*given))
        yield from found

    return call if callable(offered) else offered


@contextmanager
def naming_effect(section: str) -> Iterator[None]:
    """Raise RunError with the name of the effect if its code fails within the context, or tries to end the program."""
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
    others = {entry.name: entry for entry in entry_points(group=GROUP) if not _is_ours(entry)}
    return others | {each.SECTION: _entry_of(each) for each in capabilities.folders() if hasattr(each, "SECTION")}


def _entry_of(folder: ModuleType) -> EntryPoint:
    return EntryPoint(folder.SECTION, f"{folder.__name__}.effect:{folder.EFFECT}", GROUP)


def _is_ours(entry: EntryPoint) -> bool:
    """Return True for an effect of this package."""
    return entry.value.startswith(f"{__package__.partition('.')[0]}.")


def own_sections() -> list[str]:
    """Return the sections that effects of this package add."""
    return sorted(name for name, entry in _registered().items() if _is_ours(entry))


@cache
def _load(section: str) -> Any:
    return _registered()[section].load()


@cache
def why_unusable(section: str) -> str:
    """Return why the effect of a section cannot be used; '' if it can."""
    try:
        effect = _load(section)
        base = f"{Part.__module__}.{Part.__name__}"
        reason = "" if issubclass(effect.section, Part) else f"its section is not a subclass of {base}"
        if not _are_names(effect.columns):
            reason = f"its columns must be a tuple of different names, of letters, digits and _, got {effect.columns!r}"
    except (Exception, SystemExit) as error:  # code of other packages may raise anything
        reason = f"{type(error).__name__}: {error}"
    return reason and f"belongs to the effect {_registered()[section].value}, which cannot be used: {reason}"


def _are_names(columns: Any) -> bool:
    kind = isinstance(columns, tuple | list) and len(set(columns)) == len(columns)
    return kind and all(isinstance(name, str) and name.isidentifier() for name in columns)

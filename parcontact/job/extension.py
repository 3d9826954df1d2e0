"""Sections that effects add to a job: found by their name, and only when a job has a section that the program has not.

An effect is registered in one place: in OURS, or, without touching this package, by an entry point of an installed one,

    [project.entry-points."parcontact.effects"]
    wear = "tread_wear:Wear"

Either names the class of an effect (`effects.effect`) under the name of its section. Nothing is imported, or looked
for, for a job without such a section.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from .fault import Fault, refuse
from .part import Part

GROUP = "parcontact.effects"
OURS: dict[str, str] = {
    # one line for each effect of this package that has a section of its own: its name, and where the effect is
    "interface": "parcontact.effects.interface:InterfaceColumns",
}


def find_effects() -> dict[str, Any]:
    """Every registered effect, by the name of its section; raises ValidationError for one that cannot be loaded."""
    return {section: _load(section) for section in _registered()}


def effects_of(sections: Iterable[str]) -> dict[str, Any]:
    """The effects that have registered one of some sections, by the name of the section."""
    return {section: _load(section) for section in sections if section in _registered()}


@cache
def _registered() -> dict[str, EntryPoint]:
    installed = {entry.name: entry for entry in entry_points(group=GROUP)}
    return installed | {name: EntryPoint(name, target, GROUP) for name, target in OURS.items()}


@cache
def _load(section: str) -> Any:
    entry = _registered()[section]
    try:
        effect = entry.load()
        if issubclass(effect.section, Part):
            return effect
        reason = f"its section is no {Part.__module__}.{Part.__name__}"
    except Exception as error:  # whatever the code of somebody else does
        reason = f"{type(error).__name__}: {error}"
    refuse(Fault(f"belongs to the effect {entry.value}, which cannot be used: {reason}", (section,), at_key=True))

"""Capabilities: what a folder of `effects/` adds to the program. A folder that is deleted takes its capability with it.

A folder may have `SECTION`, the section of a job that asks for it, and `EFFECT`, its class in `effect.py`;
columns stand there, too (`stated`). Other rooms
find what its further modules offer by `offers`, and so name no capability. `GIVES` and `USES` name what an effect finds
in a step for others, and what it needs of others: effects that give something follow a step before those that use it.
With `MATERIAL = True` the section is a material, which may include a file. `CHANGES_STEPS` names the keys that change
steps which a run has completed, if these are not all keys of the section. `STAGE_KEYS` are the keys that a section adds
to stages."""

from collections.abc import Collection, Mapping
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType
from typing import Any

ROOM = f"{__package__}.effects"


@cache
def folders() -> tuple[ModuleType, ...]:
    """Return the packages of all capabilities; those that use something come after those that give it."""
    found = [each.name for each in iter_modules(import_module(ROOM).__path__) if each.ispkg]
    made = {name: import_module(f"{ROOM}.{name}") for name in found}
    return tuple(made[name] for name in in_order({name: needs_of(each) for name, each in made.items()}))


def needs_of(thing: Any) -> tuple[Collection[str], Collection[str]]:
    """Return what a capability gives to others, and what it uses of others."""
    return getattr(thing, "GIVES", ()), getattr(thing, "USES", ())


def in_order(needs: Mapping[str, tuple[Collection[str], Collection[str]]]) -> list[str]:
    """Return names in the order of the alphabet, but for those that use something, which come after those that give it.
    `needs` has what each gives and uses."""
    order, left = list[str](), sorted(needs)
    while left:
        given = {one: set(needs[one][0]) for one in left}
        free = (name for name in left if not any(given[one] & set(needs[name][1]) for one in left if one != name))
        order.append(next(free, left[0]))
        left.remove(order[-1])
    return order


def has(name: str) -> bool:
    """Return True if the folder of a capability exists."""
    return any(each.name == name for each in iter_modules(import_module(ROOM).__path__))


@cache
def _modules(name: str) -> tuple[ModuleType, ...]:
    made = (each for each in folders() if any(one.name == name for one in iter_modules(each.__path__)))
    return tuple(import_module(f"{each.__name__}.{name}") for each in made)


def stated(name: str) -> list[Any]:
    """Return what the folders themselves state under a name: columns and the like, which are there at once."""
    return [getattr(each, name) for each in folders() if hasattr(each, name)]


def offers(module: str, name: str) -> list[Any]:
    """Return what modules of one name offer under a name, one of each capability that has such a module."""
    return [getattr(each, name) for each in _modules(module) if hasattr(each, name)]

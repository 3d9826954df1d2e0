"""Capabilities: what a folder of `effects/` adds to the program. A folder that is deleted takes its capability with it.

A folder may have `SECTION`, the section of a job that asks for it, and `EFFECT`, its class in `effect.py`. Other rooms
find what its further modules offer by `offers`, and so name no capability.
"""

from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType
from typing import Any

ROOM = f"{__package__}.effects"


@cache
def folders() -> tuple[ModuleType, ...]:
    """Return the packages of all capabilities, in the order of their names."""
    found = iter_modules(import_module(ROOM).__path__)
    return tuple(import_module(f"{ROOM}.{each.name}") for each in found if each.ispkg)


def offers(module: str, name: str) -> list[Any]:
    """Return what modules of one name offer under a name, one of each capability that has such a module."""
    made = (each for each in folders() if any(one.name == module for one in iter_modules(each.__path__)))
    found = (import_module(f"{each.__name__}.{module}") for each in made)
    return [getattr(each, name) for each in found if hasattr(each, name)]

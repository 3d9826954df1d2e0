"""Capabilities: each folder of `effects/` adds one capability to the program, and a deleted folder removes this
capability.

The package of a folder may state `SECTION`, the section of a job that turns the capability on, `EFFECT`, the name of
its class in `effect.py`, columns of tables, and panels of columns (`Column` and `ColumnPanel`, found by `stated`).
Other rooms of the program call `offers` to find objects in the other modules of the folder, such as `results.py`, and
so name no capability. `GIVES` names quantities of a step that an effect computes for other effects, and `USES` names
quantities that it needs from other effects. An effect that gives a quantity acts before the effects that use it.
`MATERIAL = True` says that the section is a material, which may include a file, and `IN_SCENE = True` that all jobs of
a directory must have the same section. A run cannot continue if keys that change its completed steps get other values.
These keys are all keys of the section, or only the keys that `CHANGES_STEPS` names. `STAGE_KEYS` are the keys that a
section adds to stages.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from operator import attrgetter
from pkgutil import iter_modules
from types import ModuleType
from typing import Any

ROOM = f"{__package__}.effects"


@dataclass(frozen=True)
class Column:
    """A column of a table: its name, SI unit (`""` if dimensionless), and meaning as printed in the manual.

    `of` returns the value from a row; by default it is the attribute with the name of the column. `when` is the section
    or option of the job without which a table lacks the column.
    """

    name: str
    unit: str
    meaning: str
    of: Callable[[Any], Any] | None = None
    when: str = ""

    def value(self, row: Any) -> Any:
        """Return the value of this column for a row."""
        return (self.of or attrgetter(self.name))(row)


Table = Sequence[Column]


@dataclass(frozen=True)
class Axis:
    """The quantity of an axis and its SI unit."""

    name: str
    unit: str = ""


@dataclass(frozen=True)
class ColumnPanel:
    """A panel of columns of a table whose rows and horizontal axis are not chosen yet. `columns` maps the name of each
    curve to the name of its column."""

    key: str
    y: Axis
    columns: Mapping[str, str]


COUNTED = "number of points in contact over the number of all points"  # meaning of `contact_area`


@cache
def folders() -> tuple[ModuleType, ...]:
    """Return the packages of all capabilities; a package that uses something comes after the package that gives it."""
    found = [each.name for each in iter_modules(import_module(ROOM).__path__) if each.ispkg]
    made = {name: import_module(f"{ROOM}.{name}") for name in found}
    return tuple(made[name] for name in in_order({name: needs_of(each) for name, each in made.items()}))


def needs_of(thing: Any) -> tuple[Collection[str], Collection[str]]:
    """Return the names of the quantities that a capability gives to others in a step, and of those that it uses from
    others (`GIVES` and `USES` of its package, or of the class of its effect)."""
    return getattr(thing, "GIVES", ()), getattr(thing, "USES", ())


def in_order(needs: Mapping[str, tuple[Collection[str], Collection[str]]]) -> list[str]:
    """Return the names of capabilities in alphabetical order, except that a capability that uses something comes after
    the one that gives it. `needs` has what each capability gives and uses (`needs_of`)."""
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
def _with(module: str) -> tuple[ModuleType, ...]:
    """Return the packages of the capabilities that have such a module."""
    return tuple(each for each in folders() if any(one.name == module for one in iter_modules(each.__path__)))


def stated(name: str) -> list[Any]:
    """Return the objects called `name` in the packages of all capabilities, such as columns, without further
    imports."""
    return [getattr(each, name) for each in folders() if hasattr(each, name)]


def offers(module: str, name: str, job: Any = None) -> list[Any]:
    """Return the objects called `name` in the modules called `module` of all capabilities that have such a module. If a
    `job` is given, only capabilities whose sections the job has count, and other modules are not imported."""
    asked = (each for each in _with(module) if job is None or job.section(each.SECTION) is not None)
    made = (import_module(f"{each.__name__}.{module}") for each in asked)
    return [getattr(each, name) for each in made if hasattr(each, name)]

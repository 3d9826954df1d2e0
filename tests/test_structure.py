"""The way through the house: imports point down, and only some rooms know MPI."""

import ast
import graphlib
from collections.abc import Iterator
from pathlib import Path

import pytest

import parcontact

HOUSE = Path(parcontact.__file__).parent
MODULES = {".".join(path.relative_to(HOUSE).with_suffix("").parts): path for path in sorted(HOUSE.rglob("*.py"))}
FLOORS = [  # from the ground up; a room imports only from the floors below its own
    {"errors", "private", "streams"},
    {"compiled", "rubber"},
    {"parallel", "job"},
    {"physics", "road"},
    {"theory", "solve"},
    {"effects"},
    {"record"},
    {"rigid_surface"},
    {"scene"},
    {"march", "sanity"},
    {"steady_sliding"},
    {"run", "plan", "prediction"},
    {"doctor", "study", "report"},
    {"manual"},
    {"python"},
    {"__init__"},  # the front door, which names what the room python has
    {"command"},
    {"__main__"},
]
FLOOR = {room: number for number, rooms in enumerate(FLOORS) for room in rooms}
KNOW_MPI = {"python", "parallel", "record", "report", "command"}


def room(module: str) -> str:
    return module.split(".")[0]


def imports(module: str) -> Iterator[str]:
    """What a module imports, also for types only; our own names without `parcontact.`."""
    yield from _imports(module, ast.parse(MODULES[module].read_text()))


def imports_that_run(module: str) -> Iterator[str]:
    """The same without what is imported for types only."""
    tree = ast.parse(MODULES[module].read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            node.body = []
    yield from _imports(module, tree)


def _imports(module: str, tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.removeprefix("parcontact.") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            package = ["parcontact", *module.split(".")][: -node.level] if node.level else []
            source = ".".join(filter(None, [*package, node.module])).removeprefix("parcontact").removeprefix(".")
            names = [f"{source}.{alias.name}".removeprefix(".") for alias in node.names]
            yield from (name if name in MODULES else source for name in names)


OURS = {module: {name for name in imports(module) if room(name) in FLOOR} for module in MODULES}


@pytest.mark.parametrize("module", MODULES)
def test_imports_point_down(module: str) -> None:
    floor = FLOOR[room(module)]  # a new room needs a place in FLOORS
    assert not [name for name in OURS[module] if room(name) != room(module) and FLOOR[room(name)] >= floor]


def test_no_module_needs_itself() -> None:
    graphlib.TopologicalSorter(OURS).prepare()


@pytest.mark.parametrize("module", [module for module in MODULES if room(module) not in KNOW_MPI])
def test_only_some_rooms_know_mpi(module: str) -> None:
    assert not [name for name in imports_that_run(module) if room(name) == "mpi4py" or name.startswith("parallel.mpi")]


COMPARE = {"doctor", "record", "prediction", "command"}  # rooms that set theory beside results


def test_theory_stands_alone() -> None:
    """The oracle has nothing of ours but the moduli of a Prony series, and only what compares with it imports it."""
    theirs = {name for module, names in OURS.items() if room(module) == "theory" for name in names}
    assert {name for name in theirs if room(name) != "theory"} <= {"physics.prony"}
    users = {room(module) for module, names in OURS.items() if "theory" in map(room, names)}
    assert users - {"theory"} <= COMPARE

"""The house: imports point down, only some rooms know MPI, files are short, and objects change little."""

import ast
import graphlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import parcontact
from parcontact.columns import MEASURES, PER_BRANCH

HOUSE = Path(parcontact.__file__).parent
ROOT = Path(__file__).parents[1]
MODULES = {".".join(path.relative_to(HOUSE).with_suffix("").parts): path for path in sorted(HOUSE.rglob("*.py"))}
FLOORS = [  # from the ground up; a room imports only from the floors below its own
    {"capabilities", "printed"},
    {"columns", "compiled", "errors"},
    {"text_tables"},
    {"rubber"},
    {"parallel", "job"},
    {"paths"},  # of the surface over time, and measured maps
    {"physics"},
    {"accuracy"},
    {"theory", "contact"},
    {"effects"},
    {"files"},
    {"results"},
    {"march"},
    {"steady"},
    {"bands"},
    {"runs"},
    {"report"},
    {"door"},
    {"__init__"},  # the front door, which names what the room `door` has
    {"verbs"},
    {"__main__"},
]
FLOOR = {room: number for number, rooms in enumerate(FLOORS) for room in rooms}
KNOW_MPI = {"door", "verbs", "parallel", "files", "results", "report", "runs"}


def _on(floor: str, *modules: str) -> dict[str, str]:
    return dict.fromkeys(modules, floor)


STANDS_ON = {  # modules that stand on another floor than their room
    **_on("paths", "job.history", "job.map_files", "job.measured_maps"),
    **_on("accuracy", "march.time_error", "march.budget", "march.controller"),
    **_on("steady", "march.steady", "march.curve"),
    **_on("runs", "files.run", "files.sweep"),
    **_on("runs", "files.road_run"),
    **_on(
        "report", "results.page", "results.export", "results.report_sections", "results.prediction", "results.inputs"
    ),
    **_on("verbs", "door.arguments", "door.verbs"),
    **_on("physics", "effects.leakage.flow", "effects.heat.solver"),
    **_on("contact", "effects.stick.solver", "effects.adhesion.gap_solver"),
    **_on("report", "effects.leakage.over_time"),
}


FILES = {
    "__init__": "capabilities",
    "results": "results",
    "pictures": "results",
    "steady": "bands",
}  # that any capability may have, and who asks them


def room(module: str) -> str:
    """The floor on which a module stands: its room, but for modules of the table above."""
    first, *rest = module.split(".")
    file = FILES.get(rest[-1]) if first == "effects" and len(rest) == 2 else None
    return STANDS_ON.get(module) or file or first


def imports(module: str) -> Iterator[str]:
    """What a module imports, also for types only; our own names without `parcontact.`."""
    yield from _imports(module, ast.parse(MODULES[module].read_text()))


def _imports(module: str, tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.removeprefix("parcontact.") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            package = ["parcontact", *module.split(".")][: -node.level] if node.level else []
            source = ".".join(filter(None, [*package, node.module])).removeprefix("parcontact").removeprefix(".")
            names = [f"{source}.{alias.name}".removeprefix(".") for alias in node.names]
            yield from (name if name in MODULES else source for name in names)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.startswith("parcontact."):
            name = node.value.removeprefix("parcontact.").partition(":")[0]  # an import by a string
            yield from [name] if name in MODULES else []


@cache
def ours() -> dict[str, set[str]]:
    """Return the modules of rooms that each module imports."""
    return {module: {name for name in imports(module) if room(name) in FLOOR} for module in MODULES}


@pytest.mark.parametrize("module", MODULES)
def test_imports_point_down(module: str) -> None:
    floor = FLOOR[room(module)]  # a new room needs a place in FLOORS
    assert not [name for name in ours()[module] if room(name) != room(module) and FLOOR[room(name)] >= floor]


def test_no_module_needs_itself() -> None:
    graphlib.TopologicalSorter(ours()).prepare()


@pytest.mark.parametrize("module", [module for module in MODULES if room(module) not in KNOW_MPI])
def test_only_some_rooms_know_mpi(module: str) -> None:
    """Other rooms may import it for types only."""
    tree = ast.parse(MODULES[module].read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            node.body = []
    named = {alias.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert "MPI" not in named
    assert "mpi4py" not in map(room, _imports(module, tree))


COMPARE = {"door", "results", "report", "verbs"}  # rooms that set theory next to results


def test_theory_stands_alone() -> None:
    """The oracle has nothing of ours but the moduli of a Prony series, and only what compares with it imports it."""
    theirs = {name for module, names in ours().items() if room(module) == "theory" for name in names}
    assert {name for name in theirs if room(name) != "theory"} <= {"physics.prony"}
    users = {room(module) for module, names in ours().items() if "theory" in map(room, names)}
    assert users - {"theory"} <= COMPARE


MADE_BY = {  # which modules make objects of a kind
    **{kind: {"march.scene"} for kind in ("AnyFraction", "AlongX", "ElasticBody", "ElasticEnergy", "ZenerEnergy")},
    **{kind: {"march.scene"} for kind in ("ElasticPressure", "AppliedInverse", "Probe", "Setup", "Scene")},
    "ZenerBody": {"march.scene", "physics.energy"},  # a second one follows A^-1 u
    "ContactSolver": {"march.scene"},
    "HalfSpace": {"march.scene"},
    "SteadySolver": {"march.steady"},
    "SteadySliding": {"march.steady", "march.curve", "door.memory"},
    "March": {"march.steady"},
}


def makes(module: str) -> set[str]:
    """The kinds of MADE_BY that a module calls, or chooses between to call one."""
    nodes = list(ast.walk(ast.parse(MODULES[module].read_text())))
    called = [node.func for node in nodes if isinstance(node, ast.Call)]
    chosen = [choice for node in nodes if isinstance(node, ast.IfExp) for choice in (node.body, node.orelse)]
    return {ast.unparse(name).split(".")[-1] for name in (*called, *chosen)} & MADE_BY.keys()


def test_who_makes_what() -> None:
    """What steps are made of is made in scene.py alone."""
    found: dict[str, set[str]] = {kind: set() for kind in MADE_BY}
    for module in MODULES:
        for kind in makes(module):
            found[kind].add(module)
    assert found == MADE_BY


LONGEST_FILE = 600  # lines
MOST_THAT_CHANGES = 10  # attributes of an object that a reader has to follow
MAKERS = {"__init__", "__post_init__"}


@pytest.mark.parametrize("directory", [HOUSE, ROOT / "scripts", ROOT / "tests"], ids=lambda path: path.name)
def test_files_are_no_longer_than_can_be_read(directory: Path) -> None:
    lengths = {path.relative_to(directory): len(path.read_text().splitlines()) for path in directory.rglob("*.py")}
    assert not {name: lines for name, lines in lengths.items() if lines > LONGEST_FILE}


def changing(kind: ast.ClassDef) -> set[str]:
    """The attributes of its own objects that a class sets or deletes after they are made."""
    methods = [part for part in kind.body if isinstance(part, ast.FunctionDef) and part.name not in MAKERS]
    return {
        node.attr
        for method in methods
        for node in ast.walk(method)
        if isinstance(node, ast.Attribute) and not isinstance(node.ctx, ast.Load)
        if method.args.args and ast.unparse(node.value) == method.args.args[0].arg
    }


def test_what_changes_is_stated() -> None:
    """Plain, augmented and annotated assignments, those to several at once, of loops, of `with` and of `del`."""
    text = """
class Changing:
    kind: int = 0
    def __init__(self): self.made = 1
    def go(self, other):
        self.plain = self.read = 1
        self.more += 1
        self.stated: int = 1
        self.left, (self.right, *self.rest) = other
        for self.item in other: pass
        with other as self.opened: pass
        del self.gone
        self.held[0] = self.held.inner = other.own = self.made
"""
    (found,) = ast.parse(text).body
    assert isinstance(found, ast.ClassDef)
    assert changing(found) == {"plain", "read", "more", "stated", "left", "right", "rest", "item", "opened", "gone"}


def test_classes_change_little() -> None:
    kinds = [node for path in MODULES.values() for node in ast.walk(ast.parse(path.read_text()))]
    numbers = {kind.name: len(changing(kind)) for kind in kinds if isinstance(kind, ast.ClassDef)}
    assert max(numbers.values()) > 1
    assert not {name: number for name, number in numbers.items() if number > MOST_THAT_CHANGES}


def test_modules_have_a_name_of_their_own() -> None:
    """No two modules or folders of modules have one name, but a module may have that of its own folder, and
    capabilities have modules of the same names."""
    paths = [path for module in MODULES if len(path := module.split(".")) < 3 or path[0] != "effects"]
    folders = {tuple(path[:-1]) for path in paths if len(path) > 1}
    names = [folder[-1] for folder in folders]
    names += [path[-1] for path in paths if path[-1] not in ("__init__", *path[-2:-1])]
    assert {name: names.count(name) for name in names if names.count(name) > 1} == {}


FOR_USERS = {"theory", "verbs", "door"}  # rooms whose names are those that users write


def test_functions_have_a_name_of_their_own() -> None:
    """A public function of a module has a name that no other module gives to one, but for those that users write, those
    of the same thing that users write, and the answers of capabilities to one question."""
    found: dict[str, list[str]] = {}
    asked = [module for module in MODULES if module.startswith("effects.") and module.split(".")[-1] in FILES]
    for module, path in ((module, path) for module, path in MODULES.items() if module not in asked):
        functions = [part.name for part in ast.parse(path.read_text()).body if isinstance(part, ast.FunctionDef)]
        for name in (name for name in functions if not name.startswith("_") and room(module) not in FOR_USERS):
            found.setdefault(name, []).append(module)
    assert {name: modules for name, modules in found.items() if len(modules) > 1} == {}


def test_rows_are_annotated_with_every_column() -> None:
    """In the order of the registry: a new column of measures.csv needs its annotation in `door.simulation.Row`."""
    assert list(parcontact.Row.__annotations__) == [each.name for each in MEASURES if each.name != PER_BRANCH]

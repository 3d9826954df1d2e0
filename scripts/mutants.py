"""Break the code in random places, one at a time, and print the tests that detect it.

    .venv/bin/python scripts/mutants.py [--count 40] [--seed 0] [--list] [part ...]

A part is a file of the program with its own tests (see `tests_of`). In a function of each part a random operator,
comparison, sign, number or limit is changed to a wrong one. Some changes do not alter results, so tests must detect a
share of at least `SEEN` of all changes. The script works on a copy of the last commit, and takes some ten seconds per
change.
"""

import argparse
import ast
import os
import random
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
HOUSE, TESTS = ROOT / "parcontact", ROOT / "tests"
ROOMS = ("physics", "parallel", "contact", "march", "files", "effects", "job")
LONGEST = 600.0  # seconds for the tests of one change
SEEN = 0.8  # share of the changes that tests must detect
MOST_TESTS = 3  # files of tests of a part, of those that import it
FEWEST = 8  # least places to break in a part
SLIDING = "scenarios/test_sliding_runs.py"
OTHERS = {  # further tests of a part
    "march/loop.py": f"march/test_adhesive_steps.py scenarios/test_viscoelastic.py {SLIDING}",
    "march/state.py": SLIDING,
    "physics/body.py": "scenarios/test_viscoelastic.py physics/test_material.py",
    "effects/adhesion/adhesive_law.py": "effects/adhesion/test_gap_solver.py",
    **dict.fromkeys(("contact/problem.py", "contact/kernels.py"), "solve/test_contact.py solve/test_kernels.py"),
    "contact/certificate.py": "solve/test_iterate.py",
    "physics/energy.py": "physics/test_probe.py",
    "physics/loops.py": "physics/test_material.py physics/test_probe.py physics/test_surface.py physics/test_energy.py "
    "effects/heat/test_heat.py accuracy/test_embedded.py",
}
PAIRS = ((ast.Add, ast.Sub), (ast.Mult, ast.Div), (ast.Lt, ast.GtE), (ast.Gt, ast.LtE), (ast.Eq, ast.NotEq))
SWAPS: dict[type[ast.AST], type[ast.AST]] = {a: b for pair in PAIRS for a, b in (pair, pair[::-1])}
SWAPS |= {ast.And: ast.Or, ast.Or: ast.And}
NAMES = {"max": "min", "min": "max", "expm1": "exp", "exp": "expm1", "sin": "cos", "cos": "sin", "abs": "float"}
Change = tuple[str, Callable[[], None]]  # description, and a function that changes the tree


def tests_of(part: str) -> tuple[str, ...]:
    """Return the tests of a file of the program: the files that import it and name it most, and those of OTHERS."""
    path = Path(part)
    room = r"\.".join(path.parent.parts)
    name = re.compile(rf"from parcontact\.{room}(\.{path.stem} import| import .*\b{path.stem}\b)")
    texts = texts_of_tests()
    found = [test for test, text in texts.items() if name.search(text)]
    own = sorted(found, key=lambda test: -texts[test].count(path.stem))[:MOST_TESTS]
    own += [TESTS / name for name in OTHERS.get(part, "").split()]
    return tuple(str(path.relative_to(ROOT)) for path in own)


@cache
def texts_of_tests() -> dict[Path, str]:
    return {test: test.read_text() for test in sorted(TESTS.rglob("test_*.py"))}


def parts() -> list[str]:
    """Return the files of the program that can be broken in many places and have tests of their names."""
    files = [path for room in ROOMS for path in sorted((HOUSE / room).rglob("*.py"))]
    found = [path for path in files if len(list(changes(ast.parse(path.read_text())))) >= FEWEST]
    return [name for name in (str(path.relative_to(HOUSE)) for path in found) if tests_of(name)]


def changes(tree: ast.Module) -> Iterator[Change]:
    """Yield every possible change in the functions of a module, except in annotations, messages and indices."""
    for function in (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)):
        for statement in function.body:
            for node in ast.walk(statement):
                yield from _of(node, function.name)


def _of(node: ast.AST, where: str) -> Iterator[Change]:
    if (isinstance(node, ast.BinOp) and type(node.op) in SWAPS) or isinstance(node, ast.BoolOp):
        yield _swap(node, "op", where)
    elif isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in SWAPS:
        yield _swap(node, "ops", where)
    elif isinstance(node, ast.AugAssign) and type(node.op) in SWAPS:
        yield _swap(node, "op", where)
    elif isinstance(node, ast.Call) and _called(node) in NAMES:
        yield _rename(node.func, where)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield f"{where}: the sign of `{ast.unparse(node)}` is gone", lambda: _become(node, node.operand)
    elif isinstance(node, ast.Constant) and type(node.value) is float:
        value = node.value
        yield f"{where}: {value} becomes {value + 0.5}", lambda: setattr(node, "value", value + 0.5)


def _swap(node: ast.AST, name: str, where: str) -> Change:
    def act() -> None:
        old = getattr(node, name)
        setattr(node, name, [SWAPS[type(old[0])]()] if isinstance(old, list) else SWAPS[type(old)]())

    return f"{where}: the operator of `{ast.unparse(node)}` is another one", act


def _called(node: ast.Call) -> str:
    function = node.func
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")


def _rename(function: ast.expr, where: str) -> Change:
    name = "attr" if isinstance(function, ast.Attribute) else "id"
    old = getattr(function, name)
    return f"{where}: {old} becomes {NAMES[old]}", lambda: setattr(function, name, NAMES[old])


def _become(node: ast.UnaryOp, other: ast.expr) -> None:
    node.op, node.operand = ast.UAdd(), other


def draw(part: str, chance: random.Random, source: Path = ROOT) -> tuple[str, str]:
    """Return the description of a random change of a part, and the changed text of the file."""
    tree = ast.parse((source / "parcontact" / part).read_text())
    what, act = chance.choice(list(changes(tree)))
    act()
    return what, ast.unparse(tree)


def first_failure(tree: Path, files: tuple[str, ...]) -> str:
    """Return the first test that fails, '' without one."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *files]
    environment = {**os.environ, "PYTHONPATH": str(tree), "OMP_NUM_THREADS": "1"}
    try:
        ran = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True, timeout=LONGEST)
    except subprocess.TimeoutExpired:
        return f"not done in {LONGEST:g} s"
    if not ran.returncode:
        return ""
    seen = [line.split()[1] for line in ran.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return seen[0] if seen else f"exit code {ran.returncode}"


def try_out(part: str, text: str, tree: Path) -> str:
    """Return the first test that detects a change, '' without one; the file is restored."""
    path = tree / "parcontact" / part
    before = path.read_text()
    path.write_text(text)
    try:
        return first_failure(tree, tests_of(part))
    finally:
        path.write_text(before)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=40, help="number of changes")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--list", action="store_true", help="only list the changes")
    parser.add_argument("parts", nargs="*", metavar="part", help="files of the program, like solve/contact.py")
    chosen = parser.parse_args()
    chance = random.Random(chosen.seed)
    some = chosen.parts or parts()
    drawn = [(part, *draw(part, chance)) for part in (some[k % len(some)] for k in range(chosen.count))]
    if chosen.list:
        print("\n".join(f"{part} {what}" for part, what, _ in drawn))
        return 0
    unseen = 0
    with tempfile.TemporaryDirectory() as place:
        tree = Path(place)
        archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, check=True, capture_output=True).stdout
        subprocess.run(["tar", "-x", "-C", tree], input=archive, check=True)
        for part in dict.fromkeys(part for part, *_ in drawn):
            if failure := first_failure(tree, tests_of(part)):
                print(f"{part} as it is: {failure}", flush=True)
                return 1
        for part, what, text in drawn:
            began = time.monotonic()
            failure = try_out(part, text, tree)
            unseen += not failure
            print(f"{part} {what}: {failure or 'NOT SEEN'} ({time.monotonic() - began:.0f} s)", flush=True)
    print(f"{len(drawn) - unseen} of {len(drawn)} seen")
    return int(unseen > (1.0 - SEEN) * len(drawn))


if __name__ == "__main__":
    sys.exit(main())

"""Breaks the code in random places, one at a time, and says which of its tests see it.

    .venv/bin/python scripts/mutants.py [--count 40] [--seed 0] [--list] [part ...]

A part is a file of the program beside the tests that answer for it (PARTS below). In each a place is drawn at random in
a function: an operator, a comparison, a sign, a number or a limit is changed to a wrong one. No line of the source is
named here, so that the code may be written anew. Some changes alter nothing that matters (a limit that is never met, a
guard against what cannot happen): of all, at least `SEEN` must be seen. Works on a copy of the last commit in a
temporary directory. Some ten seconds a change.
"""

import argparse
import ast
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
LONGEST = 600.0  # seconds for the tests of one change
SEEN = 0.8  # share of the changes that must be seen
SURFACE = ("tests/physics/test_surface.py", "tests/physics/test_surface_forces.py")
CONTACT = tuple(f"tests/solve/test_contact{part}.py" for part in ("", "_symmetries", "_cost", "_failures"))
VISCOELASTIC = ("tests/scenarios/test_viscoelastic.py", "tests/scenarios/test_viscoelastic_scales.py")
SLIDING = tuple(f"tests/scenarios/test_sliding_{part}.py" for part in ("waves", "runs", "examples", "cost"))
PARTS = {  # files of the program, and the tests that answer for them
    "physics/body.py": ("tests/physics/test_material.py", *VISCOELASTIC),
    "physics/energy.py": ("tests/physics/test_energy.py",),
    "physics/wake.py": ("tests/physics/test_wake.py",),
    "physics/folding.py": ("tests/physics/test_folding.py", "tests/effects/test_folded_branches.py"),
    "physics/ledger.py": ("tests/physics/test_ledger.py",),
    "physics/loops.py": ("tests/physics/test_loops.py", "tests/physics/test_embedded.py", *SURFACE),
    "physics/embedded.py": ("tests/physics/test_embedded.py",),
    "physics/halfspace.py": ("tests/physics/test_halfspace.py", "tests/physics/test_love.py"),
    "physics/surface.py": (*SURFACE, "tests/physics/test_sliding.py"),
    "physics/roughness.py": ("tests/physics/test_roughness.py",),
    "physics/lowest.py": ("tests/physics/test_lowest.py", "tests/scene/test_rigid_surface.py"),
    "physics/budget.py": ("tests/physics/test_budget.py", "tests/run/test_half_mesh.py"),
    "physics/time_error.py": ("tests/physics/test_budget.py",),
    "parallel/fft.py": ("tests/parallel/test_fft.py",),
    "parallel/slab.py": ("tests/parallel/test_slab.py",),
    "solve/contact.py": (*CONTACT, "tests/robustness/test_descent.py"),
    "solve/constraint.py": ("tests/solve/test_constraint.py", *CONTACT),
    "solve/kernels.py": ("tests/solve/test_kernels.py", *CONTACT),
    "solve/nonsymmetric/steady.py": ("tests/steady_sliding/test_sliding.py",),
    "solve/nonsymmetric/projected.py": ("tests/solve/test_projected.py", "tests/steady_sliding/test_sliding.py"),
    "solve/local_load.py": ("tests/solve/test_local_load.py",),
    "solve/nonsymmetric/gcr.py": ("tests/solve/test_gcr.py",),
    "solve/fallback/active_set.py": ("tests/solve/test_active_set.py", "tests/march/test_step.py"),
    "march/choosing.py": (
        "tests/march/test_choosing.py",
        "tests/history/test_chosen.py",
        "tests/march/test_step_after_a_jump.py",
    ),
    "march/starts.py": ("tests/march/test_starts.py",),
    "march/state.py": ("tests/march/test_state.py", "tests/march/test_starts.py"),
    "march/errors.py": (
        "tests/scenarios/test_sliding_waves.py",
        "tests/history/test_chosen.py",
        "tests/run/test_half_mesh.py",
    ),
    "march/step.py": (*VISCOELASTIC, *SLIDING, "tests/march/test_step.py"),
    "march/rest.py": ("tests/march/test_rest.py",),
    "history/timeline.py": ("tests/history/test_timeline.py", *VISCOELASTIC),
    "history/chosen.py": ("tests/history/test_chosen.py", "tests/march/test_choosing.py"),
    "storage/checkpoint.py": ("tests/storage/test_checkpoint.py",),
    "plan/memory.py": ("tests/plan/test_memory.py", "tests/steady_sliding/test_start.py"),
}
SWAPS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Lt: ast.GtE,
    ast.GtE: ast.Lt,
    ast.Gt: ast.LtE,
    ast.LtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.And: ast.Or,
    ast.Or: ast.And,
}
NAMES = {"max": "min", "min": "max", "expm1": "exp", "exp": "expm1", "sin": "cos", "cos": "sin", "abs": "float"}
Change = tuple[str, Callable[[], None]]  # what is done, and doing it to the tree


def changes(tree: ast.Module) -> Iterator[Change]:
    """Every change that can be made in the functions of a module; annotations, messages and indices stay."""
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    for function in functions:
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
    """A change of a part: what it is, and the text of the file with it."""
    tree = ast.parse((source / "parcontact" / part).read_text())
    what, act = chance.choice(list(changes(tree)))
    act()
    return what, ast.unparse(tree)


def copy(target: Path) -> None:
    """The last commit."""
    archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, check=True, capture_output=True).stdout
    subprocess.run(["tar", "-x", "-C", target], input=archive, check=True)


def first_failure(tree: Path, files: tuple[str, ...]) -> str:
    """The first test that fails, '' if none does."""
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
    """The first test that sees a change, '' if none does; the file is then as it was."""
    path = tree / "parcontact" / part
    before = path.read_text()
    path.write_text(text)
    try:
        return first_failure(tree, PARTS[part])
    finally:
        path.write_text(before)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=40, help="changes that are tried")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--list", action="store_true", help="only say what would be changed")
    parser.add_argument("parts", nargs="*", metavar="part", choices=[[], *PARTS], help="files of the program")
    chosen = parser.parse_args()
    chance = random.Random(chosen.seed)
    parts = chosen.parts or list(PARTS)
    drawn = [(part, *draw(part, chance)) for part in (parts[k % len(parts)] for k in range(chosen.count))]
    if chosen.list:
        print("\n".join(f"{part} {what}" for part, what, _ in drawn))
        return 0
    unseen = 0
    with tempfile.TemporaryDirectory() as place:
        tree = Path(place)
        copy(tree)
        for part in dict.fromkeys(part for part, *_ in drawn):
            if failure := first_failure(tree, PARTS[part]):
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

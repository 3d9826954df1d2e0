"""Warnings are data, and each kind of them has one sentence."""

import ast
import pickle
from collections.abc import Iterator
from pathlib import Path

import parcontact
from parcontact.doubts import SENTENCES, Doubt
from parcontact.job import Job

HOUSE = Path(parcontact.__file__).parent


def made() -> Iterator[str]:
    """The kinds of all doubts that the program makes, as its source names them."""
    for path in HOUSE.rglob("*.py"):
        for scope in ast.walk(ast.parse(path.read_text())):
            if isinstance(scope, ast.FunctionDef):
                yield from _kinds(scope)


def _kinds(scope: ast.FunctionDef) -> Iterator[str]:
    """The texts that a function gives to `Doubt` first, also those of a variable `kind`."""
    calls = [node for node in ast.walk(scope) if isinstance(node, ast.Call)]
    first = [call.args[0] for call in calls if ast.unparse(call.func) == "Doubt"]
    named = {ast.unparse(each) for each in first if isinstance(each, ast.Name)}
    values = [
        node.value for node in ast.walk(scope) if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) in named
    ]
    for value in (*first, *values):
        for each in (value.body, value.orelse) if isinstance(value, ast.IfExp) else (value,):
            if isinstance(each, ast.Constant):
                yield str(each.value)


def test_each_kind_has_a_sentence_and_each_sentence_a_kind() -> None:
    assert set(made()) == SENTENCES.keys()


def test_numbers_in_sentences() -> None:
    """Shares in per cent, lengths with units, and how many times, also beyond all numbers."""
    contact = {"where": "step 3", "excess": 0.2031, "most": 0.15, "more": "128 points"}
    assert "about 20 % too large (limit: 15 %" in str(Doubt("cells", "", contact))
    text = str(Doubt("flat map", "surface", {"file": "a.npy", "lx": 1.23456e-3, "ly": 0.5, "span": 2.3456e-6}))
    assert text.startswith("surface: a.npy: the map is 1.235 mm x 500 mm, and its heights differ by 2.35 µm only")
    seam = {"axis": "x", "jump": 1e-6, "times": 3.14159, "tilt": 0.0}
    assert "3.14 times the largest step" in str(Doubt("seam", "surface", seam))
    assert "far above the largest step" in str(Doubt("seam", "surface", {**seam, "times": float("inf")}))


def test_jobs_have_doubts_and_their_sentences() -> None:
    data = {
        "grid": {"points": 16, "size": 1e-3},
        "surface": {"shape": "wave", "amplitude": 1e-3, "waves": [1, 0]},
        "material": {"model": "elastic", "shear_modulus": 1e13},
        "history": [{"pressure": 1e4}],
    }
    job = Job.model_validate(data)
    assert [(doubt.kind, doubt.place) for doubt in job.doubts] == [("steep", "surface"), ("hard", "material")]
    assert job.doubts[1].numbers == {"modulus": 1e13, "most": 1e12}
    assert job.warnings == tuple(map(str, job.doubts)) == tuple(map(str, pickle.loads(pickle.dumps(job.doubts))))

"""Every verb that comes after a run, once for each kind of result; and runs that are stopped early and go on."""

import re
import signal
from collections.abc import Sequence
from contextlib import chdir
from pathlib import Path
from typing import Any

import pytest
import yaml
from conftest import WORLD, Main
from csv_rows import rows
from legible import watch_pictures

from matrix.test_pairs import CURVE, HISTORY, SCENE, SECTIONS, job_of
from parcontact import __main__
from parcontact.door.arguments import NAMES
from parcontact.files.tables import GrowingTable

pytestmark = pytest.mark.skipif(WORLD.size > 1, reason="for one process")

Data = dict[str, Any]
MAPS: Data = {"output": {"fields": ["pressure", "gap"]}}
KINDS: dict[str, Data] = {  # kind of result: its job
    "history": {**SCENE, **HISTORY, **MAPS},
    "curve": job_of("steady"),
    "bands": job_of("bands"),
    "sweep": job_of("sweep"),
    "study": job_of("study"),
    "adhesion": {**job_of("adhesion"), **MAPS},
    "stick": {**job_of("stick"), "output": {"fields": ["pressure", "traction"]}},
    "heat": {**job_of("interface", "feedback"), "output": {"fields": ["pressure", "temperature"]}},
}
MODULI = "frequency [Hz],storage modulus [MPa],loss modulus [MPa]\n" + "".join(
    f"{f},{1.0 + f**2 / (1.0 + f**2)},{0.05 + f / (1.0 + f**2)}\n" for f in (0.01, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0)
)
VERBS: dict[str, tuple[str, str]] = {  # verb: its words, and the file that it promises, if it is always the same one
    "export": ("{out}", ""),  # before leak, whose table it exports
    "report": ("{out}", "{out}/report.html"),
    "plot": ("{out}", ""),
    "theory": ("{job} --out theory", "theory/**/*theory.csv"),
    "study": ("{job} --quiet --out studied", "studied/study.csv"),
    "leak": ("{out}", "{out}/leak.csv"),
    "info": ("{out}", ""),
    "cite": ("{out}", ""),
    "surface": ("{job} --out surface.png", "surface.png"),
    "fit": ("moduli.csv --job {job} --out compound.yaml", "compound.yaml"),
}
BEFORE_A_RESULT = {"run", "steady", "check", "plan", "doctor", "manual", "schema"}
REFUSED = {  # verb: what it refuses, and a part of the sentence
    "theory": {"adhesion": "excludes adhesion"},
    "study": dict.fromkeys(KINDS.keys() - {"study", "sweep"}, "no ladders") | {"sweep": "2 cases"},
    "leak": dict.fromkeys(("curve", "bands", "sweep", "study"), "no output directory of a run")
    | dict.fromkeys(("stick", "heat"), "leakage needs the gap"),
    "cite": dict.fromkeys(("sweep", "study"), "has no run"),
    "export": dict.fromkeys(("history", "sweep", "study", "adhesion", "stick", "heat"), "has no table for csv"),
    "surface": {"bands": "each with heights on a grid of its own", "sweep": "2 cases"},
    "fit": {"sweep": "2 cases"},
}


def test_all_verbs_are_tried() -> None:
    """A new verb needs a line of `VERBS`."""
    assert VERBS.keys() | BEFORE_A_RESULT == set(NAMES)


@pytest.fixture(scope="session")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Directories of jobs that have been run, by kind; filled when a kind is asked for."""
    return {name: tmp_path_factory.mktemp(name) for name in KINDS}


def made(home: Path, kind: str) -> Path:
    """Return the directory of a kind of result, whose job is run at the first call."""
    job = home / "job.yaml"
    if not job.exists():
        job.write_text(yaml.safe_dump(KINDS[kind]))
        (home / "moduli.csv").write_text(MODULI)
        with chdir(home):
            assert __main__.main(["study" if kind == "study" else "run", "job.yaml", "--quiet", "--out", "out"]) == 0
    return home


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_verb_of_a_kind(
    kind: str, verb: str, results: dict[str, Path], main: Main, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It ends with 0 and has made its file and legible pictures, or refuses in a sentence."""
    home = made(results[kind], kind)
    monkeypatch.chdir(home)
    words, promised = (text.format(job="job.yaml", out="out") for text in VERBS[verb])
    with watch_pictures():
        code, shown, said = main(verb, *words.split())
    assert "Traceback" not in shown + said
    refusal = REFUSED.get(verb, {}).get(kind)
    assert code == (0 if refusal is None else 2), said
    if refusal is not None:
        assert refusal in said
        return
    pictures = re.findall(r"(?m)^picture: (.*)", shown)
    assert all(Path(name).is_file() for name in pictures)
    assert not promised or list(Path().glob(promised))
    assert shown or promised
    assert pictures or verb != "plot"


# -- stopped early, and run again -------------------------------------------------------------------------------------

STEPS = {"pressure": 1e5, "velocity": 0.1, "distance": 1.25e-4, "cells_per_step": 0.1}  # 20
LONG: dict[str, tuple[Data, str]] = {  # kind: its job, and its table
    "history": ({**SCENE, "history": [STEPS]}, "measures.csv"),
    "curve": ({**SCENE, "steady": {**CURVE["steady"], "velocities": "0.001:10:5"}}, "steady.csv"),
    "sweep": ({**SCENE, "history": [STEPS], **SECTIONS["sweep"]}, "sweep.csv"),
}


def table(directory: Path, kind: str) -> list[dict[str, str]]:
    return [{key: text for key, text in row.items() if key != "seconds"} for row in rows(directory / LONG[kind][1])]


def stopped(how: str, main: Main) -> int:
    """Return the exit code of a run that is stopped early: by the wall time, which is over as this process is older,
    or by a signal after a row."""
    words = ("job.yaml", "--quiet", "--out", "out")
    if how == "wall":
        return main(*words, "--wall", "0:00:01")[0]
    append = GrowingTable.append

    def hit(self: GrowingTable, cells: Sequence[str]) -> None:
        append(self, cells)
        if cells[0][0].isdigit() and cells[0] != "0":  # no head, and no initial state
            signal.raise_signal(signal.Signals[how])

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(GrowingTable, "append", hit)
        return main(*words)[0]


@pytest.fixture(scope="session")
def references(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return {name: tmp_path_factory.mktemp(name) for name in LONG}


@pytest.mark.parametrize("how", ["SIGUSR1", "SIGTERM", "wall"])
@pytest.mark.parametrize("kind", LONG)
def test_a_stopped_run_goes_on(kind: str, how: str, references: dict[str, Path], main: Main, tmp_path: Path) -> None:
    """It ends with 3; the same command ends it with 0, and its table is that of a run in one piece."""
    whole = references[kind]
    if not (whole / "job.yaml").exists():
        (whole / "job.yaml").write_text(yaml.safe_dump(LONG[kind][0]))
        assert main(whole / "job.yaml", "--quiet", "--out", whole / "out")[0] == 0
    (tmp_path / "job.yaml").write_text((whole / "job.yaml").read_text())
    assert stopped(how, main) == 3
    assert main("job.yaml", "--quiet", "--out", "out")[0] == 0
    assert table(tmp_path / "out", kind) == table(whole / "out", kind)

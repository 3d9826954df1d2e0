"""The manual says what the program does: keys and columns are those of the code, and every block of code in it runs."""

import hashlib
import json
import re
import shlex
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import matplotlib
import numpy as np
import pytest
import yaml
from marching import ROOT
from pydantic import TypeAdapter

from parcontact import __main__, mesh
from parcontact.columns import TABLES
from parcontact.command.arguments import parse_arguments
from parcontact.job import schema
from parcontact.job.text import yamltext
from parcontact.manual import reference, texts

PAGES = texts.names()
NOTEBOOKS = sorted((texts.PAGES.parent / "notebooks").glob("*.ipynb"))
WHOLE: dict[str, Any] = {  # what a block of YAML that is not a whole job is put into
    "grid": {"points": 64, "size": 1.0e-3},
    "surface": {"shape": "flat"},
    "material": {"include": "synthetic_tyre"},
    "history": [{"pressure": 1.0e5, "velocity": 1.0, "distance": 1.0e-4, "cells_per_step": 1}],
}
OTHER_PROGRAMS = {  # in shell blocks; what is parcontact's is parsed
    *("apptainer", "cp", "docker", "env", "env/bin/pip", "module", "python3", "sbatch"),
    *("scripts/demo", "scripts/manual", "scripts/setup", "scripts/test", "."),
}


def blocks(language: str, name: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", texts.page(name, WRITERS), re.MULTILINE | re.DOTALL)


WRITERS = {"verbs": lambda: ""}
BLOCKS = [
    (language, name, index)
    for language in ("yaml", "sh", "toml")
    for name in PAGES
    for index in range(len(blocks(language, name)))
]


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A directory with the files that examples name."""
    np.save(tmp_path / "road.npy", np.random.default_rng(1).normal(size=(64, 64)))
    (tmp_path / "materials").mkdir()
    shift = {"law": "wlf", "C1": 8.86, "C2": 101.6, "reference": 20.0}
    compound = {"model": "zener", "modulus_inf": 1e6, "shift": shift}
    (tmp_path / "materials" / "compound.yaml").write_text(yaml.safe_dump(compound))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_table_of_contents_has_every_page() -> None:
    assert sorted(PAGES) == sorted({path.stem for path in texts.PAGES.glob("*.md")})


@pytest.mark.parametrize("name", PAGES)
def test_pages_refer_to_pages(name: str) -> None:
    assert set(re.findall(r"\{doc\}`(\w+)`", texts.page(name, WRITERS))) <= set(PAGES)
    assert "{doc}" not in texts.plain(name, WRITERS)
    assert ".. auto" not in texts.plain(name, WRITERS)


def test_only_languages_that_are_run_or_output() -> None:
    known = {"python", "yaml", "sh", "toml", "text", "{eval-rst}"}
    assert {word for name in PAGES for word in re.findall(r"^```(\S+)$", texts.page(name, WRITERS), re.M)} <= known


def test_the_page_on_python_is_text() -> None:
    """Calls and docstrings of what it names, with all methods of a simulation, and only some of a material."""
    text = texts.plain("python", WRITERS)
    assert "## pc.Simulation(job, set=None, comm=None)\n\nA job, run from Python" in text
    assert re.search(r"^pc\.Simulation +A job, run from Python on the ranks", text, re.MULTILINE)  # in a list of names
    for method in ("steps()", "run(restart='auto', quiet=True)", "row", "restore(path, set=None, comm=None)"):
        assert f"\n### {method}\n\n" in text
    assert re.findall(r"^### (.*)", text.partition("## Material")[2], re.MULTILINE) == [
        *("complex_modulus(omega)", "relaxation(t)", "creep(t)"),
    ]
    assert "{eval-rst}" not in text


# -- keys ------------------------------------------------------------------------------------------------------------


def test_every_key_has_its_meaning() -> None:
    """A key that was added needs a line in parcontact/manual/keys.yaml: [meaning, example]."""
    written = {part: set(known) for part, known in reference.meanings().items()}
    assert written == {section.part.__name__: {key.word for key in section.keys} for section in schema.sections()}


def examples() -> Iterator[Any]:
    for section in schema.sections():
        for key in section.keys:
            yield pytest.param(section.part, key.word, id=f"{section.part.__name__}.{key.word}")


@pytest.mark.parametrize(("part", "word"), list(examples()))
def test_the_example_of_a_key_is_right(part: Any, word: str, elsewhere: Path) -> None:
    """As the manual prints it, for the type of the key; a section as a whole is read by the tests of blocks."""
    if word in ("path", "material", "spectrum", "heights") or (part.__name__, word) == ("Job", "surface"):
        return  # files, arrays, and sections that tests of whole jobs read
    meaning, example = reference.meanings()[part.__name__][word]
    assert meaning.endswith(".")
    value = yamltext.parse(f"{word}: {example}", "example").data[word]
    field = part.model_fields[word]
    annotation: Any = Annotated[(field.annotation, *field.metadata)] if field.metadata else field.annotation
    TypeAdapter(annotation).validate_python(value)


def test_the_page_has_range_unit_and_default() -> None:
    text = texts.page("job")
    (hurst, *_) = re.findall(r"`hurst`\n: .*", text)
    assert "range: above 0 and at most 1; required" in hurst
    (keep,) = re.findall(r"`keep`\n: .*", text)
    assert "range: 0 or more; default: `2`" in keep
    assert re.search(r"`duration`\n: .*unit: s; optional", text)


# -- columns ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("file", TABLES)
def test_every_table_is_on_its_page(file: str) -> None:
    """The page has a section for each table, with all of its columns."""
    (section,) = re.findall(rf"^## {re.escape(file)}\n(.*?)(?=^## |\Z)", texts.page("outputs"), re.M | re.S)
    rows = re.findall(r"^\| `(\w+)` \| *([^|]*?) *\| [^|]+ \|$", section, re.M)
    assert rows == [(column.name, column.unit or "-") for column in TABLES[file]]


# -- blocks ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("language", "name", "index"), BLOCKS)
def test_a_block(language: str, name: str, index: int, elsewhere: Path) -> None:
    text = blocks(language, name)[index]
    if language == "yaml":
        load_job(text, elsewhere)
    elif language == "toml":
        tomllib.loads(text)
    else:
        for line in text.replace("\\\n", " ").splitlines():
            parse_command(line)


def load_job(text: str, where: Path) -> None:
    """A whole job, or sections of one."""
    data = yamltext.parse(text, "block").data
    without = {key for key, other in (("history", "steady"), ("grid", "bands")) if other in data}
    needed = {key: value for key, value in WHOLE.items() if key not in without}
    (where / "job.yaml").write_text(yamltext.dump({**needed, **data}))
    assert mesh.load_cases(where / "job.yaml")


def parse_command(line: str) -> None:
    """A command of this program is one that its parser takes."""
    asked = shlex.split(line)
    if asked[0] in ("mpirun", "srun"):
        asked = asked[3:]
    if asked[0] == "apptainer" or asked[0] in OTHER_PROGRAMS:
        return
    assert asked[0] in ("parcontact", "env/bin/parcontact"), line
    if asked[1] != "--version":
        parse_arguments(asked[1:])


@pytest.mark.parametrize("name", [name for name in PAGES if blocks("python", name) and name != "effects"])
def test_the_python_of_a_page(name: str, elsewhere: Path) -> None:
    """All blocks of a page, one after the other."""
    run_code(blocks("python", name))


@pytest.mark.filterwarnings("ignore:.*only 4 cells per shortest wave")
@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook(notebook: Path, elsewhere: Path) -> None:
    """Coarser than it stands."""
    cells = json.loads(notebook.read_text())["cells"]
    assert not any(cell.get("outputs") for cell in cells)
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    run_code([re.sub(r"POINTS = 128", "POINTS = 64", cell) for cell in code])


def run_code(pieces: list[str]) -> None:
    matplotlib.use("Agg")
    space: dict[str, Any] = {"__name__": "__main__"}
    for piece in pieces:
        exec(compile(piece, "block", "exec"), space)
    from matplotlib import pyplot

    pyplot.close("all")


# -- verbs -----------------------------------------------------------------------------------------------------------


def test_printing_pages(capsys: pytest.CaptureFixture[str]) -> None:
    assert __main__.main(["manual"]) == 0
    assert "outputs" in capsys.readouterr().out
    assert __main__.main(["manual", "command"]) == 0
    assert "--velocities" in capsys.readouterr().out
    assert __main__.main(["manual", "output"]) == 2
    assert "did you mean outputs?" in capsys.readouterr().err


# -- gallery ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", sorted((ROOT / "jobs").glob("*.yaml")), ids=lambda path: path.stem)
def test_the_picture_of_a_job_is_of_this_job(path: Path) -> None:
    """If not: scripts/gallery JOB."""
    recorded = (ROOT / "jobs" / "pictures" / "gallery" / f"{path.stem}.sha256").read_text().strip()
    data = json.dumps(yaml.safe_load(path.read_text()))
    assert recorded == hashlib.sha256(data.encode()).hexdigest()
    assert f"gallery/{path.stem}.png" in texts.page("gallery")


def test_the_version_of_the_citation() -> None:
    from parcontact import __version__

    assert yaml.safe_load((ROOT / "CITATION.cff").read_text())["version"] == __version__
    assert sys.version_info >= (3, 11)


def test_messages_name_pages_that_there_are() -> None:
    sources = [path.read_text() for path in (ROOT / "parcontact").rglob("*.py")]
    named = {page for text in sources for page in re.findall(r"\(see parcontact manual (\w+)\)", text)}
    assert named
    assert named <= set(PAGES)

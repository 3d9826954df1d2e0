"""The manual says what the program does: keys and columns are those of the code, and every block of code in it runs."""

import hashlib
import json
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import matplotlib
import numpy as np
import pytest
import yaml
from csv_rows import rows
from marched_jobs import JOBS, ROOT
from mpi4py import MPI
from pydantic import TypeAdapter

import parcontact as pc
from manual.printed import compare_lines
from parcontact import __main__
from parcontact.columns import TABLES
from parcontact.door import manual_texts
from parcontact.door.arguments import parse_arguments
from parcontact.job import model, yaml_text
from parcontact.march import mesh

PAGES = manual_texts.page_names()
NOTEBOOKS = sorted((manual_texts.PAGES.parent / "notebooks").glob("*.ipynb"))
WHOLE: dict[str, Any] = {  # what a block of YAML that is not a whole job is put into
    "grid": {"points": 64, "size": 1.0e-3},
    "surface": {"shape": "flat"},
    "material": {"include": "synthetic_tyre"},
    "history": [{"pressure": 1.0e5, "velocity": 1.0, "distance": 1.0e-4, "cells_per_step": 1}],
}
OTHER_PROGRAMS = {  # in shell blocks; what is parcontact's is parsed
    *("apptainer", "cp", "docker", "env", "env/bin/pip", "module", "python3", "rsync", "sbatch"),
    *("scripts/demo", "scripts/manual", "scripts/setup", "scripts/test", "."),
}


def blocks(language: str, name: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", manual_texts.page(name, WRITERS), re.MULTILINE | re.DOTALL)


OWN_TESTS = {"effects", "many_runs"}  # pages whose Python is run elsewhere
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
    (tmp_path / "measured").mkdir()
    (tmp_path / "measured" / "strain_sweep.csv").write_text("strain,f,g\n0.001,1,1\n1,0.3,0.5\n")
    (tmp_path / "materials").mkdir()
    shift = {"law": "wlf", "C1": 8.86, "C2": 101.6, "reference": 20.0}
    compound = {"model": "zener", "modulus_inf": 1e6, "shift": shift}
    (tmp_path / "materials" / "compound.yaml").write_text(yaml.safe_dump(compound))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_table_of_contents_has_every_page() -> None:
    assert sorted(PAGES) == sorted({path.stem for path in manual_texts.PAGES.glob("*.md")})


@pytest.mark.parametrize("name", PAGES)
def test_pages_refer_to_pages(name: str) -> None:
    assert set(re.findall(r"\{doc\}`(\w+)`", manual_texts.page(name, WRITERS))) <= set(PAGES)
    assert "{doc}" not in manual_texts.plain_page(name, WRITERS)
    assert ".. auto" not in manual_texts.plain_page(name, WRITERS)


def test_only_languages_that_are_run_or_output() -> None:
    known = {"python", "yaml", "sh", "toml", "text", "{eval-rst}"}
    assert {
        word for name in PAGES for word in re.findall(r"^```(\S+)$", manual_texts.page(name, WRITERS), re.M)
    } <= known


def test_the_page_on_python_is_text() -> None:
    """Calls and docstrings of what it names, with all methods of a simulation, and only some of a material."""
    text = manual_texts.plain_page("python", WRITERS)
    assert "## pc.Simulation(job, set=None, comm=None)\n\nA job, run from Python" in text
    assert re.search(r"^pc\.Simulation +A job, run from Python on the ranks", text, re.MULTILINE)  # in a list of names
    for method in ("steps()", "run(restart='auto', quiet=True)", "row", "restore(path, set=None, comm=None)"):
        assert f"\n### {method}\n\n" in text
    assert re.findall(r"^### (.*)", text.partition("## pc.Material")[2], re.MULTILINE) == [
        *("complex_modulus(omega)", "relaxation(t)", "creep(t)")
    ]
    assert "{eval-rst}" not in text


# -- keys ------------------------------------------------------------------------------------------------------------


def test_every_key_has_its_meaning() -> None:
    """A key that was added needs a line in parcontact/manual/keys.yaml: [meaning, example]."""
    written = {part: set(known) for part, known in manual_texts.meanings().items()}
    assert written == {section.part.__name__: {key.word for key in section.keys} for section in model.sections()}


def examples() -> Iterator[Any]:
    for section in model.sections():
        for key in section.keys:
            yield pytest.param(section.part, key.word, id=f"{section.part.__name__}.{key.word}")


@pytest.mark.parametrize(("part", "word"), list(examples()))
def test_the_example_of_a_key_is_right(part: Any, word: str, elsewhere: Path) -> None:
    """As the manual prints it, for the type of the key; a section as a whole is read by the tests of blocks."""
    if word in ("path", "material", "spectrum", "heights") or (part.__name__, word) == ("Job", "surface"):
        return  # files, arrays, and sections that tests of whole jobs read
    meaning, example = manual_texts.meanings()[part.__name__][word]
    assert meaning.endswith(".")
    value = yaml_text.parse(f"{word}: {example}", "example").data[word]
    field = part.model_fields[word]
    annotation: Any = Annotated[(field.annotation, *field.metadata)] if field.metadata else field.annotation
    TypeAdapter(annotation).validate_python(value)


def test_the_page_has_range_unit_and_default() -> None:
    text = manual_texts.page("job")
    (hurst, *_) = re.findall(r"`hurst`\n: .*", text)
    assert "range: above 0 and at most 1; required" in hurst
    (keep,) = re.findall(r"`keep`\n: .*", text)
    assert "range: 0 or more; default: `2`" in keep
    assert re.search(r"`duration`\n: .*unit: s; optional", text)


# -- columns ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("file", TABLES)
def test_every_table_is_on_its_page(file: str) -> None:
    """The page has a section for each table, with all of its columns."""
    (section,) = re.findall(rf"^## {re.escape(file)}\n(.*?)(?=^## |\Z)", manual_texts.page("outputs"), re.M | re.S)
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
    data = yaml_text.parse(text, "block").data
    without = {key for key, other in (("history", "steady"), ("grid", "bands")) if other in data}
    needed = {key: value for key, value in WHOLE.items() if key not in without}
    (where / "job.yaml").write_text(yaml_text.dump({**needed, **data}))
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


@pytest.mark.parametrize("name", [name for name in PAGES if blocks("python", name) and name not in OWN_TESTS])
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


def test_the_scripts_of_the_page_on_many_runs(elsewhere: Path, outside_mpi: dict[str, str]) -> None:
    """In two processes of a pool, and on two ranks: the areas of runs in this process."""
    processes, ranks, _ = blocks("python", "many_runs")
    expected = areas_of(processes)
    mpirun = [str(Path(sys.executable).with_name("mpirun")), "-n", "2"]
    for launcher, text in (([], processes), (mpirun, ranks)):
        Path("script.py").write_text(text)
        words = [*launcher, sys.executable, "-W", "error", "script.py"]
        done = subprocess.run(words, env=outside_mpi, capture_output=True, text=True, timeout=120)
        assert (done.stdout, done.stderr) == (expected, "")


def areas_of(script: str) -> str:
    """Return the output of a script, for its job and loads alone."""
    space: dict[str, Any] = {"__name__": "read"}
    exec(compile(script, "block", "exec"), space)
    runs = {load: pc.Simulation(space["JOB"], {"history.0.pressure": load}, MPI.COMM_SELF) for load in space["LOADS"]}
    return "".join(f"{load:.0f} Pa: {run.run().contact_area:.4f}\n" for load, run in runs.items())


def run_code(pieces: list[str]) -> None:
    matplotlib.use("Agg")
    space: dict[str, Any] = {"__name__": "__main__"}
    for piece in pieces:
        exec(compile(piece, "block", "exec"), space)
    from matplotlib import pyplot

    pyplot.close("all")


@pytest.mark.parametrize(("code", "again"), [(0, False), (3, True), (2, False)])
def test_the_batch_script(code: int, again: bool, tmp_path: Path) -> None:
    """With a launcher and an sbatch that note their words: it submits itself after exit code 3, and only then."""
    (script,) = [block for block in blocks("text", "cluster") if block.startswith("#!/bin/bash")]
    (tmp_path / "job.sh").write_text(script)
    for name, end in (("mpirun", code), ("sbatch", 0)):
        (tmp_path / name).write_text(f'#!/bin/bash\necho {name} "${{@: -2}}"\nexit {end}\n')
        (tmp_path / name).chmod(0o755)
    environment = {"PATH": f"{tmp_path}:/usr/bin:/bin", "PARCONTACT_BIN": str(tmp_path), "SLURM_NTASKS": "4"}
    words = ["bash", "job.sh", "job.yaml", "--quiet"]
    done = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=20)
    lines = ["mpirun job.yaml --quiet", *(["sbatch job.yaml --quiet"] if again else [])]
    assert (done.stdout.splitlines(), done.stderr) == (lines, "")
    assert done.returncode == (0 if again else code)


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
    assert f"gallery/{path.stem}.png" in manual_texts.page("gallery")


def test_the_version_of_the_citation() -> None:
    from parcontact import __version__

    assert yaml.safe_load((ROOT / "CITATION.cff").read_text())["version"] == __version__
    assert sys.version_info >= (3, 11)


def test_messages_name_pages_that_there_are() -> None:
    sources = [path.read_text() for path in (ROOT / "parcontact").rglob("*.py")]
    named = {page for text in sources for page in re.findall(r"\(see parcontact manual (\w+)\)", text)}
    assert named
    assert named <= set(PAGES)


# -- rEADME is short and true: its commands are parsed, its job is run, its files and pages exist ---------------------

README = (ROOT / "README.md").read_text()


def blocks_readme(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.M | re.S)


def test_length() -> None:
    assert len(README.splitlines()) <= 150


@pytest.mark.parametrize("line", [line for block in blocks_readme("sh") for line in block.splitlines()])
def test_a_command(line: str) -> None:
    parse_command(line)


def test_files_exist() -> None:
    linked = re.findall(r"\]\(([^)]+)\)", README)
    quoted = re.findall(r"`((?:scripts|jobs)/[^` ]+|[A-Z]+\.cff)`", README)
    assert linked
    assert quoted
    assert [name for name in (*linked, *quoted) if not (ROOT / name).exists()] == []


def test_it_names_the_pages_of_the_manual() -> None:
    (section,) = re.findall(r"^## Manual\n(.*?)^## ", README, re.M | re.S)
    lists = re.findall(r"^\* .*", section, re.M)
    assert [name for line in lists for name in re.findall(r"`(\w+)`", line)] == manual_texts.page_names()[1:]
    assert set(re.findall(r"parcontact manual (\w+)`", README)) <= set(manual_texts.page_names())


def test_the_first_job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """The block is the file, and the run prints what README says."""
    (block,) = blocks_readme("yaml")
    assert yaml_text.parse(block, "README").data == yaml_text.parse((JOBS / "slide.yaml").read_text(), "slide").data
    monkeypatch.chdir(tmp_path)
    assert __main__.main([str(JOBS / "slide.yaml"), "--quiet"]) == 0
    log = capsys.readouterr().out + (tmp_path / "out" / "slide" / "run.log").read_text()
    compare_lines(blocks_readme("text")[0], log)
    for words in ("plot", "report", "cite", "info"):  # as README has them, below its job and at its end
        assert f"parcontact {words} out/slide" in README or words == "info"
        assert __main__.main([words, "out/slide"]) == 0
    assert "Bugnicourt" in capsys.readouterr().out


def test_the_first_picture_is_of_the_first_job() -> None:
    """README begins with the picture of the job that it explains, and scripts/demo runs and draws the same job."""
    first, *_ = re.findall(r"!\[[^]]+\]\(([^)]+)\)", README)
    assert first == "jobs/pictures/gallery/slide.png"
    demo = (ROOT / "scripts" / "demo").read_text().partition("<<'END'")[0]
    assert re.findall(r"parcontact ((?:plot )?\S+)$", demo, re.M) == ["jobs/slide.yaml", "plot out/slide"]


def test_a_road_and_a_rubber(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The commands of README on a table of heights and one of moduli, of a body whose moduli are known."""
    monkeypatch.chdir(tmp_path)
    x, y = np.meshgrid(np.arange(16) / 16, np.arange(16) / 16)
    np.savetxt("road.txt", 0.5 * np.cos(2 * np.pi * (2 * x + y)) + 0.3 * np.cos(2 * np.pi * 3 * y))
    f = np.logspace(-1, 5, 25)
    z = 2 * np.pi * f * 1e-3
    moduli = 3 * (1 + 9 * z**2 / (1 + z**2)), 3 * 9 * z / (1 + z**2)  # [MPa], tension
    np.savetxt("compound.csv", np.transpose([f, *moduli]), delimiter=",", header="f[Hz],E'[MPa],E''[MPa]", comments="")
    (block,) = (block for block in blocks_readme("sh") if "compound.csv" in block)
    for line in block.splitlines():
        words = shlex.split(line.removeprefix("mpirun -n 2 "))
        assert __main__.main([*words[1:], *(["--quiet"] if "steady" in words else [])]) == 0, line
    (modulus,) = re.findall(r"material.modulus_inf +(\S+)", capsys.readouterr().out)
    assert float(modulus) == pytest.approx(1e6, rel=0.05)  # the fit's error is 2 % (rms)
    assert len(Path("out/job/steady.csv").read_text().splitlines()) == 1 + 9
    assert Path("out/job/report.html").is_file()


# -- the jobs of the page "Which settings?": each runs, meets its accuracy without a warning, has the numbers ---------

CASES = re.findall(r"^```yaml\n(title: .*?)^```\n(.*?)(?=^```yaml|\Z)", manual_texts.page("settings"), re.M | re.S)


def test_the_four_users() -> None:
    assert len(CASES) == 4


@pytest.mark.parametrize(("job", "after"), CASES, ids=["tyre", "seal", "indenter", "student"])
def test_a_job(
    job: str, after: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("job.yaml").write_text(job)
    assert __main__.main(["job.yaml", "--quiet"]) == 0
    assert "warning" not in capsys.readouterr().err
    log = (tmp_path / "out" / "job" / "run.log").read_text()
    assert log.count("; within the") == log.count("estimated error of") > 0  # as budget.advice says
    for text in re.findall(r"^```text\n(.*?)^```", after, re.M | re.S):
        compare_lines(text, log)
    compare_table(after, Path("out/job/measures.csv"))


def compare_table(text: str, path: Path) -> None:
    """Hold each line of a table of columns to a row of measures.csv: three digits are printed, and machines round."""
    head = re.search(r"^(\| `\w+` (?:\| `\w+` )+\|)\n\|[-|]+\n((?:\|.*\n)+)", text, re.M)
    if head is None:
        return
    names = re.findall(r"`(\w+)`", head[1])
    for line in head[2].splitlines():
        expected = [float(cell) for cell in line.strip("|").split("|")]
        found = [[float(row[name] or "nan") for name in names] for row in rows(path)]
        assert any(each == pytest.approx(expected, rel=0.05, abs=1e-40) for each in found), (names, expected)


# -- pages in a terminal of 80 letters: no prose is wider, code is as it was, no word is lost -------------------------

TABLE_LINES = re.compile(r"^\|.*\n?", re.MULTILINE)


@pytest.mark.parametrize("name", manual_texts.page_names())
def test_prose_is_not_wider(name: str) -> None:
    text = manual_texts.plain_page(name, {"verbs": lambda: ""})
    prose = manual_texts.CODE.sub("", text)
    wide = [line for line in prose.splitlines() if len(line) > 80 and not line.startswith(("#", "!["))]
    assert not [line for line in wide if " " in line.strip()]


@pytest.mark.parametrize("name", manual_texts.page_names())
def test_no_word_is_lost(name: str) -> None:
    text = manual_texts.FENCE.sub("", manual_texts.page(name, {"verbs": lambda: ""}))
    found = manual_texts.wrapped(text, 80)
    assert manual_texts.CODE.findall(found) == manual_texts.CODE.findall(text)
    plain = TABLE_LINES.sub("", text)
    assert manual_texts.wrapped(plain, 80).split() == plain.split()
    printed = " ".join(found.split())
    for line in TABLE_LINES.findall(manual_texts.CODE.sub("", text)):
        if not manual_texts.RULE.match(line):
            cells = [" ".join(cell.replace(r"\|", "|").split()) for cell in manual_texts.BAR.split(line.strip())]
            assert [cell for cell in cells if cell not in printed] == []


def test_a_table_that_fits_has_even_columns() -> None:
    """Nineteen letters hold the widest cells and two blanks between columns; a bar in a cell is none of the table."""
    text = "| a | b | c |\n|---|---|---|\n| `x\\|y` | 1 | two three |\n"
    even = ["a      b  c", "-----  -  ---------", "`x|y`  1  two three"]
    assert manual_texts.wrapped(text, 19).splitlines() == even
    assert manual_texts.wrapped(text, 18).splitlines() != even


def test_lists_keys_and_tables() -> None:
    """Items hang, keys and examples keep their lines; a row of a wide table is a block under its first cell."""
    text = (
        "* one two three\n  four five\n\n`key`\n: what it means\n  Example: `key: 1`\n\n| a | b | c |\n|---|---|---|\n"
    )
    assert manual_texts.wrapped(f"{text}| row | one | two three four |\n| next | no | no |", 16).splitlines() == [
        "* one two three",
        "  four five",
        "",
        "`key`",
        ": what it means",
        "  Example: `key:",
        "  1`",
        "",
        "",
        "a: row",
        "  b: one",
        "  c: two three",
        "    four",
        "",
        "a: next",
        "  b, c: no",
    ]

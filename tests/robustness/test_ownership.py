"""Whose an output directory is: nothing of another run or of a user is replaced, followed or lost."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import short_job
import yaml
from restarting import ROUGH

from parcontact import __main__
from parcontact.march.loop import March

JOB: dict[str, Any] = {
    **short_job.JOB,
    "history": [{"pressure": 1e4, "velocity": 0.1, "distance": 6.25e-4, "cells_per_step": 1}],
    "output": {"fields": ["pressure"]},
    "checkpoint": {"every": 1, "keep": 100},
}
STEPS = 11  # a jump and 10 cells
DONE, FAILED, BAD_INPUT, AGAIN = 0, 1, 2, 3
Main = Callable[..., tuple[int, str]]
Contents = dict[str, bytes]


def write_job(path: Path, **changes: Any) -> Path:
    """A file of JOB with some sections exchanged."""
    path.write_text(yaml.safe_dump({**JOB, **changes}))
    return path


def contents(directory: Path) -> Contents:
    """All files of a directory but the marker."""
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in sorted(directory.rglob("*"))
        if path.is_file() and path.name != ".parcontact"
    }


def steps(out: Path) -> list[int]:
    """The steps of which a run has written rows."""
    lines = (out / "measures.csv").read_text().splitlines()[1:]
    return [int(line.split(",")[0]) for line in lines]


# -- the command line where a job is, and what happens while it runs --------------------------------------------------


@pytest.fixture
def main(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Main:
    """The command line in this process and in `tmp_path`, where job.yaml is: exit code, all that it says."""
    monkeypatch.chdir(tmp_path)
    write_job(tmp_path / "job.yaml")

    def run(*words: str) -> tuple[int, str]:
        capsys.readouterr()
        code = __main__.main([*words, "--quiet"] if words[0] not in ("info", "plot") else words)
        said = capsys.readouterr()
        assert "Traceback" not in said.err
        return code, said.out + said.err

    return run


@pytest.fixture
def at_step(monkeypatch: pytest.MonkeyPatch) -> Callable[[int, Callable[[], Any]], None]:
    """`at_step(n, act)`: something happens while a run makes its step n."""

    def disturb(number: int, act: Callable[[], Any]) -> None:
        advance = March.advance

        def advanced(self: March, step: Any) -> Any:
            row = advance(self, step)
            if step.number == number:
                act()
            return row

        monkeypatch.setattr(March, "advance", advanced)

    return disturb


# -- which checkpoint is of this run ----------------------------------------------------------------------------------


def other_spelling(out: Path) -> Path:
    return out.parent / "out" / ".." / out.name / "checkpoint" / "step-5.h5"


def symlink(out: Path) -> Path:
    path = out.parent / "link.h5"
    path.symlink_to(out / "checkpoint" / "step-5.h5")
    return path


def copy_elsewhere(out: Path) -> Path:
    return Path(shutil.copy(out / "checkpoint" / "step-5.h5", out.parent / "copy.h5"))


@pytest.mark.parametrize("spelt", [other_spelling, symlink, copy_elsewhere])
def test_checkpoint_of_the_same_run_under_another_name(
    main: Main, tmp_path: Path, spelt: Callable[[Path], Path]
) -> None:
    """It is known by what it is, not by its path: rows, maps and other checkpoints stay."""
    out = tmp_path / "out"
    assert main("job.yaml", "--out", "out")[0] == DONE
    rows, maps = (out / "measures.csv").read_bytes(), (out / "fields.h5").read_bytes()
    code, said = main("job.yaml", "--out", "out", "--until", "0.003", "--restart", str(spelt(out)))
    assert (code, said) == (DONE, "")
    now = (out / "measures.csv").read_bytes()
    assert now.splitlines()[:7] == rows.splitlines()[:7]
    assert steps(out)[-1] < STEPS
    assert {path.name for path in out.glob("checkpoint/*.aside")} == {f"step-{n}.h5.aside" for n in range(6, STEPS + 1)}
    with h5py.File(out / "fields.h5") as file:
        assert not np.isnan(file["t"][:5]).any()
    assert len(maps) == (out / "fields.h5").stat().st_size


def test_checkpoint_of_another_run(main: Main, tmp_path: Path) -> None:
    """It clears nothing where a run is; in a new directory it is a beginning."""
    main("job.yaml", "--out", "one")
    main("job.yaml", "--out", "two")
    before = contents(tmp_path / "two")
    code, said = main("job.yaml", "--out", "two", "--restart", "one/checkpoint/step-5.h5")
    assert code == BAD_INPUT
    assert "one/checkpoint/step-5.h5 belongs to another run than two, which has measures.csv, fields.h5" in said
    assert contents(tmp_path / "two") == before
    assert main("job.yaml", "--out", "three", "--restart", "one/checkpoint/step-5.h5")[0] == DONE
    assert steps(tmp_path / "three") == list(range(6, STEPS + 1))


# -- results without what they could be made again from ---------------------------------------------------------------


def test_finished_run_without_its_checkpoints(main: Main, tmp_path: Path) -> None:
    """The same command replaces nothing; with --restart never it does as it is asked."""
    out = tmp_path / "out"
    main("job.yaml", "--out", "out")
    shutil.rmtree(out / "checkpoint")
    before = contents(out)
    code, said = main("job.yaml", "--out", "out")
    assert code == BAD_INPUT
    assert "out has measures.csv, fields.h5 of a run that has finished at t = " in said
    assert "but its checkpoints are missing; give --restart never to start from the beginning" in said
    assert contents(out) == before
    assert main("job.yaml", "--out", "out", "--restart", "never")[0] == DONE


def test_results_of_unknown_origin(main: Main, tmp_path: Path) -> None:
    """Files that bear our names, without a marker, are somebody's: refused, or put aside when asked to."""
    out = tmp_path / "out"
    out.mkdir()
    for name in ("measures.csv", "fields.h5", "job.yaml", "notes.txt"):
        (out / name).write_text(f"my {name}")
    before = contents(out)
    code, said = main("job.yaml", "--out", "out")
    assert code == BAD_INPUT
    assert (
        "out is not empty and was not made by this program: it has fields.h5, job.yaml, measures.csv, notes.txt; "
        in said
    )
    assert contents(out) == before
    assert main("job.yaml", "--out", "out", "--restart", "never")[0] == DONE
    after = contents(out)
    assert after["notes.txt"] == b"my notes.txt"
    for name in ("measures.csv", "fields.h5", "job.yaml"):
        assert after[f"{name}.aside"] == before[name]
        assert after[name] != before[name]


def test_working_directory_as_output(main: Main, tmp_path: Path) -> None:
    """The directory of the job alone will do; one with other files will not, and theirs are as they were."""
    (tmp_path / "alone").mkdir()
    given = write_job(tmp_path / "alone" / "job.yaml").read_bytes()
    assert main("alone/job.yaml", "--out", "alone")[0] == DONE
    assert (tmp_path / "alone" / "job.yaml").read_bytes() == given
    assert main("alone/job.yaml", "--out", "alone")[0] == DONE
    (tmp_path / "shared").mkdir()
    write_job(tmp_path / "shared" / "mine.yaml")
    (tmp_path / "shared" / "job.yaml").write_text("unrelated")
    before = contents(tmp_path / "shared")
    code, said = main("shared/mine.yaml", "--out", "shared")
    assert code == BAD_INPUT
    assert "it has job.yaml" in said
    assert contents(tmp_path / "shared") == before


def test_copy_that_has_lost_its_marker(main: Main, tmp_path: Path) -> None:
    """A sealed checkpoint proves a directory as well, as after `cp out/* elsewhere`."""
    main("job.yaml", "--out", "out", "--until", "0.003")
    shutil.copytree(tmp_path / "out", tmp_path / "copy", ignore=shutil.ignore_patterns(".parcontact"))
    assert main("job.yaml", "--out", "copy")[0] == DONE
    assert steps(tmp_path / "copy") == list(range(STEPS + 1))


def test_another_job_that_left_no_checkpoint(main: Main, tmp_path: Path) -> None:
    """Rows of a run that was killed early are made again by its own job only."""
    main("job.yaml", "--out", "out")
    out = tmp_path / "out"
    for path in (out / "checkpoint").iterdir():
        path.unlink()
    marker = json.loads((out / ".parcontact").read_text())
    marker["run"] |= {"saved": False, "finished": None}
    (out / ".parcontact").write_text(json.dumps(marker))
    before = contents(out)
    code, said = main("job.yaml", "--out", "out", "--set", "material.modulus_inf=2e6")
    assert code == BAD_INPUT
    assert "of another job: material.modulus_inf was 1000000.0, is 2000000.0" in said
    assert contents(out) == before
    assert main("job.yaml", "--out", "out")[0] == DONE
    assert steps(out) == list(range(STEPS + 1))


# -- what others have planted in a directory, or changed in its maps, is neither followed nor lost --------------------


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # files that are left open then
@pytest.mark.parametrize(
    ("name", "verb"), [("run.log", ()), ("measures.csv", ()), ("steady.csv", ("steady",)), ("steady.log", ("steady",))]
)
def test_planted_links_where_a_run_goes_on(main: Main, tmp_path: Path, name: str, verb: tuple[str, ...]) -> None:
    """A link where a table or a log is continued is replaced, or ends the run with a sentence; it is not followed."""
    words = [*verb, "job.yaml", "--out", "out"]
    curve = ["--velocities", "0.1,0.2", "--pressures", "1e4"] if verb else []
    assert main(*words, *(curve or ["--until", "0.003"]))[0] == DONE
    (tmp_path / "precious").write_bytes((tmp_path / "out" / name).read_bytes())
    (tmp_path / "out" / name).unlink()
    (tmp_path / "out" / name).symlink_to(tmp_path / "precious")
    before = (tmp_path / "precious").read_bytes()
    code, said = main(*words, *(curve and [*curve[:1], "0.1,0.2,0.3", *curve[2:]]))
    assert (tmp_path / "precious").read_bytes() == before
    assert code == DONE or f"out/{name} is a symbolic link, which is not followed; move it away" in said


# -- fields that cannot be read ---------------------------------------------------------------------------------------


def test_locked_fields(main: Main, tmp_path: Path) -> None:
    """A file that another program holds is neither lost nor replaced: its name is stated."""
    main("job.yaml", "--out", "out", "--until", "0.003")
    before = contents(tmp_path / "out")
    program = "import h5py, sys; file = h5py.File(sys.argv[1], 'r+'); print(flush=True); sys.stdin.read()"
    command = [sys.executable, "-c", program, str(tmp_path / "out" / "fields.h5")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None
        holder.stdout.readline()
        code, said = main("job.yaml", "--out", "out")
        holder.communicate(b"")
    assert code == BAD_INPUT
    assert "out/fields.h5 is locked by another program" in said
    assert contents(tmp_path / "out") == before
    assert main("job.yaml", "--out", "out")[0] == DONE


@pytest.mark.parametrize("wanted", [["pressure"], ["pressure", "gap"], []])
def test_fields_cut_short(main: Main, tmp_path: Path, wanted: list[str]) -> None:
    """What is left of them is kept under another name."""
    main("job.yaml", "--out", "out", "--until", "0.003")
    path = tmp_path / "out" / "fields.h5"
    data = path.read_bytes()[:2000]
    path.write_bytes(data)
    code, said = main("job.yaml", "--out", "out", "--set", f"output.fields={json.dumps(wanted)}")
    assert code == DONE
    assert "fields.h5 cannot be read" in said
    assert path.with_name("fields.h5.aside").read_bytes() == data
    assert path.exists() == bool(wanted)


# -- a user's files under the names of ours are put aside, by every command; what this program wrote is ---------------

MINE = "mine\n"
COMMANDS: dict[str, Sequence[str]] = {  # by the file that each of them writes
    "out/picture.png": ("plot", "out"),
    "mine.pdf": ("plot", "out", "--out", "mine.pdf"),
    "mine.svg": ("plot", "out", "--out", "mine.svg"),
    "out/pressure.gif": ("plot", "out", "--movie", "pressure"),
    "job-surface.png": ("surface", "job.yaml"),
    "out/report.html": ("report", "out"),
    "out/theory.csv": ("theory", "job.yaml", "--out", "out"),
    "out/theory.yaml": ("theory", "job.yaml", "--out", "out"),
    "compound.png": ("fit", "compound.csv"),
}


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run and a table of moduli to copy from."""
    where = tmp_path_factory.mktemp("ran")
    write_job(where / "job.yaml", surface=ROUGH)
    assert __main__.main(["run", str(where / "job.yaml"), "--out", str(where / "out"), "--quiet"]) == DONE
    frequency = np.logspace(0, 3, 10)
    modulus = 1e6 + 1e6 * frequency / (frequency + 100j)
    rows = [f"{f:.6g},{g.real / 1e6:.6g},{-g.imag / 1e6:.6g}" for f, g in zip(frequency, modulus, strict=True)]
    (where / "compound.csv").write_text("\n".join(["f,E',E''", "Hz,MPa,MPa", *rows, ""]))
    return where


@pytest.fixture
def here(ran: Path, tmp_path: Path) -> Path:
    """The same in the working directory."""
    (tmp_path / "out").mkdir()
    for path in [*ran.glob("*.*"), *ran.glob("out/*.*")]:
        if path.is_file():
            (tmp_path / path.relative_to(ran)).write_bytes(path.read_bytes())
    return tmp_path


def asides(here: Path) -> list[str]:
    return sorted(str(path.relative_to(here)) for path in here.rglob("*.aside*"))


@pytest.mark.parametrize("name", COMMANDS)
def test_by_commands(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    """The file of a user is kept as NAME.aside, and a warning says so; our own is then replaced without a word."""
    monkeypatch.chdir(here)
    (here / name).write_text(MINE)
    said = []
    for _ in range(2):
        assert __main__.main(COMMANDS[name]) == DONE
        said.append(capsys.readouterr().err)
    assert (here / f"{name}.aside").read_text() == MINE
    assert asides(here) == [f"{name}.aside"]
    assert f"{name} existed and was not written by this program: it was renamed to {Path(name).name}.aside" in said[0]
    assert said[1] == ""


@pytest.mark.parametrize("name", [name for name in COMMANDS if not name.startswith("out/theory")])
def test_a_pipe_is_not_renamed(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    """Nor a device, such as /dev/null, which every program uses and root may rename."""
    monkeypatch.chdir(here)
    (here / name).unlink(missing_ok=True)
    os.mkfifo(here / name)
    assert __main__.main(COMMANDS[name]) == BAD_INPUT
    assert name in (said := capsys.readouterr().err)
    assert re.search("is a device or a pipe, which is not|is not a regular file", said)
    assert (here / name).is_fifo()
    assert asides(here) == []
    assert [*here.rglob("*.part")] == []


PIPES = (
    "measures.csv",
    "fields.h5",
    "theory.csv",
    "theory.yaml",
    "job.resolved.yaml",
    "run.log",
    ".parcontact",
    ".lock",
)
READERS: dict[str, Sequence[str]] = {
    "run": ("run", "job.yaml", "--out", "out"),
    "theory": ("theory", "job.yaml", "--out", "out"),
    **{verb: (verb, "out") for verb in ("plot", "report", "info", "leak", "cite")},
}


@pytest.mark.parametrize("verb", READERS)
@pytest.mark.parametrize("name", PIPES)
def test_a_pipe_in_an_output_directory_is_not_read(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], verb: str, name: str
) -> None:
    """Reading it might never end; before anything is read or written. Of a case, too; a link to it is as bad."""
    monkeypatch.chdir(here)
    for place in ("out", "out/cases/000"):
        Path(place).mkdir(parents=True, exist_ok=True)
        path = Path(place, name)
        path.unlink(missing_ok=True)
        os.mkfifo(pipe := here / "pipe")
        path.symlink_to(pipe)
        with _bounded():
            assert __main__.main(READERS[verb]) == BAD_INPUT
        assert f"{path} is a device or a pipe, which is not read: move it away" in capsys.readouterr().err
        path.unlink()
        pipe.unlink()


@contextmanager
def _bounded() -> Iterator[None]:
    """Fail after ten seconds instead of waiting for a writer."""

    def stop(*_: Any) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(10)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


# -- rows of measures.csv that were edited, before a run or a plot ----------------------------------------------------


def change(line: int, act: Callable[[str], str]) -> Callable[[str], str]:
    def changed(text: str) -> str:
        lines = text.splitlines()
        lines[line - 1] = act(lines[line - 1])
        return "\n".join(lines) + "\n"

    return changed


EDITS: list[tuple[Callable[[str], str], str]] = [
    (change(4, lambda line: "abc" + line), "measures.csv, line 4: the step 'abc2' is not a whole number"),
    (change(4, lambda line: line + ",7"), "measures.csv, line 4, has "),
    (change(4, lambda line: line[:20].rsplit(",", 1)[0]), "measures.csv, line 4, has "),
    (change(1, lambda line: "a,b"), "measures.csv, line 1, must name the columns"),
    (lambda text: text + "1,", ""),
    (lambda text: "", "measures.csv, line 1, must name the columns"),
]


@pytest.mark.parametrize(("edit", "message"), EDITS)
def test_edited_rows(main: Main, tmp_path: Path, edit: Callable[[str], str], message: str) -> None:
    """A line that is none is named, and nothing changes; without an end it was never finished."""
    main("job.yaml", "--out", "out", "--until", "0.003")
    path = tmp_path / "out" / "measures.csv"
    path.write_text(edit(path.read_text()))
    before = contents(tmp_path / "out")
    code, said = main("job.yaml", "--out", "out")
    if not message:
        assert (code, steps(tmp_path / "out")) == (DONE, list(range(STEPS + 1)))
        return
    assert code == BAD_INPUT
    assert message in said
    after = contents(tmp_path / "out")
    assert {name: after[name] for name in before if name != "job.resolved.yaml"} == {
        name: data for name, data in before.items() if name != "job.resolved.yaml"
    }


def test_missing_rows(main: Main, tmp_path: Path) -> None:
    """Stated from what the checkpoint says of the table; the run goes on."""
    main("job.yaml", "--out", "out", "--until", "0.003")
    path = tmp_path / "out" / "measures.csv"
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:3]))
    code, said = main("job.yaml", "--out", "out")
    assert code == DONE
    assert "ends with step 1: the rows up to step " in said


# -- while it runs ----------------------------------------------------------------------------------------------------


def test_xdmf_that_cannot_be_written(
    main: Main, at_step: Callable[[int, Callable[[], Any]], None], tmp_path: Path
) -> None:
    """It is a warning, and every checkpoint."""
    out = tmp_path / "out"

    def block() -> None:
        (out / "fields.xdmf").unlink()
        (out / "fields.xdmf").mkdir()

    at_step(3, block)
    code, said = main("job.yaml", "--out", "out")
    assert code == DONE
    assert "warning: cannot write out/fields.xdmf" in said
    assert len(list(out.glob("checkpoint/step-*.h5"))) == STEPS


def test_stop_file_that_cannot_be_removed(
    main: Main, at_step: Callable[[int, Callable[[], Any]], None], tmp_path: Path
) -> None:
    """It stops the run, whose state is saved; the next one would stop at once, so the code is 1."""

    def ask() -> None:
        (tmp_path / "out" / "stop").mkdir()
        time.sleep(0.25)  # longer than between two looks

    at_step(4, ask)
    code, said = main("job.yaml", "--out", "out")
    assert code == FAILED
    assert "out/stop, which cannot be removed: Is a directory; remove it; the newest checkpoint is " in said


# -- no checkpoints ---------------------------------------------------------------------------------------------------


def test_keep_none(main: Main, tmp_path: Path) -> None:
    """A short run leaves no checkpoint; one that stops early leaves one, and goes on from it."""
    out, none = tmp_path / "out", ("--set", "checkpoint={every: 3, keep: 0}")
    assert main("job.yaml", "--out", "out", *none, "--until", "0.003")[0] == DONE
    assert len(list(out.glob("checkpoint/*"))) == 1
    assert main("job.yaml", "--out", "out", *none) == (DONE, "")
    assert list(out.glob("checkpoint/*")) == []
    assert steps(out) == list(range(STEPS + 1))
    before = contents(out)
    assert main("job.yaml", "--out", "out", *none) == (DONE, "")
    assert contents(out) == before

"""Whose an output directory is: nothing is replaced or removed that was not proved to be of the same run."""

import fcntl
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import yaml
from conftest import WORLD

from parcontact import __main__
from parcontact.march.step import March
from parcontact.record import checkpoint, files
from parcontact.record.directory import Directory

pytestmark = pytest.mark.skipif(WORLD.size > 1, reason="one rank writes")

JOB: dict[str, Any] = {
    "grid": {"points": [16, 12], "size": [1e-3, 7.5e-4]},
    "surface": {"shape": "wave", "amplitude": 1e-6, "waves": [2, 1]},
    "material": {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]},
    "history": [{"pressure": 1e4, "velocity": 0.1, "distance": 6.25e-4, "cells_per_step": 1}],
    "output": {"fields": ["pressure"]},
    "checkpoint": {"every": 1, "keep": 100},
}
STEPS = 11  # a jump and 10 cells
DONE, FAILED, BAD_INPUT, AGAIN = 0, 1, 2, 3
Main = Callable[..., tuple[int, str]]
Contents = dict[str, bytes]


def write_job(path: Path, **changes: Any) -> Path:
    path.write_text(yaml.safe_dump({**JOB, **changes}))
    return path


def contents(directory: Path) -> Contents:
    """All files of a directory but the marker."""
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in sorted(directory.rglob("*"))
        if path.is_file() and path.name != ".parcontact"
    }


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


def steps(out: Path) -> list[int]:
    lines = (out / "measures.csv").read_text().splitlines()[1:]
    return [int(line.split(",")[0]) for line in lines]


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
    assert "one/checkpoint/step-5.h5 is of another run than two, which holds measures.csv, fields.h5" in said
    assert contents(tmp_path / "two") == before
    assert main("job.yaml", "--out", "three", "--restart", "one/checkpoint/step-5.h5")[0] == DONE
    assert steps(tmp_path / "three") == list(range(6, STEPS + 1))


# -- results without what they could be made again from ---------------------------------------------------------------


def test_finished_run_without_its_checkpoints(main: Main, tmp_path: Path) -> None:
    """The same command replaces nothing; with --restart never it does as it is told."""
    out = tmp_path / "out"
    main("job.yaml", "--out", "out")
    shutil.rmtree(out / "checkpoint")
    before = contents(out)
    code, said = main("job.yaml", "--out", "out")
    assert code == BAD_INPUT
    assert "out holds measures.csv, fields.h5 of a run that has finished at t = " in said
    assert "but its checkpoints are missing; give --restart never to start afresh" in said
    assert contents(out) == before
    assert main("job.yaml", "--out", "out", "--restart", "never")[0] == DONE


def test_results_of_unknown_origin(main: Main, tmp_path: Path) -> None:
    """Files that bear our names, without a marker, are somebody's: refused, or put aside when told to."""
    out = tmp_path / "out"
    out.mkdir()
    for name in ("measures.csv", "fields.h5", "job.yaml", "notes.txt"):
        (out / name).write_text(f"my {name}")
    before = contents(out)
    code, said = main("job.yaml", "--out", "out")
    assert code == BAD_INPUT
    assert "out is not empty and not of this program: it holds fields.h5, job.yaml, measures.csv, notes.txt; " in said
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
    assert "it holds job.yaml" in said
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


# -- two at once ------------------------------------------------------------------------------------------------------


def test_loser_of_a_race_writes_nothing(main: Main, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Who finds a new directory taken, when it comes to write, leaves the winner's job as it is."""
    monkeypatch.setattr("parcontact.record.directory.MAX_SECONDS_TO_RELEASE", 0.1)
    out, winner = tmp_path / "out", Contents()
    make = Directory.make

    def late(self: Directory, *arguments: Any) -> None:
        if not winner:  # the other one is faster: it makes the directory, takes the lock, and writes
            out.mkdir()
            (out / "job.yaml").write_text("the winner's")
            handle = os.open(out / ".lock", os.O_RDWR | os.O_CREAT)
            fcntl.flock(handle, fcntl.LOCK_EX)
            winner.update(contents(out))
        make(self, *arguments)

    monkeypatch.setattr(Directory, "make", late)
    code, said = main("job.yaml", "--out", "out")
    assert code == BAD_INPUT
    assert "is in use by another run" in said
    assert contents(out) == winner


def test_directory_taken_and_given_back_meanwhile(main: Main, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The other run may even have ended by then; that of another job is no reason to go on with it."""
    main("job.yaml", "--out", "first")
    make = Directory.make

    def late(self: Directory, *arguments: Any) -> None:
        if self.path.name == "out" and not self.path.exists():
            shutil.copytree(tmp_path / "first", tmp_path / "out")
        make(self, *arguments)

    monkeypatch.setattr(Directory, "make", late)
    for changes, advice in (
        ((), "run again to go on with it"),
        (("--set", "material.modulus_inf=2e6"), "give --restart never to start afresh"),
    ):
        code, said = main("job.yaml", "--out", "out", *changes)
        assert code == BAD_INPUT
        assert f"out has been taken by another run meanwhile; {advice}" in said
        assert contents(tmp_path / "out") == contents(tmp_path / "first")
        shutil.rmtree(tmp_path / "out")


# -- planted links ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [".lock", "run.log", "measures.csv", "fields.h5", "job.resolved.yaml", ".parcontact"])
def test_planted_links_are_not_followed(main: Main, tmp_path: Path, name: str) -> None:
    """A link to somebody's file, planted where a run writes, never changes that file."""
    precious = tmp_path / "precious"
    precious.write_text("years of work")
    main("job.yaml", "--out", "out", "--until", "0.003")
    (tmp_path / "out" / name).unlink(missing_ok=True)
    (tmp_path / "out" / name).symlink_to(precious)
    code, said = main("job.yaml", "--out", "out")
    assert precious.read_text() == "years of work"
    assert code == DONE or (code == BAD_INPUT and name in said)


def test_planted_picture(main: Main, tmp_path: Path) -> None:
    """`plot` replaces a link instead of what it leads to."""
    main("job.yaml", "--out", "out")
    (tmp_path / "precious").write_text("years of work")
    (tmp_path / "out" / "picture.png").symlink_to(tmp_path / "precious")
    assert main("plot", "out")[0] == DONE
    assert (tmp_path / "precious").read_text() == "years of work"
    assert (tmp_path / "out" / "picture.png").read_bytes().startswith(b"\x89PNG")


def test_names_of_unfinished_files_cannot_be_guessed(tmp_path: Path) -> None:
    """Two in a row differ, and what is there already is never opened."""
    path = tmp_path / "table"
    assert files.unused(path) != files.unused(path)
    with files.replaced(path) as file:
        file.write(b"new")
        part = next(tmp_path.iterdir())
        with pytest.raises(FileExistsError):
            part.open("xb")
    assert [found.name for found in tmp_path.iterdir()] == ["table"]
    with pytest.raises(ZeroDivisionError), files.replaced(path) as file:
        file.write(b"half" * (1 // 0))
    assert (path.read_bytes(), len(list(tmp_path.iterdir()))) == (b"new", 1)


def test_a_named_pipe_does_not_hang(main: Main, tmp_path: Path) -> None:
    """Nor does it end up as a log."""
    main("job.yaml", "--out", "out", "--until", "0.003")
    (tmp_path / "out" / "run.log").unlink()
    os.mkfifo(tmp_path / "out" / "run.log")
    code, said = main("job.yaml", "--out", "out")
    assert code == BAD_INPUT
    assert "run.log" in said


# -- fields that cannot be read ---------------------------------------------------------------------------------------


def test_locked_fields(main: Main, tmp_path: Path) -> None:
    """A file that another program holds is neither lost nor replaced: its name is told."""
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
    assert f"out/fields.h5 is locked by process {holder.pid}, " in said
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


@pytest.mark.parametrize("wanted", [["pressure"], ["pressure", "gap"]])
def test_own_data_in_fields(main: Main, tmp_path: Path, wanted: list[str]) -> None:
    """What a user has added to the file stays in it, or in the one that is put aside."""
    main("job.yaml", "--out", "out", "--until", "0.003")
    path = tmp_path / "out" / "fields.h5"
    with h5py.File(path, "r+") as file:
        file.create_dataset("analysis/mine", data=[[1.0, 2.0]], chunks=True, compression="gzip")
        file["pressure"].attrs["checked"] = "by me"
    code, said = main("job.yaml", "--out", "out", "--set", f"output.fields={json.dumps(wanted)}")
    assert code == DONE
    assert ("held analysis, which this program did not write" in said) == (len(wanted) > 1)
    with h5py.File(path if len(wanted) == 1 else path.with_name("fields.h5.aside")) as file:
        assert file["analysis/mine"][...].tolist() == [[1.0, 2.0]]
    with h5py.File(path) as file:
        assert not np.isnan(file["t"][...]).any()
    assert main("plot", "out")[0] == DONE


# -- rows that were edited --------------------------------------------------------------------------------------------


def change(line: int, act: Callable[[str], str]) -> Callable[[str], str]:
    def changed(text: str) -> str:
        lines = text.splitlines()
        lines[line - 1] = act(lines[line - 1])
        return "\n".join(lines) + "\n"

    return changed


EDITS: list[tuple[Callable[[str], str], str]] = [
    (change(4, lambda line: "abc" + line), "measures.csv, line 4: the step 'abc2' is not a whole number"),
    (change(4, lambda line: f"{line}\n{line}"), "measures.csv, line 5: step 2 comes after step 2"),
    (change(4, lambda line: line + ",7"), "measures.csv, line 4, has "),
    (change(4, lambda line: line[:20].rsplit(",", 1)[0]), "measures.csv, line 4, has "),
    (change(1, lambda line: "a,b"), "measures.csv, line 1, does not name the columns"),
    (lambda text: text + "1," * 700_000, "has more than 1048576 bytes"),
    (lambda text: text + "1,", ""),
    (change(4, lambda line: "1" * 2_000_000), "measures.csv, line 4, has more than 1048576 bytes"),
    (lambda text: "", "measures.csv, line 1, does not name the columns"),
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


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (change(4, lambda line: line.replace(",", ",x", 1)), "measures.csv, line 4: time is 'x"),
        (change(4, lambda line: line + ",7"), "measures.csv, line 4, has "),
        (lambda text: "", "measures.csv is empty"),
    ],
)
def test_plot_of_edited_rows(main: Main, tmp_path: Path, edit: Callable[[str], str], message: str) -> None:
    """The line is named."""
    main("job.yaml", "--out", "out")
    path = tmp_path / "out" / "measures.csv"
    path.write_text(edit(path.read_text()))
    code, said = main("plot", "out")
    assert code == BAD_INPUT
    assert message in said


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (change(4, lambda line: ""), "lacks 1 of the "),
        (change(4, lambda line: line.replace(",", ",1", 1)), "was changed by hand"),
        (lambda text: "\n".join(text.splitlines()[:3]) + "\n", "ends with step 1: the rows up to step "),
    ],
)
def test_missing_and_changed_rows(main: Main, tmp_path: Path, edit: Callable[[str], str], message: str) -> None:
    """Told from what the checkpoint says of the table; the run goes on."""
    main("job.yaml", "--out", "out", "--until", "0.003")
    path = tmp_path / "out" / "measures.csv"
    path.write_text(edit(path.read_text()).replace("\n\n", "\n"))
    code, said = main("job.yaml", "--out", "out")
    assert code == DONE
    assert message in said


# -- while it runs ----------------------------------------------------------------------------------------------------


def remove(path: Path) -> None:
    path.unlink()


def replace(path: Path) -> None:
    path.unlink()
    path.write_text("mine")


@pytest.mark.parametrize("act", [remove, replace])
def test_measures_taken_away(
    main: Main, at_step: Callable[[int, Callable[[], Any]], None], tmp_path: Path, act: Callable[[Path], None]
) -> None:
    """The rows are written again, what stands in their place is put aside, and a warning says so."""
    out = tmp_path / "out"
    at_step(6, lambda: act(out / "measures.csv"))
    code, said = main("job.yaml", "--out", "out")
    assert code == DONE
    assert "measures.csv was re" in said
    assert steps(out) == list(range(STEPS + 1))
    if act is replace:
        assert (out / "measures.csv.aside").read_text() == "mine"


def test_measures_cut_short(main: Main, at_step: Callable[[int, Callable[[], Any]], None], tmp_path: Path) -> None:
    """Rows are lost, so the run ends with 1, its state saved, and goes on when asked to."""
    out = tmp_path / "out"
    at_step(6, lambda: os.truncate(out / "measures.csv", 100))
    code, said = main("job.yaml", "--out", "out")
    assert code == FAILED
    assert "measures.csv was cut short by another program during the run: rows are lost" in said
    assert "the newest checkpoint is out/checkpoint/step-6.h5" in said
    assert checkpoint.inspect(out / "checkpoint" / "step-6.h5").step == 6


def test_fields_taken_away(main: Main, at_step: Callable[[int, Callable[[], Any]], None], tmp_path: Path) -> None:
    """The state is saved before the run ends with 1; the same command goes on."""
    out = tmp_path / "out"
    at_step(6, (out / "fields.h5").unlink)
    code, said = main("job.yaml", "--out", "out", "--set", "checkpoint.every=100")
    assert code == FAILED
    assert "fields.h5" in said
    assert "the newest checkpoint is out/checkpoint/step-6.h5" in said
    code, said = main("job.yaml", "--out", "out")
    assert code == DONE
    assert "fields.h5 is missing" in said
    with h5py.File(out / "fields.h5") as file:
        assert file["step"][...].tolist() == list(range(6, STEPS + 1))
        assert not np.isnan(file["t"][...]).any()


def test_locked_fields_do_not_disturb_a_run(
    main: Main, at_step: Callable[[int, Callable[[], Any]], None], tmp_path: Path
) -> None:
    """HDF5's lock, taken by another program while it runs."""
    path, locks = tmp_path / "out" / "fields.h5", list[int]()

    def lock() -> None:
        locks.append(os.open(path, os.O_RDONLY))
        fcntl.flock(locks[0], fcntl.LOCK_EX)

    at_step(6, lock)
    try:
        assert main("job.yaml", "--out", "out") == (DONE, "")
    finally:
        os.close(locks[0])
    with h5py.File(path) as file:
        assert not np.isnan(file["t"][...]).any()


def test_xdmf_that_cannot_be_written(
    main: Main, at_step: Callable[[int, Callable[[], Any]], None], tmp_path: Path
) -> None:
    """It is beside the point: a warning, and every checkpoint."""
    out = tmp_path / "out"

    def block() -> None:
        (out / "fields.xdmf").unlink()
        (out / "fields.xdmf").mkdir()

    at_step(3, block)
    code, said = main("job.yaml", "--out", "out")
    assert code == DONE
    assert "warning: cannot write out/fields.xdmf" in said
    assert len(list(out.glob("checkpoint/step-*.h5"))) == STEPS


def test_directory_named_stop(main: Main, at_step: Callable[[int, Callable[[], Any]], None], tmp_path: Path) -> None:
    """`mkdir out/stop` is a wish to stop like any other; one that cannot be removed ends with 1, saved too."""
    out = tmp_path / "out"

    def ask(stop: Path) -> None:
        stop.mkdir(parents=True)
        time.sleep(0.25)  # longer than between two looks

    at_step(4, lambda: ask(out / "stop"))
    code, said = main("job.yaml", "--out", "out")
    assert (code, said) == (AGAIN, "")
    assert not (out / "stop").exists()
    last = steps(out)[-1]
    assert checkpoint.inspect(out / "checkpoint" / f"step-{last}.h5").step == last < STEPS
    at_step(last + 1, lambda: ask(out / "stop" / "full"))
    code, said = main("job.yaml", "--out", "out")
    assert code == FAILED
    assert "stop, which cannot be removed: Directory not empty; remove it; the newest checkpoint is " in said


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

"""What others have planted in a directory, or changed in its maps, is neither followed nor lost."""

import json
import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from parcontact.storage import files

from .jobs import BAD_INPUT, DONE, Main, contents

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

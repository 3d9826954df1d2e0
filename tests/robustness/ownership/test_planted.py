"""What others have planted in a directory, or changed in its maps, is neither followed nor lost."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from .jobs import BAD_INPUT, DONE, Main, contents


def test_planted_picture(main: Main, tmp_path: Path) -> None:
    """`plot` replaces a link instead of what it leads to."""
    main("job.yaml", "--out", "out")
    (tmp_path / "precious").write_text("years of work")
    (tmp_path / "out" / "picture.png").symlink_to(tmp_path / "precious")
    assert main("plot", "out")[0] == DONE
    assert (tmp_path / "precious").read_text() == "years of work"
    assert (tmp_path / "out" / "picture.png").read_bytes().startswith(b"\x89PNG")


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

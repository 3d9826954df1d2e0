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
    assert code == DONE or f"out/{name} is a link, which may lead anywhere; move it away" in said


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

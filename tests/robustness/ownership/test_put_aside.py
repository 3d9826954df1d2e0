"""A user's files under the names of ours are put aside, by every command; what this program wrote is replaced."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from restarting import ROUGH

import parcontact as pc
from parcontact import __main__

from .jobs import DONE, JOB, write_job

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
    assert f"{name} was there and not written by this program: it is kept as {Path(name).name}.aside" in said[0]
    assert said[1] == ""


def test_by_python(tmp_path: Path) -> None:
    """Simulation.save replaces a checkpoint, and nothing else."""
    path = tmp_path / "mine.h5"
    path.write_text(MINE)
    run = pc.Simulation(JOB)
    run.save(path)
    run.save(path)
    assert pc.Simulation.restore(path).row.step == 0
    assert [found.name for found in sorted(tmp_path.iterdir())] == ["mine.h5", "mine.h5.aside"]
    assert path.with_name("mine.h5.aside").read_text() == MINE

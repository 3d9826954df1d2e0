"""Where the program runs may be hostile: outputs that are full, limits, directories that vanish, settings of others."""

import errno
import os
import resource
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import matplotlib as mpl
import numpy as np
import pytest
import short_job
import yaml
from conftest import WORLD, Main
from matplotlib.figure import Figure

from parcontact.errors import InputError
from parcontact.files import tables
from parcontact.results import info

pytestmark = pytest.mark.skipif(WORLD.size > 1, reason="for one process")

JOB: dict[str, Any] = {
    **short_job.JOB,
    "grid": {"points": [32, 24], "size": [1e-3, 7.5e-4]},
    "history": [{"pressure": 1e4, "velocity": 0.1, "distance": 1.5625e-4, "cells_per_step": 1}],
    "output": {"fields": ["pressure"]},
}
DONE, FAILED, BAD_INPUT = 0, 1, 2


@pytest.fixture
def here(main: Main, tmp_path: Path) -> Path:
    """A directory with job.yaml, in which we are."""
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(JOB))
    return tmp_path


@contextmanager
def limited(what: int, soft: int) -> Iterator[None]:
    """A resource of this process is limited meanwhile."""
    before = resource.getrlimit(what)
    resource.setrlimit(what, (soft, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(what, before)


@pytest.mark.parametrize("words", [["schema"], ["manual"], ["check", "job.yaml"], ["cite", "out"], ["--version"]])
@pytest.mark.parametrize("stream", ["full", "closed"])
def test_output_that_is_lost_is_no_success(
    here: Path, main: Main, monkeypatch: pytest.MonkeyPatch, words: list[str], stream: str
) -> None:
    assert main("job.yaml", "--quiet", "--out", "out")[0] == DONE
    with monkeypatch.context() as patch, Path("/dev/full").open("w") as full:
        patch.setattr(sys, "stdout", full if stream == "full" else None)
        code, _, said = main(*words)
    reason = "No space left on device" if stream == "full" else "it is closed"
    assert (code, said) == (BAD_INPUT, f"parcontact: cannot write to standard output: {reason}\n")


@pytest.mark.parametrize("fields", ["[pressure]", "[]"])
def test_limit_of_file_sizes(here: Path, main: Main, fields: str) -> None:
    """In fields.h5, else in the checkpoint: a sentence, nothing half-written, and without the limit it goes on."""
    words = ("job.yaml", "--quiet", "--out", "out", "--set", f"output.fields={fields}")
    with limited(resource.RLIMIT_FSIZE, 20_000):
        code, _, said = main(*words)
    assert code == FAILED
    assert "ulimit -f" in said
    assert len(said.splitlines()) == 1
    assert not list((here / "out").rglob("*.part"))
    assert main(*words)[0] == DONE


@pytest.mark.parametrize(
    ("what", "soft", "said"),
    [
        (resource.RLIMIT_NOFILE, 12, "only 12 files may be open: set a limit of 32 or more, by ulimit -n"),
        (resource.RLIMIT_AS, 300 << 20, "only 300 MB of memory may be used: set a limit of 1 GB or more, by ulimit -v"),
    ],
)
def test_limits_too_narrow_to_start(
    here: Path, main: Main, monkeypatch: pytest.MonkeyPatch, what: int, soft: int, said: str
) -> None:
    """Said before MPI and other libraries end the process in their own ways."""
    found = resource.getrlimit
    monkeypatch.setattr(resource, "getrlimit", lambda kind: (soft, soft) if kind == what else found(kind))
    assert main("job.yaml", "--out", "out") == (BAD_INPUT, "", f"parcontact: {said}\n")
    assert not (here / "out").exists()


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (MemoryError(), "parcontact: out of memory; free memory, raise the limit (ulimit -v), or use fewer points\n"),
        (ImportError("libx.so: failed to map segment from shared object"), "parcontact: out of memory; "),
        (SystemError("error return without exception set"), "parcontact: out of memory; "),
        (
            OSError(errno.EMFILE, "Too many open files"),
            "parcontact: too many open files; raise the limit (ulimit -n): ",
        ),
    ],
)
def test_what_the_machine_lacks(main: Main, monkeypatch: pytest.MonkeyPatch, error: Exception, said: str) -> None:
    def fail(*_: object) -> NoReturn:
        raise error

    monkeypatch.setattr(info, "describe_all", fail)
    with limited(resource.RLIMIT_AS, 1 << 45):
        code, _, errors = main("info", "out")
    assert code == FAILED
    assert errors.startswith(said)
    assert len(errors.splitlines()) == 1


@pytest.mark.parametrize("verb", ["run", "check", "plot", "report"])
def test_working_directory_that_was_removed(here: Path, main: Main, verb: str) -> None:
    (here / "gone").mkdir()
    os.chdir(here / "gone")
    (here / "gone").rmdir()
    code, _, said = main(verb, here / "job.yaml")
    assert code == BAD_INPUT
    assert said.startswith("parcontact: the working directory does not exist (No such file or directory): change to")


def test_pictures_are_as_without_the_settings_of_others(
    here: Path, main: Main, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A matplotlibrc next to the job that asks for LaTeX."""
    drawn: list[object] = []
    monkeypatch.setattr(Figure, "savefig", lambda *_, **__: drawn.append(mpl.rcParams["text.usetex"]))
    table = "".join(f"{f:g},{1e6 + 1e5 * f:g},{2e5 + 1e4 * f:g}\n" for f in (0.1, 0.3, 1.0, 3.0, 10.0, 30.0))
    (here / "moduli.csv").write_text(f"f[Hz],G'[Pa],G''[Pa]\n{table}")
    assert main("job.yaml", "--quiet", "--out", "out")[0] == DONE
    with mpl.rc_context({"text.usetex": True}):
        for words in (["plot", "out"], ["report", "out"], ["surface", "job.yaml"], ["fit", "moduli.csv"]):
            drawn.clear()
            assert main(*words)[0] == DONE, words
            assert drawn, words
            assert not any(drawn), words
        assert mpl.rcParams["text.usetex"]


@pytest.mark.parametrize("name", ["/proc/absent", "job.yaml"])
def test_directory_for_scratch_files_that_cannot_be(
    here: Path, main: Main, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setenv("TMPDIR", name)
    code, _, said = main("job.yaml", "--out", "out")
    assert code == BAD_INPUT
    assert said.startswith(f"parcontact: TMPDIR is {name}, which cannot be created (")
    assert len(said.splitlines()) == 1
    assert not (here / "out").exists()


@pytest.mark.parametrize(("verb", "column"), [("report", "seconds"), ("report", "operator_calls"), ("info", "step")])
def test_table_without_a_column(here: Path, main: Main, verb: str, column: str) -> None:
    assert main("job.yaml", "--quiet", "--out", "out")[0] == DONE
    table = here / "out" / "measures.csv"
    table.write_text(table.read_text().replace(column, "other", 1))
    code, shown, said = main(verb, "out")
    assert code == BAD_INPUT
    assert f"out/measures.csv, line 1, has no column {column}; correct it" in shown + said
    with pytest.raises(InputError, match="has no column"):
        tables.read_columns(table)[column]


WRITERS = {  # verbs, and the files that each makes
    ("leak", "out"): "out/leak.csv",
    ("plot", "out"): "out/picture.png",
    ("plot", "out", "--movie", "pressure"): "out/pressure.gif",
    ("report", "out"): "out/report.html",
    ("theory", "job.yaml", "--out", "out"): "out/theory.csv",
    ("surface", "job.yaml"): "job-surface.png",
    ("surface", "map.npy", "--job", "new.yaml", "--out", "map.png"): "map.png",
    ("fit", "moduli.csv"): "moduli.yaml",
    ("run", "job.yaml", "--out", "other"): "other",
    ("study", "job.yaml", "--out", "other"): "other",
}


@pytest.mark.parametrize("words", WRITERS)
def test_files_that_may_not_be_written(
    here: Path, main: Main, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    """One sentence that names the file, and exit code 2, whatever verb wants to write it."""
    rough = {"shape": "rough", "hurst": 0.8, "long_wavelength": 1e-3, "short_wavelength": 1.25e-4, "rms_slope": 0.1}
    job = {**JOB, "surface": rough, "study": {"mesh": [16, 32]}, "output": {"fields": ["pressure", "gap"]}}
    (here / "job.yaml").write_text(yaml.safe_dump(job))
    table = "".join(f"{f:g},{1e6 + 1e5 * f:g},{2e5 + 1e4 * f:g}\n" for f in (0.1, 0.3, 1.0, 3.0, 10.0, 30.0))
    (here / "moduli.csv").write_text(f"f[Hz],G'[Pa],G''[Pa]\n{table}")
    np.save(here / "map.npy", np.random.default_rng(1).normal(size=(16, 16)) * 1e-6)
    if "out" in words and words[0] != "theory":
        assert main("job.yaml", "--quiet", "--out", "out")[0] == DONE
    opened = Path.open

    def refuse(path: Path, mode: str = "r", *more: Any, **named: Any) -> Any:
        if mode == "xb":
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return opened(path, mode, *more, **named)

    monkeypatch.setattr(Path, "open", refuse)
    more = ["--set", "surface.size=[1e-3,1e-3]", "--set", "surface.unit=m"] if "map.npy" in words else []
    code, _, said = main(*words, *more)
    assert (code, len(said.splitlines())) == (BAD_INPUT, 1), said
    assert WRITERS[words] in said
    assert said.rstrip().endswith("Permission denied")
    assert ".part" not in said

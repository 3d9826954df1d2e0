"""Output directories: one run at a time, known by its marker."""

import os
from pathlib import Path
from typing import Any

import pytest

from parcontact.errors import InputError, InUseError
from parcontact.parallel.slab import Slab
from parcontact.storage import directory, marker
from parcontact.storage.directory import Directory
from parcontact.storage.marker import Claim

PLAIN: dict[str, Any] = {"grid": {"points": [8, 8]}, "surface": [{"shape": "flat"}], "material": {"model": "elastic"}}


def directory_at(path: Path, verb: str = "run") -> Directory:
    return Directory(path, Slab.alone(8, 8), verb)


def make(here: Directory, job: Path, data: dict[str, Any] = PLAIN) -> None:
    with here.claimed():
        here.refuse_foreign(job, data, False)
        here.make(job, "resolved", Claim(data))


@pytest.fixture
def job(tmp_path: Path) -> Path:
    path = tmp_path / "job.yaml"
    path.write_text("given")
    return path


def test_second_run_is_refused(tmp_path: Path, job: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It writes nothing, and may have the directory as soon as the first has ended."""
    monkeypatch.setattr(directory, "MAX_SECONDS_TO_RELEASE", 0.1)
    first, second = directory_at(tmp_path / "out"), directory_at(tmp_path / "out")
    with first.claimed():
        with pytest.raises(InUseError, match=rf"in use by another run \(process {os.getpid()} on "), second.claimed():
            raise AssertionError
        first.make(job, "resolved", Claim(PLAIN))
    make(second, job)
    assert second.claim is not None
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        marker.MARKER,
        "checkpoint",
        "job.resolved.yaml",
        "job.yaml",
    ]


def test_nothing_is_left_of_a_job_that_was_refused(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), directory_at(tmp_path / "deep" / "out").claimed():
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []


def test_other_files_and_other_jobs_are_refused(tmp_path: Path, job: Path) -> None:
    """Those of others, and other scenes under another verb; the lock, `stop` and theory may be there before."""
    out = tmp_path / "out"
    out.mkdir()
    for name in ("theory.csv", ".hidden", "notes.txt"):
        (out / name).write_text("mine")
    with pytest.raises(InputError, match=r"not empty and not of this program: it holds notes\.txt; give --out"):
        make(directory_at(out), job)
    (out / "notes.txt").unlink()
    make(directory_at(out), job)
    make(directory_at(out, "steady"), job)
    keep = r"grid.points was \[8, 8\], is \[9, 9\]; give --set grid.points=\[8,8\] to keep its mesh, or give --out"
    with pytest.raises(InputError, match=keep):
        make(directory_at(out, "study"), job, {**PLAIN, "grid": {"points": [9, 9]}})
    (out / marker.MARKER).write_text("{")
    with pytest.raises(InputError, match="is damaged, so that the owner of"):
        make(directory_at(out), job)


def test_the_directory_of_a_sweep_is_told(tmp_path: Path, job: Path) -> None:
    """A sweep has no marker of its own, its cases have."""
    for case in ("000", "001"):
        make(directory_at(tmp_path / "out" / "cases" / case), job)
    with pytest.raises(InputError, match=r"out is that of a sweep, with 2 of its cases; give --out for .* with --case"):
        make(directory_at(tmp_path / "out"), job)


def test_differences_of_jobs() -> None:
    """Keys of sections and of lists of parts, with both values; lists of numbers are one value."""
    then = {
        "grid": {"points": [8, 8]},
        "surface": [{"shape": "wave", "seed": 1}],
        "numerics": {"kernel": "love", "x": 1},
    }
    now = {
        "grid": {"points": [8, 9]},
        "surface": [{"shape": "wave", "seed": 2}],
        "numerics": {"kernel": "love", "x": 2},
    }
    assert list(marker.differences(then, now, ("grid", "surface", "numerics.kernel", "initial"))) == [
        "grid.points was [8, 8], is [8, 9]",
        "surface.0.seed was 1, is 2",
    ]


def test_many_differences_are_counted() -> None:
    """Another rubber with many branches differs in many keys."""
    branches = marker.differences({"k": dict.fromkeys("abcdef", 1)}, {"k": dict.fromkeys("abcdef", 2)}, ("k",))
    assert marker.told(branches) == "k.a was 1, is 2; k.b was 1, is 2; k.c was 1, is 2; k.d was 1, is 2; and 2 more"

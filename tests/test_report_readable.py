"""A report reads regular files that the owner of the output directory may read: it cannot publish what is not his."""

import os
import tempfile
from pathlib import Path

import pytest
from conftest import WORLD
from drawing import ELASTIC, LOADS, STRIP, ran

from parcontact.errors import InputError
from parcontact.report import page, readable

pytestmark = pytest.mark.skipif(WORLD.size > 1, reason="of root alone")
SECRET = "time,friction\n1,2\n"
NOBODY = 65534


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return ran(tmp_path_factory.mktemp("run"), STRIP + ELASTIC + LOADS)


def refused(out: Path, *told: str) -> None:
    with pytest.raises(InputError) as caught:
        page.write([out])
    assert "\n" not in str(caught.value)
    assert all(text in str(caught.value) for text in told)
    assert not (out / "report.html").exists()


@pytest.mark.parametrize("name", ["theory.csv", "run.log", "fields.h5", "cases", "checkpoint/step-9.h5"])
def test_links_are_refused(out: Path, tmp_path: Path, name: str) -> None:
    """Whatever they lead to, and whether to a file or to a directory."""
    (tmp_path / "secret").write_text(SECRET)
    kept = (out / name).rename(tmp_path / "kept") if (out / name).exists() else None
    (out / name).symlink_to(tmp_path / "secret")
    try:
        refused(out, name, "symbolic link")
    finally:
        (out / name).unlink()
        if kept:
            kept.rename(out / name)


@pytest.mark.skipif(os.geteuid() != 0, reason="gives files to others")
@pytest.mark.parametrize("inside", [True, False])
def test_files_that_the_owner_may_not_read(out: Path, inside: bool) -> None:
    """As root: a file of root in a directory of nobody, and one that a job names there."""
    secret = out / "theory.csv" if inside else out.parent / "secret.txt"
    resolved = out / "job.resolved.yaml"
    text = resolved.read_text()
    secret.write_text(SECRET)
    secret.chmod(0o600)
    roots = [Path(tempfile.gettempdir()), *Path(tempfile.gettempdir()).parents]
    parents = [(path, path.stat().st_mode) for path in out.parents if path not in roots]
    for path, mode in parents:
        path.chmod(mode | 0o755)
    os.chown(out, NOBODY, NOBODY)
    try:
        if not inside:
            resolved.write_text(f"surface: [{{shape: file, path: {secret}}}]\nmaterial: {{include: nothing}}\n")
        refused(out, secret.name, "may not be read by the owner of", "nobody")
    finally:
        os.chown(out, 0, 0)
        resolved.write_text(text)
        secret.unlink()
        for path, mode in parents:
            path.chmod(mode)


def test_what_its_owner_may_read_is_reported(out: Path) -> None:
    assert page.write([out]) == out / "report.html"
    (out / "report.html").unlink()


def test_modes_of_a_file_and_its_directories(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The bits of owner, group and others, the first that fit; and each directory above must let one pass."""
    path = tmp_path / "deep" / "file"
    path.parent.mkdir()
    path.touch()
    monkeypatch.setattr(os, "geteuid", lambda: -1)
    user, group = path.stat().st_uid, path.stat().st_gid
    allows = readable._allows
    for mode, expected in ((0o400, (True, False, False)), (0o044, (False, True, True)), (0o004, (False, False, True))):
        path.chmod(mode)
        found = allows(path, user, {group}, 4), allows(path, -2, {group}, 4), allows(path, -2, set(), 4)
        assert found == expected
    path.chmod(0o644)
    path.parent.chmod(0o700)
    assert not readable.may_read(path, NOBODY)

"""What is kept between runs is kept only where nobody else can have put it, and runs do without such a place."""

import os
import pickle
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import outside

from parcontact import compiled

NOBODY, SOMEBODY = 65534, 65533  # users other than the one who runs the tests
BIN = Path(sys.executable).parent
as_others = pytest.mark.skipif(os.geteuid() != 0, reason="only root can be somebody else")


def test_a_private_directory_is_made(cache: Path) -> None:
    place = compiled.directory("plans")
    assert place == cache / "parcontact" / "plans"
    assert place.stat().st_mode & 0o777 == 0o700
    assert compiled.directory("plans") == place


def test_without_a_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A home that does not exist is not made; where HOME is unset the system knows it."""
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "absent"))
    assert compiled.directory("plans") is None
    assert not (tmp_path / "absent").exists()
    monkeypatch.setenv("HOME", "/dev/null")
    assert compiled.directory("plans") is None
    monkeypatch.setenv("HOME", str(tmp_path))
    assert compiled.directory("plans") == tmp_path / ".cache" / "parcontact" / "plans"


def test_a_directory_that_others_could_fill(cache: Path) -> None:
    place = cache / "parcontact" / "plans"
    place.mkdir(parents=True)
    place.chmod(0o755)  # others could only read
    assert compiled.directory("plans") == place
    assert place.stat().st_mode & 0o777 == 0o700
    for mode in (0o770, 0o702, 0o777):
        place.chmod(mode)
        assert compiled.directory("plans") is None


def test_a_directory_that_others_could_replace(cache: Path) -> None:
    place = cache / "parcontact" / "plans"
    assert compiled.directory("plans") == place
    cache.chmod(0o777)
    assert compiled.directory("plans") is None
    cache.chmod(0o1777)  # sticky: entries are their owners'
    assert compiled.directory("plans") == place


def test_a_link_is_no_directory(cache: Path, tmp_path: Path) -> None:
    (cache / "parcontact").mkdir(parents=True)
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    (cache / "parcontact" / "plans").symlink_to(tmp_path / "elsewhere")
    assert compiled.directory("plans") is None


@as_others
def test_a_directory_of_somebody_else(cache: Path) -> None:
    place = compiled.directory("plans")
    assert place is not None
    for prepared in (place, place.parent, cache):
        os.chown(prepared, NOBODY, NOBODY)
        assert compiled.directory("plans") is None
        os.chown(prepared, 0, 0)
    assert compiled.directory("plans") == place


# -- as another user --------------------------------------------------------------------------------------------------


@pytest.fixture
def common() -> Iterator[Path]:
    """A directory that everybody can enter and write to."""
    path = Path(tempfile.mkdtemp(prefix="parcontact-common-"))
    path.chmod(0o1777)
    yield path
    shutil.rmtree(path)


def as_nobody(words: list[str | Path], cwd: Path, home: Path | None, **more: str) -> subprocess.CompletedProcess[str]:
    """A command of a user who may write nowhere but in `cwd`."""
    clean = {key: value for key, value in outside.environment().items() if key != "HOME" and not key.startswith("XDG_")}
    environment = clean | more | ({} if home is None else {"HOME": str(home)})
    command = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups", *map(str, words)]
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=120.0)


JOB = """\
grid: {points: [16, 4], size: [1.0e-3, 2.5e-4]}
surface: {shape: wave, amplitude: 1.0e-6, waves: [1, 0]}
material: {model: elastic, shear_modulus: 1.0e6}
history: [{pressure: 1.0e4}]
"""


@as_others
@pytest.mark.parametrize("home", ["/nonexistent", "/proc", None])
def test_without_a_place_the_program_runs(common: Path, home: str | None) -> None:
    (common / "job.yaml").write_text(JOB)
    place = None if home is None else Path(home)
    said = as_nobody([BIN / "parcontact", "--version"], common, place)
    assert (said.returncode, said.stderr) == (0, "")
    # the loops as plain Python: whether they are compiled does not matter here
    run = as_nobody([BIN / "mpirun", "-n", "1", BIN / "parcontact", "job.yaml"], common, place, NUMBA_DISABLE_JIT="1")
    assert run.returncode == 0, run.stderr
    assert "done: results in out/job" in run.stdout
    assert sorted(path.name for path in common.iterdir()) == ["job.yaml", "out"]


LOOP = """\
from parcontact.compiled import cache_path, loop, pointwise

@loop
def double(x):
    return 2 * x

@pointwise
def triple(x):
    return 3 * x

assert (double(2), triple(2)) == (4, 6)
print(cache_path(double), cache_path(triple))
"""


class Payload:
    """Code that runs when it is loaded."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, tuple[str, str]]:
        return open, (str(self.path), "w")


def prepare(home: Path, payload: Path) -> None:
    """Replace every index of compiled code under a home by code."""
    indices = list(home.rglob("*.nbi"))
    assert indices
    for index in indices:
        index.write_bytes(pickle.dumps(Payload(payload)))


def give(path: Path, owner: int, mode: int) -> None:
    for part in (path, *path.rglob("*")):
        os.chown(part, owner, owner)
        part.chmod(mode)


@as_others
def test_code_that_somebody_prepared_is_not_loaded(common: Path) -> None:
    """Compiled code in a common home, with code for others in it; the user's own, next to it, is loaded."""
    program, home, payload = common / "program", common / "home", common / "executed"
    program.mkdir()
    (program / "loops.py").write_text(LOOP)
    home.mkdir()
    script: list[str | Path] = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(program)!r}); import loops"]
    give(home, NOBODY, 0o700)
    first = as_nobody(script, common, home)
    assert first.returncode == 0, first.stderr
    prepare(home, payload)
    as_nobody(script, common, home)
    assert payload.exists()  # what this user's own directory holds is code to it
    payload.unlink()
    prepare(home, payload)
    give(home, SOMEBODY, 0o777)
    second = as_nobody(script, common, home)
    assert second.returncode == 0, second.stderr
    assert second.stdout == "None None\n"
    assert not payload.exists()

"""What happens to a run from outside: signals, a full disk, a second run; the next run always finishes the history."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import h5py
import pytest
from conftest import WORLD, outside
from csv_rows import measures

pytestmark = pytest.mark.skipif(WORLD.size > 1, reason="starts runs of its own")

JOB = """
grid: {points: [32, 24], size: [1.0e-3, 0.75e-3]}
surface: [{shape: wave, amplitude: 2.0e-6, waves: [3, 2]}, {shape: wave, amplitude: 1.0e-6, waves: [-2, 3]}]
material: {model: zener, modulus_inf: 1.0e6, branches: [{modulus: 1.0e6, relaxation_time: 1.0e-3}]}
history: [{pressure: 1.0e5, velocity: 0.1, distance: 3.125e-4, cells_per_step: 0.0625}]
output: {fields: [pressure], every: 7}
checkpoint: {every: 5}
"""  # 160 steps and a jump
SECONDS = 200.0  # in which a run that was hit must have ended
BAD_INPUT, AGAIN = 2, 3


class Runs:
    """Runs of job.yaml in a directory, on two ranks unless told otherwise."""

    def __init__(self, where: Path) -> None:
        self.where, self.started = where, list[subprocess.Popen[str]]()
        (where / "job.yaml").write_text(JOB)

    def start(self, out: Path, ranks: int = 2, program: Sequence[str] = ("-m", "parcontact")) -> subprocess.Popen[str]:
        launch = [str(Path(sys.executable).with_name("mpirun")), "-n", str(ranks)] if ranks > 1 else []
        command = [*launch, sys.executable, *program, "job.yaml", "--quiet", "--out", str(out)]
        pipe, env = subprocess.PIPE, outside.environment()
        process = subprocess.Popen(
            command, cwd=self.where, env=env, stdout=pipe, stderr=pipe, text=True, start_new_session=True
        )
        self.started.append(process)
        return process

    def under_way(self, out: Path, ranks: int = 2) -> subprocess.Popen[str]:
        """A run that has made some steps."""
        before = steps(out)
        process = self.start(out, ranks)
        deadline = time.monotonic() + SECONDS
        while steps(out) < before + 3 and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.005)
        assert process.poll() is None, process.communicate()
        return process

    def finish(self, out: Path, ranks: int = 2) -> str:
        """The same command again; what it says."""
        process = self.start(out, ranks)
        said = process.communicate(timeout=120)[1]
        assert process.returncode == 0, said
        return said


@pytest.fixture
def runs(tmp_path: Path) -> Iterator[Runs]:
    """Ends at the end of the test what is still alive."""
    found = Runs(tmp_path)
    yield found
    for process in found.started:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The undisturbed run."""
    runs = Runs(tmp_path_factory.mktemp("whole"))
    assert runs.finish(Path("whole")) == ""
    return runs.where / "whole"


def children(process: subprocess.Popen[str]) -> list[int]:
    """The ranks that an mpirun has started, by the launcher that it has started."""
    return outside.ranks_of(process.pid)


def steps(out: Path) -> int:
    """Lines of the measures so far."""
    try:
        return (out / "measures.csv").read_bytes().count(b"\n")
    except FileNotFoundError:
        return 0


def ended(process: subprocess.Popen[str]) -> tuple[int, str]:
    """Exit code and errors of a run that was hit."""
    try:
        errors = process.communicate(timeout=SECONDS)[1]
    except subprocess.TimeoutExpired:
        pytest.fail(f"the run has not ended after {SECONDS:g} s")
    return process.returncode, errors


def same(out: Path, whole: Path) -> None:
    """Every digit of the measures and the fields."""
    assert measures(out) == measures(whole)
    with h5py.File(out / "fields.h5") as one, h5py.File(whole / "fields.h5") as other:
        assert one["t"][...].tobytes() == other["t"][...].tobytes()
        assert one["pressure"][...].tobytes() == other["pressure"][...].tobytes()
    assert not list(out.glob("checkpoint/*.part"))


def test_asked_to_stop(runs: Runs, whole: Path, tmp_path: Path) -> None:
    """By a signal to one rank (to mpirun: `test_disturbed.py`), or by a file: it saves and says run again; in the end
    nothing has changed."""
    out = tmp_path / "out"
    asked: list[Callable[[subprocess.Popen[str]], None]] = [
        lambda process: os.kill(children(process)[1], signal.SIGTERM),
        lambda process: (out / "stop").touch(),
    ]
    for ask in asked:
        process = runs.under_way(out)
        ask(process)
        code, errors = ended(process)
        assert code == AGAIN, errors
        assert "Traceback" not in errors
        last = (out / "measures.csv").read_text().splitlines()[-1].split(",")[0]
        assert (out / "checkpoint" / f"step-{last}.h5").exists()
    assert runs.finish(out) == ""
    same(out, whole)


def test_killed(runs: Runs, whole: Path, tmp_path: Path) -> None:
    """One rank, then all and mpirun with them: the others end too, and the next run goes on where it was saved."""
    out = tmp_path / "out"
    process = runs.under_way(out)
    os.kill(children(process)[1], signal.SIGKILL)
    assert ended(process)[0] not in (0, AGAIN)
    process = runs.under_way(out)
    for pid in (process.pid, *children(process)):
        os.kill(pid, signal.SIGKILL)
    assert ended(process)[0] not in (0, AGAIN)
    assert runs.finish(out) == ""
    same(out, whole)


FAILING = """
import sys
from mpi4py import MPI
from parcontact import __main__
from parcontact.errors import RunError
from parcontact.march import loop as march
advance = march.March.advance
def failing(self, step):
    if step.number == 5 and MPI.COMM_WORLD.rank == 1:
        raise {error}
    return advance(self, step)
march.March.advance = failing
sys.exit(__main__.main(sys.argv[1:]))
"""


@pytest.mark.parametrize("error", ["ZeroDivisionError('a mistake of ours')", "RunError('a mistake of ours')"])
def test_error_of_one_rank(runs: Runs, tmp_path: Path, error: str) -> None:
    """All ranks end within seconds, with one message, even when it is an error that all of them should have had."""
    program = FAILING.replace("{error}", error)
    code, errors = ended(runs.start(tmp_path / "out", program=("-c", program)))
    assert code == 1
    said = [line for line in errors.splitlines() if line.startswith("parcontact:")]
    assert len(said) == 1
    assert "on rank 1 of 2" in said[0]
    assert "a mistake of ours" in said[0]


def test_second_run(runs: Runs, tmp_path: Path) -> None:
    """A second run in the directory of one that is alive is refused, and does it no harm."""
    out = tmp_path / "out"
    first = runs.under_way(out)
    first.send_signal(signal.SIGSTOP)
    for pid in children(first):
        os.kill(pid, signal.SIGSTOP)
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    code, errors = ended(runs.start(out, ranks=1))
    assert code == BAD_INPUT
    assert f"the output directory {out} is in use by another run (process {children(first)[0]} on " in errors
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_vanished_directory(runs: Runs, tmp_path: Path) -> None:
    out = tmp_path / "out"
    process = runs.under_way(out, ranks=1)
    shutil.move(out, tmp_path / "elsewhere")
    code, errors = ended(process)
    assert code == 1
    assert errors.splitlines()[-1].startswith("parcontact: cannot ")
    assert "No such file or directory" in errors.splitlines()[-1]
    assert "Traceback" not in errors


@contextmanager
def small_disk(where: Path, kilobytes: int) -> Iterator[Callable[[], None]]:
    """A file system of a given size; the function that it gives makes it larger."""
    where.mkdir()
    if os.geteuid() or subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", where]).returncode:
        pytest.skip("needs to mount a file system")

    def enlarge() -> None:
        subprocess.run(["mount", "-o", "remount,size=100m", where], check=True)

    try:
        yield enlarge
    finally:
        subprocess.run(["umount", where], check=True)


@pytest.mark.parametrize("kilobytes", [40, 350, 550])
def test_full_disk(runs: Runs, tmp_path: Path, whole: Path, kilobytes: int) -> None:
    """No room for the fields, for the first checkpoint, for a later one: one clear message; with room it goes on."""
    with small_disk(tmp_path / "disk", kilobytes) as enlarge:
        out = tmp_path / "disk" / "out"
        code, errors = ended(runs.start(out, ranks=1))
        assert code in (1, BAD_INPUT), errors
        assert "No space left on device" in errors.splitlines()[-1]
        assert "Traceback" not in errors
        saved = len(list((out / "checkpoint").glob("step-*.h5")))
        assert ("the newest checkpoint is" in errors) == (saved > 0)
        enlarge()
        runs.finish(out, ranks=1)
        assert steps(out) == steps(whole)


@pytest.mark.parametrize("place", ["measures.csv", "fields.h5"])
def test_read_only_file(runs: Runs, tmp_path: Path, place: str) -> None:
    out = tmp_path / "out"
    process = runs.under_way(out, ranks=1)
    process.send_signal(signal.SIGUSR1)
    assert ended(process)[0] == AGAIN
    if os.geteuid() == 0:
        if subprocess.run(["chattr", "+i", out / place], stderr=subprocess.DEVNULL).returncode:
            pytest.skip("root may write everything here")
    else:
        (out / place).chmod(0o444)
    try:
        code, errors = ended(runs.start(out, ranks=1))
    finally:
        if os.geteuid() == 0:
            subprocess.run(["chattr", "-i", out / place], check=True)
    assert code in (1, BAD_INPUT)
    assert len(errors.splitlines()) == 1
    assert place in errors
    assert "permitted" in errors or "Permission denied" in errors

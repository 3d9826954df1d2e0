"""What happens to a run from outside: signals, a full disk, a second run; the next run always finishes the history."""

import io
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import h5py
import pytest
import short_job
import yaml
from conftest import WORLD, outside
from csv_rows import measures
from marched_jobs import ROOT

from parcontact import __main__
from parcontact.errors import RunError
from parcontact.files import hdf5, recorder
from parcontact.files.tables import GrowingTable

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


class Runs:
    """Runs of job.yaml in a directory, on two ranks unless stated otherwise."""

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
    """The two ranks that an mpirun has started, by the launcher that it has started. The system may leave out some
    while others start or end, so it is asked again."""
    deadline = time.monotonic() + SECONDS
    while len(found := outside.ranks_of(process.pid)) < 2 and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)
    return found


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


def test_stopped_and_killed(runs: Runs, whole: Path, tmp_path: Path) -> None:
    """Asked to stop by a signal to one rank (to mpirun: below) or by a file, it saves and says run again. When one rank
    is killed, or all and mpirun with them, the others end too, and the next run goes on where it was saved. In the end
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
        raise RunError('a mistake of ours')
    return advance(self, step)
march.March.advance = failing
sys.exit(__main__.main(sys.argv[1:]))
"""


def test_error_of_one_rank(runs: Runs, tmp_path: Path) -> None:
    """All ranks end within seconds, with one message, even when it is an error that all of them should have had."""
    code, errors = ended(runs.start(tmp_path / "out", program=("-c", FAILING)))
    assert code == 1
    said = [line for line in errors.splitlines() if line.startswith("parcontact:")]
    assert len(said) == 1
    assert "on rank 1 of 2" in said[0]
    assert "a mistake of ours" in said[0]


def test_vanished_directory(runs: Runs, tmp_path: Path) -> None:
    out = tmp_path / "out"
    process = runs.under_way(out, ranks=1)
    shutil.move(out, tmp_path / "elsewhere")
    code, errors = ended(process)
    assert code == 1
    assert errors.splitlines()[-1].startswith("parcontact: cannot ")
    assert "No such file or directory" in errors.splitlines()[-1]
    assert "Traceback" not in errors


# -- what must not end a run, and what must: its console, signals, full disks; what it says of itself -----------------

GUMMI: dict[str, Any] = {
    **short_job.JOB,
    "title": "Gummi µ",
    "grid": {"points": [32, 24], "size": [1e-3, 7.5e-4]},
    "history": [{"pressure": 1e4, "velocity": 0.1, "distance": 1.5625e-4, "cells_per_step": 1}],
    "output": {"fields": ["pressure"]},
}
STEPS = 6  # a jump and 5 cells
LONG = ("--set", "history.0.distance=0.3125")  # 10 000 cells
DONE, FAILED, BAD_INPUT, AGAIN = 0, 1, 2, 3
BIN = Path(sys.executable).parent


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A directory with job.yaml, in which we are."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(GUMMI, allow_unicode=True))
    return tmp_path


def rows(out: Path) -> int:
    """Steps in the table, with the initial state."""
    try:
        return (out / "measures.csv").read_bytes().count(b"\n") - 1
    except FileNotFoundError:
        return 0


@pytest.mark.parametrize("place", ["measures.csv", "fields.h5"])
def test_read_only_file(here: Path, capsys: pytest.CaptureFixture[str], place: str) -> None:
    path, words = here / "out" / place, ["job.yaml", "--out", "out", "--quiet"]
    assert __main__.main([*words, "--until", "0.0007"]) == DONE
    if os.geteuid() == 0:
        if subprocess.run(["chattr", "+i", path], stderr=subprocess.DEVNULL).returncode:
            pytest.skip("root may write everything here")
    else:
        path.chmod(0o444)
    try:
        code, errors = __main__.main(words), capsys.readouterr().err
    finally:
        if os.geteuid() == 0:
            subprocess.run(["chattr", "-i", path], check=True)
    assert code in (FAILED, BAD_INPUT)
    assert len(errors.splitlines()) == 1
    assert place in errors
    assert "permitted" in errors or "Permission denied" in errors


class Broken(io.TextIOWrapper):
    """A stream whose reader has gone."""

    def write(self, text: str) -> int:
        raise BrokenPipeError(32, "Broken pipe")


def closed() -> io.StringIO:
    stream = io.StringIO()
    stream.close()
    return stream


STREAMS: dict[str, Callable[[], Any]] = {
    "full": lambda: Path("/dev/full").open("w"),  # noqa: SIM115  # closed by the test
    "broken": lambda: Broken(io.BytesIO()),
    "none": lambda: None,
    "closed": closed,
    "ascii": lambda: io.TextIOWrapper(io.BytesIO(), encoding="ascii"),
}


@pytest.mark.parametrize("kind", STREAMS)
def test_console_is_not_the_run(here: Path, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    """Neither the lines of the steps nor warnings end a run, whoever reads them."""
    stream = STREAMS[kind]()
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", stream)
        patch.setattr(sys, "stderr", stream)
        code = __main__.main(["job.yaml", "--out", "out"])
    if kind == "full":
        stream.close()  # what it held has gone nowhere
    if kind == "ascii":
        stream.flush()
        assert b"Gummi u" in stream.buffer.getvalue()
    assert (code, rows(here / "out")) == (DONE, STEPS + 1)
    assert "Gummi µ" in (here / "out" / "run.log").read_text(encoding="utf-8")


def test_reader_that_leaves(here: Path, outside_mpi: dict[str, str]) -> None:
    """`parcontact job.yaml | head -n 1` ends with the code of the run, and says nothing of it."""
    command = f"{sys.executable} -m parcontact job.yaml --out out | head -n 1; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], env=outside_mpi, capture_output=True, text=True, timeout=SECONDS)
    assert (done.returncode, done.stderr) == (DONE, "")
    assert rows(here / "out") == STEPS + 1


def start(words: Sequence[str], environment: dict[str, str], ranks: int = 1) -> subprocess.Popen[str]:
    launch = [str(BIN / "mpirun"), "-n", str(ranks)] if ranks > 1 else []
    command = [*launch, sys.executable, "-m", "parcontact", *words, "--quiet"]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, env=environment, stdout=pipe, stderr=pipe, text=True, start_new_session=True)


def wait_for(process: subprocess.Popen[str], there: Callable[[], bool]) -> None:
    deadline = time.monotonic() + SECONDS
    while not there() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(2e-3)
    assert process.poll() is None, process.communicate()


def newest(out: Path) -> int:
    return max((int(path.stem[5:]) for path in out.glob("checkpoint/step-*.h5")), default=-1)


def test_mpirun_that_is_asked_to_end(here: Path, outside_mpi: dict[str, str]) -> None:
    """Its ranks save the last step that they have made, and it ends with 3 as they do."""
    process = start(["job.yaml", "--out", "out", *LONG], outside_mpi, ranks=2)
    wait_for(process, lambda: rows(here / "out") > 3)
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=SECONDS)
    assert process.returncode == AGAIN
    assert newest(here / "out") == rows(here / "out") - 1


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGUSR1])
def test_signals_that_mpirun_hands_on(here: Path, number: signal.Signals) -> None:
    """A launcher is asked by SIGUSR1, whatever signal it was. The tests may run under nohup, which ignores SIGHUP."""
    launcher = "trap 'exit 3' USR1; touch ready; while :; do sleep 0.05; done"
    words = [sys.executable, "-I", "-S", str(ROOT / "scripts/launch.py"), "sh", "-c", launcher]
    heard = lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL)  # noqa: E731
    process = subprocess.Popen(words, start_new_session=True, text=True, preexec_fn=heard)
    wait_for(process, (here / "ready").exists)
    process.send_signal(number)
    assert process.wait(timeout=SECONDS) == AGAIN


def test_signal_during_the_start(here: Path, outside_mpi: dict[str, str]) -> None:
    """There is nothing to save yet: it ends the process at once, which says so."""
    (here / "out").mkdir()
    for name in ("theory.csv", "theory.yaml"):
        (here / "out" / name).touch()
    process = start(["job.yaml", "--out", "out", *LONG, "--set", "grid.points=[2048, 1536]"], outside_mpi)
    wait_for(process, lambda: (here / "out" / ".lock").exists())
    process.send_signal(signal.SIGTERM)
    assert process.communicate(timeout=SECONDS)[1] == "parcontact: ended by SIGTERM, with nothing to save\n"
    assert process.returncode == -signal.SIGTERM
    assert not (here / "out" / "measures.csv").exists()


def test_full_disk_while_rows_are_written(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The real reason is stated, the state is saved, and the same command makes up for the row that had no room."""
    append = GrowingTable.append

    def full(self: GrowingTable, cells: Sequence[str]) -> None:
        if cells[0] == "3":
            raise OSError(28, "No space left on device")
        append(self, cells)

    with monkeypatch.context() as patch:
        patch.setattr(GrowingTable, "append", full)
        assert __main__.main(["job.yaml", "--out", "out", "--quiet"]) == FAILED
    said = capsys.readouterr().err
    assert "cannot write out/measures.csv: No space left on device; the newest checkpoint is " in said
    assert __main__.main(["job.yaml", "--out", "out", "--quiet"]) == DONE
    assert rows(here / "out") == STEPS + 1
    lines = (here / "out" / "measures.csv").read_text().splitlines()
    assert [line.split(",")[0] for line in lines[1:]] == [str(step) for step in range(STEPS + 1)]


def test_full_disk_while_maps_are_written(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The map that had no room is saved by the run that goes on."""
    write, maps = hdf5.write_rows, []

    def full(path: Path, slab: Any, parts: Any) -> None:
        if path.name == "fields.h5":
            maps.append(path)
            if len(maps) == 3:
                raise RunError(f"cannot write {path}: No space left on device")
        write(path, slab, parts)

    with monkeypatch.context() as patch:
        patch.setattr(hdf5, "write_rows", full)
        assert __main__.main(["job.yaml", "--out", "out", "--quiet"]) == FAILED
    assert "No space left on device; the newest checkpoint is out/checkpoint/step-3.h5" in capsys.readouterr().err
    assert __main__.main(["job.yaml", "--out", "out", "--quiet"]) == DONE
    assert __main__.main(["job.yaml", "--out", "whole", "--quiet"]) == DONE
    one, other = ((here / out / "fields.h5").read_bytes()[-STEPS * 32 * 24 * 8 :] for out in ("out", "whole"))
    assert one == other


def test_log_and_time_left(here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """run.log begins with what one asks for; where there is no terminal, a line tells the time left. The
    first step takes longer than others, so that no time follows from it."""
    monkeypatch.setattr(recorder, "LEFT_SECONDS", 0.0)
    monkeypatch.setenv("SLURM_JOB_ID", "4711")
    monkeypatch.setattr(sys, "argv", ["/usr/bin/parcontact", "job.yaml", "--out", "out"])
    assert __main__.main(["job.yaml", "--out", "out"]) == DONE
    said = capsys.readouterr().out
    assert said.count(" left\n") == STEPS - 2
    assert f"# step 2 of {STEPS}, about 0:00:0" in said
    head = "\n".join((here / "out" / "run.log").read_text(encoding="utf-8").splitlines()[:5])
    for part in ("parcontact 0.", f"process {os.getpid()}", "parcontact job.yaml --out out", "1 rank, ", "MPI"):
        assert part in head
    for part in ("batch job: SLURM_JOB_ID = 4711", "cores", "GB of memory", "load "):
        assert part in head


def test_info_of_directories(here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """What ran, how far it came, what came out; of several, one below the other."""
    curve = ("--velocities", "0.01:0.1:2", "--pressures", "1e4")
    assert __main__.main(["job.yaml", "--out", "out", "--until", "0.0007", "--quiet"]) == DONE
    assert __main__.main(["steady", "job.yaml", "--out", "out", *curve, "--quiet"]) == DONE
    capsys.readouterr()
    assert __main__.main(["info", "out"]) == DONE
    said = capsys.readouterr().out
    assert "run: not finished after step 4 of 6, t = 937.5 µs of 1.562 ms, 5 rows" in said
    assert "2 steps to go: " in said
    for part in ("last row: pressure 10 kPa, friction ", "friction curve: 2 points from 0.01 to 0.1 m/s", "checkpoint"):
        assert part in said
    assert "fields: pressure at 4 of 6 instants" in said
    assert __main__.main(["job.yaml", "--out", "out", "--quiet"]) == DONE
    assert __main__.main(["info", "out", "out/fields.h5"]) == DONE
    said = capsys.readouterr().out
    assert f"run: finished after step {STEPS}" in said
    assert "out/fields.h5: pressure on 32 x 24 points" in said
    assert __main__.main(["info", "out", "job.yaml"]) == BAD_INPUT
    (here / "out" / "measures.csv").write_text("step,time\n1\n")
    assert __main__.main(["info", "out"]) == BAD_INPUT
    assert "measures.csv, line 2, has 1 values instead of 2" in capsys.readouterr().out

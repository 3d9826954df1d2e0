"""What all tests share: communicators, the program as a user starts it, and failing together under mpirun."""

import io
import math
import subprocess
import sys
import time
import zlib
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import hypothesis
import pytest
from _pytest.config import create_terminal_writer
from marched_jobs import load_script
from mpi4py import MPI
from restarting import Bench

from parcontact import __main__

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WORLD = MPI.COMM_WORLD
REFEREE = WORLD.Dup()  # what ranks tell each other about tests must not meet the messages of the tests
UNSEEN = io.StringIO()  # what pytest says on the other ranks
outside = load_script("runs")
MOST_RANKS = 4  # that scripts/test starts
MAX_SECONDS_APART = 20.0  # seconds in which the other ranks must end a test that failed here

# All ranks must see the same examples, and a first example waits for the compiler.
hypothesis.settings.register_profile("ranks", derandomize=WORLD.size > 1, deadline=None)
hypothesis.settings.load_profile("ranks")


@pytest.fixture(scope="session")
def comm() -> MPI.Comm:
    return WORLD


@pytest.fixture(scope="session")
def communicators() -> list[MPI.Comm]:
    """The communicators of the first 1, 2, ... ranks, as far as this rank belongs to them."""
    groups = [WORLD.Split(0 if WORLD.rank < size else MPI.UNDEFINED) for size in range(1, WORLD.size + 1)]
    return [group for group in groups if group != MPI.COMM_NULL]


@pytest.fixture
def shared_path(tmp_path: Path) -> Path:
    """A temporary directory that is the same on all ranks."""
    return WORLD.bcast(tmp_path)


@pytest.fixture
def bench(comm: MPI.Intracomm, shared_path: Path) -> Bench:
    """Runs on all ranks."""
    return Bench(comm, shared_path)


Main = Callable[..., tuple[int, str, str]]


class RunParcontact(Protocol):
    def __call__(
        self, args: Sequence[str | Path], ranks: int = 1, cwd: Path | None = None, timeout: float = 240.0
    ) -> subprocess.CompletedProcess[str]: ...


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's cache directory, which is not there yet."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def outside_mpi() -> dict[str, str]:
    """The environment of a process outside MPI, which ends at warnings of NumPy as the tests do."""
    return outside.environment() | {"PYTHONWARNINGS": "error::RuntimeWarning"}


@pytest.fixture
def run_parcontact(tmp_path: Path, outside_mpi: dict[str, str]) -> RunParcontact:
    """`run_parcontact(["job.yaml", "--quiet"], ranks=2)`: as a user would, in `tmp_path`; 0 ranks is without mpirun."""

    def run(
        args: Sequence[str | Path], ranks: int = 1, cwd: Path | None = None, timeout: float = 240.0
    ) -> subprocess.CompletedProcess[str]:
        mpirun = [str(Path(sys.executable).with_name("mpirun")), "-n", str(ranks)] if ranks else []
        command = [*mpirun, sys.executable, "-m", "parcontact", *map(str, args)]
        pipe = subprocess.PIPE
        process = subprocess.Popen(command, cwd=cwd or tmp_path, env=outside_mpi, stdout=pipe, stderr=pipe, text=True)
        try:
            out, err = process.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            process.terminate()  # mpirun ends its ranks; were it killed, they would go on
            out, err = process.communicate(timeout=30.0)
            pytest.fail(f"{' '.join(command)} took more than {timeout:g} s\n{out}\n{err}")
        return subprocess.CompletedProcess(command, process.returncode, out, err)

    return run


@pytest.fixture
def main(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Main:
    """The command line in this process: exit code, output, errors."""
    monkeypatch.chdir(tmp_path)

    def run(*words: str | Path) -> tuple[int, str, str]:
        try:
            code = __main__.main([str(word) for word in words])
        except SystemExit as error:
            code = int(error.code or 0)
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


@pytest.fixture
def drawn() -> "list[Figure]":
    """The figures that have been saved, laid out."""
    return []


@pytest.fixture(autouse=True)
def blank_pictures(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Save files of pictures with nothing on them, unless a test is marked `rendered`; lay figures out only for tests
    that look at them: these are marked, or ask for `drawn`, or watch pictures."""
    looked_at, rendered = "drawn" in request.fixturenames, request.node.get_closest_marker("rendered")
    if "matplotlib" not in sys.modules and not looked_at and "main" not in request.fixturenames:
        return  # it is not imported for a test that draws nothing
    from matplotlib.figure import Figure

    from parcontact.results import style

    draw, figures = Figure.savefig, request.getfixturevalue("drawn") if looked_at else list[Any]()

    def save(figure: Figure, file: Any, **options: Any) -> None:
        figures.append(figure)
        if rendered:
            draw(figure, file, **options)
        else:
            draw(Figure(figsize=(0.1, 0.1)), file, **{**options, "dpi": 20})

    monkeypatch.setattr(Figure, "savefig", save)
    if not looked_at and not rendered:
        monkeypatch.setattr(style, "arrange", lambda figure: None)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Under mpirun no test may start another mpirun, and some are for certain numbers of ranks."""
    if WORLD.size > 1:
        passed_over = [item for item in items if "outside_mpi" in getattr(item, "fixturenames", ()) or elsewhere(item)]
        config.hook.pytest_deselected(items=passed_over)
        items[:] = [item for item in items if item not in passed_over]


def elsewhere(item: pytest.Item) -> bool:
    """Whether a test is for other numbers of ranks than this one: it names its own, or makes groups of all smaller ones
    from the most that tests run on, or runs on two, three or four ranks as its name has it."""
    mark = item.get_closest_marker("mpi")
    if mark is None:
        return False
    groups = "communicators" in getattr(item, "fixturenames", ())
    own = MOST_RANKS if groups else 2 + zlib.crc32(item.nodeid.encode()) % 3
    return WORLD.size not in (mark.args or (own,))


@pytest.hookimpl(trylast=True)
def pytest_configure(config: pytest.Config) -> None:
    """Only rank 0 prints."""
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    if WORLD.rank > 0 and reporter is not None:
        reporter._tw = create_terminal_writer(config, UNSEEN)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if WORLD.size > 1:
        agree(report)
    return report


def agree(report: pytest.TestReport) -> None:
    """Make a test that fails on one rank fail on all, so that they enter the next one together."""
    own = f"on rank {WORLD.rank}: {report.outcome}\n{report.longreprtext}"
    arrival = REFEREE.Ibarrier()
    deadline = time.monotonic() + MAX_SECONDS_APART if report.failed else math.inf
    while not arrival.Test():
        if time.monotonic() > deadline:
            print(f"\n{report.nodeid} {own}\nother ranks did not finish it", file=sys.stderr, flush=True)
            WORLD.Abort(1)
        time.sleep(1e-3)
    outcomes = REFEREE.allgather((report.outcome, own))
    if len({outcome for outcome, _ in outcomes}) > 1:
        report.outcome = "failed"
        report.longrepr = "\n".join(text for outcome, text in outcomes if outcome != "passed")


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> Generator[None]:
    """A rank that leaves without having agreed (it could not read a test, say) ends all."""
    yield
    agreed = (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED, pytest.ExitCode.NO_TESTS_COLLECTED)
    if WORLD.size > 1 and exitstatus not in agreed:
        session.config.get_terminal_writer().flush()
        if WORLD.rank > 0:
            time.sleep(2.0)  # rank 0 may say the same
            print(f"rank {WORLD.rank}:\n{UNSEEN.getvalue()}", file=sys.stderr, flush=True)
        WORLD.Abort(exitstatus)

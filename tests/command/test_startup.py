"""The program opens at once: what takes long to import is imported by verbs that need it, and by no other."""

import subprocess
import sys
from pathlib import Path

import pytest
from conftest import Main, RunParcontact

from parcontact import __main__

JOBS = Path(__file__).parents[2] / "jobs"
SLOW = ("mpi4py.MPI", "numba", "numpy", "scipy", "pyfftw", "matplotlib", "h5py", "pydantic", "yaml", "xarray")
WATCHED = """
import sys
from parcontact.__main__ import main
try:
    code = main(sys.argv[2:])
except SystemExit as ended:
    code = ended.code
print("imported:", *(name for name in sys.argv[1].split(",") if name in sys.modules))
sys.exit(code)
"""


def imported(environment: dict[str, str], *words: object, cwd: Path) -> tuple[int, set[str]]:
    """The exit code of a command line, and which of the slow modules it has imported."""
    command = [sys.executable, "-c", WATCHED, ",".join((*SLOW, *FURTHER)), *map(str, words)]
    done = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True)
    return done.returncode, set(done.stdout.splitlines()[-1].removeprefix("imported:").split())


OF_SCIPY = ("scipy.special", "scipy.fft", "scipy.optimize", "scipy.linalg", "pyfftw.interfaces", "numpy.f2py")
FURTHER = (*OF_SCIPY, "parcontact.march.scene", "tqdm")
LIGHT: list[tuple[list[object], int, set[str]]] = [
    (["--help"], 0, set()),
    (["--version"], 0, set()),
    (["run", "--help"], 0, set()),
    (["help", "steady"], 0, set()),
    ([], 2, set()),
    (["plt", "out/job"], 2, set()),
    (["--wrong"], 2, set()),
    (["check", JOBS / "westergaard.yaml"], 0, {"pydantic", "yaml"}),
    (["check", JOBS / "velocity_step.yaml"], 0, {"pydantic", "yaml"}),
    (["check", "absent.yaml"], 2, {"pydantic", "yaml"}),
]


@pytest.mark.parametrize(("words", "code", "needed"), LIGHT)
def test_light_verbs(
    words: list[object], code: int, needed: set[str], outside_mpi: dict[str, str], tmp_path: Path
) -> None:
    assert imported(outside_mpi, *words, cwd=tmp_path) == (code, needed)


def test_info_and_a_run(outside_mpi: dict[str, str], tmp_path: Path) -> None:
    """A run needs loops, transforms, MPI and files; nothing to draw with, and nothing of scipy but its name."""
    words = [JOBS / "westergaard.yaml", "--quiet", "--out", "out"]
    code, found = imported(outside_mpi, *words, cwd=tmp_path)
    assert code == 0
    assert not found & {*OF_SCIPY, "matplotlib", "xarray"}
    code, found = imported(outside_mpi, "info", "out/checkpoint/step-5.h5", cwd=tmp_path)
    assert code == 0
    assert not found & {"numba", "scipy", "pyfftw.interfaces", "matplotlib", "xarray", "parcontact.march.scene"}


def test_the_package_alone(outside_mpi: dict[str, str]) -> None:
    program = "import sys, parcontact; print([m for m in sys.argv[1:] if m in sys.modules])"
    words = [sys.executable, "-c", program, *SLOW, *FURTHER]
    assert subprocess.run(words, env=outside_mpi, capture_output=True, text=True).stdout == "[]\n"


def test_pyfftw_is_whole_for_others(outside_mpi: dict[str, str]) -> None:
    """Its interfaces, left out at first, are there for who asks."""
    program = (
        "import parcontact.parallel.fft, pyfftw\n"
        "assert not hasattr(pyfftw, 'absent')\n"
        "print(pyfftw.interfaces.scipy_fft.fft.__module__)"
    )
    done = subprocess.run([sys.executable, "-c", program], env=outside_mpi, capture_output=True, text=True)
    assert done.stdout == "pyfftw.interfaces.scipy_fft\n", done.stderr


@pytest.mark.parametrize(
    ("words", "code", "once"),
    [
        (["--version"], 0, "parcontact 0"),
        (["--wrong"], 2, "usage:"),
        (["absent.yaml"], 2, "absent.yaml: cannot be read"),
    ],
)
def test_ranks_speak_once(run_parcontact: RunParcontact, words: list[str], code: int, once: str) -> None:
    """On three ranks, whether MPI has started or not."""
    done = run_parcontact(words, ranks=3)
    assert done.returncode == code
    assert (done.stdout + done.stderr).count(once) == 1
    assert "alone" not in done.stderr
    assert "Traceback" not in done.stderr


def test_interrupted_before_it_has_begun(main: Main, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C means: run again, with the code that says so."""

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(__main__, "parse_arguments", interrupted)
    code, _, said = main("job.yaml")
    assert (code, said) == (3, "parcontact: ended by KeyboardInterrupt\n")

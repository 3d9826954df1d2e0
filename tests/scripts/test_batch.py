"""Batch templates, with stand-ins for the commands of Slurm and PBS: each notes how it was called."""

import shlex
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import pytest

from parcontact.__main__ import main
from parcontact.door.arguments import parse_arguments, without_restart

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"
NOTE = "{{ printf '%s|' {0} \"$@\"; echo; }} >> said"
STUBS = {
    "squeue": "date --iso-8601=seconds --date @2000000000",
    "qstat": 'echo "    Resource_List.walltime = 01:00:08"',
    "sbatch": NOTE.format("sbatch"),
    "qsub": f'{NOTE.format("qsub")}; echo "$JOB" > JOB',
    "date": 'if [ "$*" = +%s ]; then echo 1000; else exec /bin/date "$@"; fi',
    "parcontact": "exit 99",
    **{
        name: f'{NOTE.format(name)}; echo "${{SLURM_JOB_END_TIME:-}}${{PARCONTACT_END_TIME:-}}" > end\n'
        'while [ "${1##*/}" != parcontact ]; do shift; done\nshift\n'
        '[ -z "$LEFT" ] || printf "%s\\n" "$LEFT" "$@" > "$PARCONTACT_EXIT_FILE"\nexit $CODE'
        for name in ("mpirun", "srun")
    },
}
BOTH = pytest.mark.parametrize("system", ["slurm", "pbs"])


class Link(NamedTuple):
    """What one job of a chain came to: the exit code, what started the ranks, what parcontact was given, and what the
    next job is given (None if there is none)."""

    code: int
    launcher: list[str]
    given: list[str]
    next: list[str] | None
    submitted: list[str]


Batch = Callable[..., Link]


@pytest.fixture
def batch(tmp_path: Path) -> Batch:
    """`batch("slurm", ["job.yaml"], CODE=3)` runs the template; capitals are variables of its environment."""
    for name, text in STUBS.items():
        (tmp_path / name).write_text(f"#!/bin/sh\n{text}\n")
        (tmp_path / name).chmod(0o755)
    (tmp_path / "nodes").write_text("a\na\n")
    there = str(tmp_path)
    slurm = {"SLURM_JOB_ID": "7", "SLURM_NTASKS": "2", "SLURM_SUBMIT_DIR": there}
    pbs = {"PBS_JOBID": "7.host", "PBS_O_WORKDIR": there, "PBS_NODEFILE": f"{there}/nodes"}

    def run(system: str, words: Sequence[str], job: str = "", **variables: object) -> Link:
        env = {"PATH": f"{there}:/usr/bin:/bin", "PARCONTACT_BIN": there, "CODE": "0"}
        env |= slurm if system == "slurm" else {**pbs, "JOB": job or shlex.join(words)}
        env |= {name: str(value) for name, value in {"LEFT": variables.get("CODE", "0"), **variables}.items()}
        command = ["bash", str(SCRIPTS / "batch.sh"), *(words if system == "slurm" else ())]
        done = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True)
        assert done.stderr == ""
        said = [line.split("|")[:-1] for line in (tmp_path / "said").read_text().splitlines()]
        (tmp_path / "said").unlink()
        at = said[0].index(f"{there}/parcontact")
        following: list[str] | None = None
        if len(said) > 1 and system == "slurm":
            following = said[1][said[1].index(str(SCRIPTS / "batch.sh")) + 1 :]
        elif len(said) > 1:
            following = shlex.split((tmp_path / "JOB").read_text())
        assert not list(tmp_path.glob(".parcontact-exit*"))
        return Link(done.returncode, said[0][:at], said[0][at + 1 :], following, said[1] if len(said) > 1 else [])

    return run


@BOTH
@pytest.mark.parametrize("code", [0, 1, 2, 3])
def test_next_job(batch: Batch, tmp_path: Path, system: str, code: int) -> None:
    """The end of the job is handed on to the program, and the next one submitted exactly when that says: run again."""
    words = ["job.yaml", "--quiet"]
    link = batch(system, words, CODE=code)
    assert link[:3] == (0 if code == 3 else code, ["mpirun", "-n", "2"], words)
    assert link.next == (words if code == 3 else None)
    assert (tmp_path / "end").read_text().strip() == {"slurm": "2000000000", "pbs": "4608"}[system]


@BOTH
def test_next_job_has_the_words_that_the_program_leaves(batch: Batch, system: str) -> None:
    """A line each; here the stand-in adds one to those that it was given."""
    assert batch(system, ["job.yaml", "--quiet"], CODE=3, LEFT="3\na b").next == ["a b", "job.yaml", "--quiet"]


@pytest.mark.parametrize("how", [["--restart", "never"], ["--restart=never"], ["--rest", "out/a b/step-9.h5"], []])
def test_the_command_that_goes_on(how: list[str]) -> None:
    """It has no --restart: a chain of jobs that each start afresh, or from one checkpoint, never ends."""
    words = ["my job.yaml", "--set", "a=[1, 2]", *how, "--until", "1.5", "--out=x", "--quiet"]
    assert without_restart(words) == [word for word in words if word not in how]


def test_requeued_job_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Slurm repeats the command of a job that it has requeued, and says so."""
    words = ["job.yaml", "--restart", "never"]
    for count, restart in (("", "never"), ("0", "never"), ("1", "auto")):
        monkeypatch.setenv("SLURM_RESTART_COUNT", count)
        assert parse_arguments(words).restart == restart


def test_jobs_of_an_array_write_files_of_their_own(batch: Batch, tmp_path: Path) -> None:
    """All would append to the file of the first of them."""
    batch("slurm", ["job.yaml"], SLURM_ARRAY_TASK_ID=4, SLURM_JOB_NAME="road", CODE=1)
    assert (tmp_path / "slurm-road-4.out").is_file()


@BOTH
def test_names_with_spaces(batch: Batch, tmp_path: Path, system: str) -> None:
    words = ["my job.yaml", "--out", "out, of it/a 'b'"]
    link = batch(system, words, CODE=3)
    assert link.given == link.next == words
    if system == "pbs":
        (tmp_path / "my job.yaml").touch()
        link = batch("pbs", [], job="my job.yaml", CODE=3)
        assert link.given == link.next == ["my job.yaml"]
        assert batch("pbs", [], job="my\\ job.yaml").given == ["my job.yaml"]


@BOTH
@pytest.mark.parametrize(("code", "left", "again"), [(143, 3, True), (3, 3, True), (3, 0, False), (137, "", False)])
def test_launcher_with_a_code_of_its_own(batch: Batch, system: str, code: int, left: object, again: bool) -> None:
    """What parcontact has left counts; a launcher's code only where parcontact could not."""
    link = batch(system, ["job.yaml"], CODE=code, LEFT=left)
    assert (link.next is not None) == again
    assert link.code == (0 if again else left if left != "" else code)


@BOTH
def test_launcher(batch: Batch, tmp_path: Path, system: str) -> None:
    """The one asked for, with its options; without one next to parcontact, that of the machine."""
    link = batch(system, ["job.yaml"], PARCONTACT_LAUNCHER="srun --mpi=pmix", CODE=3)
    assert link.launcher == ["srun", "--mpi=pmix", "-n", "2"]
    assert system == "slurm" or link.submitted[1:3] == ["-v", "JOB,PARCONTACT_BIN,PARCONTACT_LAUNCHER"]
    (tmp_path / "alone").mkdir()
    (tmp_path / "parcontact").rename(tmp_path / "alone/parcontact")
    (tmp_path / "parcontact").symlink_to("alone/parcontact")
    assert batch(system, ["job.yaml"]).launcher == ["mpirun", "-n", "2"]


@pytest.mark.parametrize(
    ("system", "variable"), [("slurm", "SLURM_ARRAY_TASK_ID"), ("pbs", "PBS_ARRAY_INDEX"), ("pbs", "PBS_ARRAYID")]
)
def test_job_array(batch: Batch, system: str, variable: str) -> None:
    """Each of its jobs knows its index, and submits only itself again."""
    link = batch(system, ["job.yaml", "--out", "out/%a"], CODE=3, **{variable: 12})
    assert link.given == ["job.yaml", "--out", "out/12"]
    assert [word.replace("%a", "12") for word in link.next or []] == link.given
    assert (link.submitted[1] == "--array=12") == (system == "slurm")


JOB = """
grid: {points: 8, size: 1.0e-3}
surface: {shape: wave, amplitude: 1.0e-6, waves: [1, 1]}
material: {model: elastic, shear_modulus: 1.0e6}
history: [{pressure: 1.0e3, duration: 4.0, time_step: 1.0}]
"""


def test_without_a_batch_system(tmp_path: Path) -> None:
    command = ["bash", str(SCRIPTS / "batch.sh"), "job.yaml"]
    done = subprocess.run(command, cwd=tmp_path, env={"PATH": "/usr/bin:/bin"}, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("submit this script: sbatch ")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("words", "code"), [([], 0), (["--until", "1"], 0), (["--set", "grid.points=0"], 2)])
def test_exit_code_in_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], code: int) -> None:
    """Root leaves it where PARCONTACT_EXIT_FILE says; 3 too, when a file `stop` asks for it."""
    (tmp_path / "job.yaml").write_text(JOB)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PARCONTACT_EXIT_FILE", str(tmp_path / "code"))
    assert main(["job.yaml", "--quiet", *words]) == code
    assert (tmp_path / "code").read_text() == f"{code}\n"
    if words[:1] == ["--until"]:
        (tmp_path / "out/job/stop").touch()
        assert main(["job.yaml", "--quiet", "--restart", "auto", "--out", "out/job"]) == 3
        assert (tmp_path / "code").read_text() == "3\njob.yaml\n--quiet\n--out\nout/job\n"

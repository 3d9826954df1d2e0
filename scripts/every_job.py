"""Run all jobs of jobs/ on their true grids: each is run, run again, and reported; prints a line for each.

python scripts/every_job.py [--only NAME] [--minutes M] [--ranks N]

A job that takes longer than the minutes is stopped with a checkpoint and counts as stopped early. The exit code is 1 if
anything ends otherwise. Results go into the working directory. Make what the jobs of roads need before
(jobs/road/README.md).
"""

import argparse
import subprocess
import sys
import time
from pathlib import Path

import runs

JOBS = Path(__file__).resolve().parents[1] / "jobs"
DONE, STOPPED = 0, 3
GRACE = 120.0  # seconds after the wall time in which a run must have ended


def jobs(only: str) -> list[Path]:
    """Return the files of all jobs whose path contains a name; other YAML files hold materials."""
    files = (path for path in sorted(JOBS.rglob("*.yaml")) if "surface:" in path.read_text())
    return [path for path in files if only in str(path.relative_to(JOBS))]


def ended(ranks: int, *words: str, seconds: float) -> int:
    """Return the exit code of the program; 1 also for a traceback, or if it does not end in time."""
    start = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    command = [*start, sys.executable, "-m", "parcontact", *words]
    with subprocess.Popen(
        command, env=runs.environment(), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    ) as process:
        try:
            said = process.communicate(timeout=seconds + GRACE)[1].decode()
        except subprocess.TimeoutExpired:
            process.terminate()
            return 1
    return 1 if "Traceback" in said else process.returncode


def tried(job: Path, minutes: float, ranks: int) -> tuple[bool, str]:
    """Run a job, run it again, and report it. Return whether all ended as they must, and a line."""
    name, begun = str(job.relative_to(JOBS).with_suffix("")), time.monotonic()
    out, wall = str(Path("out", name)), f"0:{int(minutes)}:{int(60 * (minutes % 1))}"
    words = [str(job), "--quiet", "--out", out, "--wall", wall]
    first = ended(ranks, *words, seconds=60.0 * minutes)
    codes = {"run": first}
    if first in (DONE, STOPPED):
        codes |= {
            "again": ended(ranks, *words, seconds=60.0 * minutes),
            "report": ended(1, "report", out, seconds=60.0),
        }
    right = first in (DONE, STOPPED) and codes["again"] in (DONE, first) and codes["report"] == DONE
    said = ", ".join(f"{verb} {code}" for verb, code in codes.items())
    return right, f"{name}: {'good' if right else 'WRONG'} ({said}), {time.monotonic() - begun:.0f} s"


def main() -> int:
    """Try all jobs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="part of the path of a job, such as hertz or stick/")
    parser.add_argument(
        "--minutes", type=float, default=10.0, help="wall time of each run [min], below 60 (default: 10)"
    )
    parser.add_argument("--ranks", type=int, default=1)
    options = parser.parse_args()
    wrong, chosen = 0, jobs(options.only)
    for job in chosen:
        right, line = tried(job, options.minutes, options.ranks)
        wrong += not right
        print(line, flush=True)
    print(f"{len(chosen)} jobs: {wrong} wrong")
    return 1 if wrong or not chosen else 0


if __name__ == "__main__":
    sys.exit(main())

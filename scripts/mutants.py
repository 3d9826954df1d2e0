"""Breaks the code in places that matter for stability, one at a time, and says which test of tests/stability sees it.

    python scripts/mutants.py [name ...]

Works on a copy of the last commit in a temporary directory; compiled loops are kept there from one run to the next. All
is well if no more than one change of ten goes unseen; it takes some minutes.
"""

import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
FIRST = "test_hard_cases.py"  # of the files of tests
LONGEST = 900.0  # seconds for the tests of one change
UNSEEN = 0.1  # share of the changes that may go unseen


@dataclass(frozen=True)
class Mutant:
    """A change of one place in the code: `old`, which stands there once, becomes `new`."""

    name: str
    file: str
    old: str
    new: str


MATERIAL, SOLVER, SURFACE = "physics/body.py", "solve/contact.py", "physics/surface.py"
MUTANTS = (
    Mutant("exp - 1 for expm1", MATERIAL, "-np.expm1(-z)", "1.0 - np.exp(-z)"),
    Mutant("decay of the other integrator", MATERIAL, "return np.exp(-z), ", "return 1.0 / (1.0 + z), "),
    Mutant("no limit to dt/tau", MATERIAL, ", 1e-100 * dt)", ", 0.0)"),
    Mutant("no jumps", "job/timeline.py", "_jumps(stage, before), ends", "stage.seconds == 0.0, ends"),
    Mutant(
        "no centring",
        SOLVER,
        "(sum_z / members, sum_t / members) if centred else (0.0, 0.0)",
        "(0.0, 0.0)",
    ),
    Mutant("no halving of steps", SOLVER, "HALVINGS = 12 ", "HALVINGS = 0 "),
    Mutant("no scaling to the load", SOLVER, "if cut and mean is not None:", "if False:"),
    Mutant(
        "sums in single precision",
        "parallel/slab.py",
        "return [*map(float, sums), *map(float, maxima)]",
        "return [float(np.float32(value)) for value in (*sums, *maxima)]",
    ),
    Mutant("slope at the Nyquist wavenumber", SURFACE, "symbol[nyquist] = 0.0", "pass"),
    Mutant(
        "Nyquist column counted twice", "parallel/fft.py", "(along_x == 0) | (2 * along_x == self.mx)", "along_x == 0"
    ),
    Mutant(
        "friction of the other sign",
        "physics/loops.py",
        "p[j, i].imag * h[j, i].real - p[j, i].real * h[j, i].imag",
        "p[j, i].real * h[j, i].imag - p[j, i].imag * h[j, i].real",
    ),
    Mutant(
        "Love's coefficients off by a cell",
        "physics/convolution.py",
        "index, index - count)",
        "index, index - count + 1)",
    ),
)


def copy(target: Path) -> None:
    """The last commit."""
    archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, check=True, capture_output=True).stdout
    subprocess.run(["tar", "-x", "-C", target], input=archive, check=True)


def first_failure(tree: Path) -> tuple[str, float]:
    """The first test that fails, '' if none does, and the seconds until then."""
    files = sorted((tree / "tests/stability").glob("test_*.py"), key=lambda path: (path.name != FIRST, path.name))
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *map(str, files)]
    began = time.monotonic()
    environment = {**os.environ, "PYTHONPATH": str(tree), "OMP_NUM_THREADS": "1"}
    try:
        ran = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True, timeout=LONGEST)
    except subprocess.TimeoutExpired:
        return f"not done in {LONGEST:g} s", LONGEST
    seen = [line.split()[1] for line in ran.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    if ran.returncode and not seen:
        seen = [f"exit code {ran.returncode}: {(ran.stdout + ran.stderr).strip().splitlines()[-1]}"]
    return "".join(seen[:1]).removeprefix("tests/stability/"), time.monotonic() - began


def try_out(mutant: Mutant, tree: Path) -> tuple[str, float]:
    """The first test that sees a change; the file is then as it was, to its time, so that its loops stay compiled."""
    path = tree / "parcontact" / mutant.file
    text, times = path.read_text(), path.stat()
    if text.count(mutant.old) != 1:
        sys.exit(f"{mutant.name}: what it changes stands {text.count(mutant.old)} times in {mutant.file}")
    path.write_text(text.replace(mutant.old, mutant.new))
    try:
        return first_failure(tree)
    finally:
        path.write_text(text)
        os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))


def main(names: list[str]) -> int:
    chosen = [mutant for mutant in MUTANTS if not names or mutant.name in names]
    with tempfile.TemporaryDirectory() as place:
        tree = Path(place)
        copy(tree)
        failure, seconds = first_failure(tree)
        print(f"as it is: {failure or 'all tests pass'} ({seconds:.0f} s)", flush=True)
        if failure:
            return 1
        unseen = 0
        for mutant in chosen:
            failure, seconds = try_out(mutant, tree)
            unseen += not failure
            print(f"{mutant.name}: {failure or 'NOT SEEN'} ({seconds:.0f} s)", flush=True)
    print(f"{len(chosen) - unseen} of {len(chosen)} seen")
    return int(unseen > UNSEEN * len(chosen))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

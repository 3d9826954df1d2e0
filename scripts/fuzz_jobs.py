#!/usr/bin/env python3
"""Random jobs of all sections, sound and broken: jobs that `check` accepts must run, others must end with a sentence.

    .venv/bin/python scripts/fuzz_jobs.py [--jobs 2000] [--seed 0] [--only NUMBER] [--stick]

Jobs are drawn by tests/robustness/any_job.py, on grids of a few hundred points. Half of them stay as they are. In a
quarter some values are changed to extreme ones or to values of another kind. In the others characters of the text are
changed, cut, doubled or inserted; or a file of heights, or the job file, is damaged, of another type or length, no
regular file, or a link. Some jobs are cut into bands. All jobs go through the command line, in this process: `check`,
then the run. Small shares of the finished jobs go through `report`, `leak`, `plan`, `study` and `plot` with a pair of
`--over` and `--log`, too, and are saved under odd names. With `--stick` contacts stick in all jobs.

Faults are: a traceback, a warning of NumPy, a run that refuses a job that `check` accepts, a failure without a physical
reason, a result that is not finite or out of its bounds (area, pressure, load, energies), a mistake without its place,
a refusal that takes more than 3 s of CPU time or leaves files, a study that refuses what `check` accepts, a picture
that is no XML, and more than 1 GB of memory. The exit code is 0 without faults.
"""

import argparse
import contextlib
import csv
import io
import math
import os
import re
import resource
import signal
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from random import Random
from typing import Any
from xml.etree import ElementTree

import campaign
import h5py
import numpy as np
import yaml
from runs import ROOT

sys.path.insert(0, str(ROOT / "tests"))

from robustness import any_job

from parcontact import ParcontactWarning, Simulation, __main__, job
from parcontact.bands.choice import cut_bands
from parcontact.effects.adhesion.effect import chosen_range
from parcontact.errors import InputError, RunError
from parcontact.job import limits, yaml_text
from parcontact.march import mesh

CPU_SECONDS = 3.0  # limit on the CPU time to refuse a job
HANG_SECONDS = 120.0  # limit on the CPU time of a job
BYTES = 1e9
POINTS = 2**12  # most points of a job that is run
STEPS = 400  # most steps of a history that is run
LATER = 8.0  # largest residual over the tolerance
SLACK = 1e-6  # relative error of a load, by sums over all points
DONE, FAILED, REFUSED = 0, 1, 2  # exit codes
LATER_SHARES = {"report": 0.05, "leak": 0.5, "plan": 0.08, "study": 0.5, "plot": 0.15}  # shares of the finished jobs
SAVED = 0.15  # share of the finished histories that are saved under an odd name
IN_BANDS = 0.04  # share of jobs in bands
OVERS = ("", "time", "distance", "velocity", "load", "approach")
LOGS = ("", "x", "y", "x,y", "none")
ODD_NAMES = (
    *("", ".", "directory", "directory/x.h5", "missing/x.h5", "unwritable/x.h5", "mine.txt", "mine.txt/x.h5", "pipe"),
    *("a\nb.h5", "a\0b.h5", "\ud800.h5", "\udcff.h5", " ", "n" * 300, "dangling", "~nosuchuser/x.h5"),
)  # to which a state is saved
PLACE = re.compile(r"^(.+:\d+:\d+|--set .+|parcontact|.+job\.yaml: cannot be read): \S|^\.\.\. and \d+ more")
PHYSICS = ("double precision reaches only", "the flash temperature", "an error with numerics.strict")  # of failures
NOT_FINITE = re.compile(r"(?<![\w.-])-?(nan|inf)(?![\w])(?<!points must be nan)", re.IGNORECASE)
EXTREME = (
    *(0, -0.0, 1, -1, 0.5, 5e-324, 1e-300, 1e-150, 1e-30, 1e30, 1e150, 1e300, 1.7e308, -1e300, 1e18, 2**31,
    2**63, 2**64), *(2**128, 10**40, -(10**40), math.inf, -math.inf, math.nan, True, False, None, "", "x",
    "~nosuchuser/x", "a\0b"), *("1e-3:1:1000000000", "1:2:x", "2026-01-01", "010", "\u202e\x1b[31m", "n" * 5000,
    [], {}, [[]], [None], {"a": 1}), *([1] * 1000, [1e-3, 2e-3], {"from": 1, "to": 2},
    "\ud800", {"first": 1e-300, "growth": 1.0}, {"first": 1e-9, "growth": 1e300}),
)  # fmt: skip
SPLICES = (
    *("\t", "\n", "\0", "\x1b", "\ufeff", "\ud800", "é", "[", "]", "{", "}", ":", ": ", "- ", "#", "&a ", "*a",
    "<<: *a", "!!int "), *("!!float ''", "!!python/object:os.system {}", "|\n", ">-\n", "'", '"', "---\n",
    "...\n", "?", "9" * 5000, "[" * 3000, "%YAML 9\n"), *("a: &a [*a]\n", "'\\ud800'", '"\\ud800"',
    "1" + "0" * 400, "0x1F", "1_000", "12:30", ".inf", ".nan", "~", "null", "yes"),
)  # fmt: skip
BOMB = "\n".join(["b0: &b0 [x]", *(f"b{i}: &b{i} [{', '.join([f'*b{i - 1}'] * 9)}]" for i in range(1, 12))])


Draw = Callable[[Random, Path], dict[str, Any]]


class HangError(BaseException):
    """A job takes more than HANG_SECONDS of CPU time; no code of the program catches this exception."""


# -- running a job -----------------------------------------------------------------------------------------------------


def command(*words: str | Path) -> tuple[int, str]:
    """Return the exit code and the messages of a command line: mistakes and warnings of `check`, all output of a quiet
    run."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said if "--quiet" in words else io.StringIO()), contextlib.redirect_stderr(said):
        try:
            code = __main__.main([str(word) for word in words])
        except SystemExit as error:
            code = int(error.code or 0)
    return code, said.getvalue()


def drive(path: Path, here: Path) -> Iterator[str]:
    """Check a job, and run it if `check` accepts it; yield how it ended, then its faults."""
    before, began = set(here.rglob("*")), time.process_time()
    code, said = command("check", path)
    spent = time.process_time() - began
    if code == REFUSED:
        yield "refused"
        yield from refusal_faults(said)
        if spent > CPU_SECONDS:
            yield f"{spent:.1f} s to refuse it"
        if wrote := set(here.rglob("*")) - before:
            yield f"wrote {wrote}"
        return
    if code != DONE:
        yield "ended in check"
        yield f"check ends with {code}: {said[-400:]}"
        return
    cases = mesh.load_cases(path)
    if any(is_large(case.job) for case in cases):
        yield "large"
        return
    code, said = command(path, "--out", here / "results", "--quiet")
    yield {DONE: "ran", FAILED: "failed to run", REFUSED: "refused by the run"}.get(code, f"ended with {code}")
    yield from run_faults(code, said)
    if code == DONE:
        yield from later_faults(path, here, cases[0].job)
    for case in cases:
        directory = here / "results" / (f"cases/{case.number:03d}" if case.settings else "")
        if (directory / "measures.csv").exists():
            yield from history_faults(directory, case.job)
        if (directory / "steady.csv").exists():
            for row in rows_of(directory / "steady.csv"):
                yield from row_faults(f"{row['velocity']:g} m/s", row, math.inf)


def later_faults(path: Path, here: Path, job: job.Job) -> Iterator[str]:
    """Yield faults of further verbs on a finished job, each with the probability in LATER_SHARES, drawn from its
    text."""
    out, dice = here / "results", Random(path.read_bytes())
    directory = out if (out / "measures.csv").exists() else out / "cases" / "000"
    words = {
        "report": ("report", out),
        "leak": ("leak", directory) if "gap" in job.output.fields and job.history else (),
        "plan": ("plan", path, "--seconds", "0.01", "--ranks", "1,3"),
        "study": _study_words(path, here) if job.study is not None else (),
        "plot": ("plot", out, "--out", here / "picture.svg", *_axes(dice)),
    }
    for verb, line in words.items():
        if line and dice.random() < LATER_SHARES[verb]:
            code, said = command(*line)
            if verb == "study":
                yield from (f"study: {fault}" for fault in run_faults(code, said))
            elif code not in (DONE, REFUSED) or "Traceback" in said or NOT_FINITE.search(said):
                yield f"{' '.join(map(str, line))} ends with {code}: {said[-400:]}"
            if verb == "plot" and code == DONE:
                ElementTree.parse(here / "picture.svg")
    if job.history and dice.random() < SAVED:
        yield from save_faults(path, here, dice.choice(ODD_NAMES))


def _study_words(path: Path, here: Path) -> Sequence[str | Path]:
    case = ("--case", "0") if len(mesh.load_cases(path)) > 1 else ()
    return ("study", path, "--out", here / "study", "--quiet", *case)


def _axes(dice: Random) -> Iterator[str]:
    """Yield one of all pairs of `--over` and `--log`."""
    for option, words in (("--over", OVERS), ("--log", LOGS)):
        if word := dice.choice(words):
            yield from (option, word)


def save_faults(path: Path, here: Path, name: str) -> Iterator[str]:
    """Yield faults of `Simulation.save` to an odd name in an otherwise empty directory."""
    place = here / "saved"
    for directory in ("directory", "unwritable"):
        (place / directory).mkdir(parents=True)
    (place / "unwritable").chmod(0o500)
    (place / "mine.txt").write_text("mine")
    (place / "dangling").symlink_to("nothing")
    os.mkfifo(place / "pipe")
    with contextlib.chdir(place), contextlib.redirect_stderr(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore", ParcontactWarning)
        try:
            Simulation(path, {"sweep": None}).save(name)
        except (InputError, RunError):
            pass
        except Exception as error:
            yield f"save to {name!a}: {type(error).__name__}: {error}"
    kept = [one for one in place.glob("mine.txt*") if one.read_bytes() == b"mine"]
    if not (kept and (place / "pipe").is_fifo() and (place / "directory").is_dir()) or [*place.rglob("*.part")]:
        yield f"save to {name!a} leaves {sorted(one.name for one in place.rglob('*'))}"


def is_large(job: job.Job) -> bool:
    """Return True if a job is too large for a campaign of thousands."""
    if job.bands is not None:
        cut = cut_bands(job)
        return cut.points[0] * cut.points[1] > POINTS or cut.count > 2 or cut.samples == 0 or cut.samples > 2
    steps = limits.count_steps(job.grid, job.history)
    points = len(job.steady.velocities) * len(job.steady.pressures or (1,)) if job.steady else 0
    return job.grid.nx * job.grid.ny > POINTS or steps > STEPS or points > STEPS


def refusal_faults(said: str) -> Iterator[str]:
    """Yield faults of the messages about mistakes."""
    if not 0 < len(said.strip()) <= 50_000:
        yield f"a message of {len(said)} characters"
    if "Traceback" in said:
        yield f"a traceback: {said[-300:]}"
    for line in said.strip().splitlines():
        if not PLACE.match(line):
            yield f"a mistake without its place: {line[:200]}"


def run_faults(code: int, said: str) -> Iterator[str]:
    """Yield faults of the end of a run. A load that the surfaces cannot carry is a physical reason, a solve that does
    not converge is not."""
    if "Traceback" in said:
        yield f"a traceback: {said[-400:]}"
    elif code == REFUSED:
        yield f"check accepts what the run refuses: {said[-400:]}"
    elif code not in (DONE, FAILED):
        yield f"ended with {code}: {said[-400:]}"
    elif code == FAILED and not any(reason in said for reason in PHYSICS):
        yield f"no physical reason: {said[-500:]}"
    if NOT_FINITE.search(said):
        yield f"prints nan or inf: {said[-400:]}"


# -- results -----------------------------------------------------------------------------------------------------------


def rows_of(table: Path) -> Iterator[dict[str, float]]:
    """Return the rows of a table of numbers, without empty cells."""
    with table.open() as lines:
        for row in csv.DictReader(lines):
            yield {name: float(text) for name, text in row.items() if text not in ("", None)}


def history_faults(directory: Path, job: job.Job) -> Iterator[str]:
    """Yield faults of a table of measures and of maps of pressure."""
    stick, hardness = job.section("adhesion"), job.material.hardness
    most = math.inf if hardness is None else hardness * (1.0 + SLACK)
    strength = 0.0
    if stick:
        strength = stick.work / float((chosen_range(job) or math.nan) if stick.range == "auto" else stick.range)
    law, lost = job.section("interface"), 0.0
    for row in rows_of(directory / "measures.csv"):
        yield from row_faults(f"step {row['step']:g}", row, most)
        if not stick:
            yield from load_faults(row, job)
        if law and law.stick:
            yield from traction_faults(row, job, lost)
            lost = row.get("slip_loss", 0.0)
    fields = directory / "fields.h5"
    if fields.exists():
        with h5py.File(fields) as file:
            for pressure in file.get("pressure", ()):
                error = LATER * job.numerics.tolerance * np.max(np.abs(pressure))  # by the error of the gap
                least = -(strength + error) if stick else 0.0
                if not (np.all(pressure >= least) and np.all(pressure <= most)):
                    yield f"pressures from {np.min(pressure):g} to {np.max(pressure):g} Pa, not {least:g} to {most:g}"


def load_faults(row: dict[str, float], job: job.Job) -> Iterator[str]:
    """Yield faults of the load of a step. If its time is in several stages, the load may be the load of any of them."""
    if not row["step"]:
        return
    began, box, loads = 0.0, job.grid.lx * job.grid.ly, list[tuple[str, float, float]]()
    for stage in job.history:
        share = (row["time"] - began) / stage.seconds if stage.seconds else float(row["time"] != began)
        began += stage.seconds
        if -SLACK <= share <= 1.0 + SLACK and not (share and not stage.seconds):
            load = stage.load.start + min(max(share, 0.0), 1.0) * (stage.load.end - stage.load.start)
            name = "approach" if stage.control == "approach" else "pressure"
            unit = box if stage.control == "force" else 1.0
            most = max(abs(stage.load.start), abs(stage.load.end)) / unit
            loads.append((name, load / unit, most))
    if not any(abs(row[name] - load) <= SLACK * most for name, load, most in loads):
        yield f"step {row['step']:g} at {row['time']:g} s: {row['pressure']:g} Pa, {row['approach']:g} m, not {loads}"


def row_faults(where: str, row: dict[str, float], most: float) -> Iterator[str]:
    """Yield faults of the numbers of a step, or of a point of a curve."""
    wrong = [name for name, value in row.items() if not math.isfinite(value) and name != "seconds"]
    if wrong:
        yield f"{where}: not finite: {', '.join(wrong)}"
    area, corrected = row["contact_area"], row.get("contact_area_corrected", 0.0)
    if not 0.0 <= corrected <= area * (1.0 + SLACK) <= 1.0 + 2.0 * SLACK:
        yield f"{where}: contact area {area:g}, corrected {corrected:g}"
    if not 0.0 <= row["max_pressure"] <= most:
        yield f"{where}: max_pressure {row['max_pressure']:g} Pa, at most {most:g}"
    if row["pressure"] > row["max_pressure"] * (1.0 + SLACK):
        yield f"{where}: mean pressure {row['pressure']:g} above the highest, {row['max_pressure']:g}"
    if row["friction"] < 0.0:
        yield f"{where}: friction {row['friction']:g}"


def traction_faults(row: dict[str, float], job: job.Job, lost: float) -> Iterator[str]:
    """Yield faults of the tractions of a step, before which slip had `lost` an energy [J]. Energies of backward Euler
    balance for short steps only, and those of contacts that are not solved need not."""
    where, coefficient = f"step {row['step']:g}", job.section("interface").coefficient or math.inf
    if row["friction_interface"] > coefficient * (1.0 + SLACK):
        yield f"{where}: friction of the interface {row['friction_interface']:g}, at most {coefficient:g}"
    if not 0.0 <= row["stick_area"] <= row["contact_area"] * (1.0 + SLACK):
        yield f"{where}: {row['stick_area']:g} sticks of {row['contact_area']:g}"
    if "slip_loss" in row:
        parts = [row[name] for name in ("work", "stored", "dissipated", "slip_loss")]
        exact = job.numerics.integrator != "backward-euler" and not job.numerics.accept_unconverged
        if exact and abs(parts[0] - sum(parts[1:])) > SLACK * max(map(abs, parts)):
            yield f"{where}: work {parts[0]:g} J, not {sum(parts[1:]):g} J"
        if row["slip_loss"] < lost:
            yield f"{where}: slip_loss falls from {lost:g} to {row['slip_loss']:g} J"


@contextlib.contextmanager
def bounded() -> Iterator[None]:
    """Raise HangError after too much CPU time."""

    def stop(*_: Any) -> None:
        raise HangError(f"more than {HANG_SECONDS:g} s of CPU time")

    signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, HANG_SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def trial(asked: argparse.Namespace, counts: Counter[str], number: int) -> Iterator[str]:
    """Yield the faults of one job."""
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name), warnings.catch_warnings():
        warnings.simplefilter("error")
        dice, here = Random(f"{asked.seed} {number}"), Path(name)
        made = dice.choices([as_drawn, changed_values, changed_text, changed_file], [4, 2, 1, 1])[0]
        path = made(partial(_draw, stick=asked.stick), dice, here)
        try:
            with bounded():
                ended, *faults = drive(path, here)
        except HangError as error:
            ended, faults = "hung", [str(error)]
        counts[f"{made.__name__.replace('_', ' ')}: {ended}"] += 1
        yield from faults


def _draw(dice: Random, directory: Path, stick: bool) -> dict[str, Any]:
    """Return a job with a grid, or one in bands."""
    job = any_job.draw(dice, directory, stick)
    bands = Random(repr(job))
    return any_job.draw_in_bands(bands) if bands.random() < IN_BANDS and not stick else job


# -- making them -------------------------------------------------------------------------------------------------------


def _write(directory: Path, text: str) -> Path:
    path = directory / "job.yaml"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    return path


def as_drawn(draw: Draw, dice: Random, directory: Path) -> Path:
    return _write(directory, yaml_text.dump(draw(dice, directory)))


def changed_text(draw: Draw, dice: Random, directory: Path) -> Path:
    text = yaml_text.dump(draw(dice, directory))
    for _ in range(dice.choice([1, 1, 2, 4])):
        place, size = dice.randrange(len(text) + 1), dice.randint(0, 20)
        character = chr(dice.choice([dice.randrange(32, 127), dice.randrange(0xD7FF)]))
        changes = {
            "cut": text[:place] + text[place + size :],
            "put": text[:place] + dice.choice(SPLICES) + text[place:],
            "double": text[: place + size] + text[place:],
            "swap": text[:place] + character + text[place + 1 :],
            "bomb": text.rstrip("\n") + "\n" + BOMB + "\n",
        }
        text = dice.choices(list(changes.values()), [10, 10, 10, 10, 1])[0]
    return _write(directory, text)


def leaves(data: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the paths to all values in a job."""
    if path:
        yield path
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield from leaves(value, (*path, key))


def changed_values(draw: Draw, dice: Random, directory: Path) -> Path:
    data = draw(dice, directory)
    for _ in range(dice.choice([1, 1, 1, 1, 2])):
        *way, last = dice.choice(list(leaves(data)))
        node: Any = data
        for key in way:
            node = node[key]
        old = node[last]
        if isinstance(old, float | int) and not isinstance(old, bool) and dice.random() < 0.7:
            decades = dice.choice([0.3, 1, 2, 5, 30, 300])
            node[last] = old * 10.0 ** dice.uniform(-decades, decades) if dice.random() < 0.8 else -old
        elif dice.random() < 0.1:
            del node[last]
        elif dice.random() < 0.1 and isinstance(node, dict):
            node[str(last) + dice.choice(["x", "\ud800"])] = node.pop(last)
        else:
            node[last] = dice.choice(EXTREME)
    return _write(directory, dice.choice([yaml_text.dump, yaml.safe_dump])(data))


def changed_file(draw: Draw, dice: Random, directory: Path) -> Path:
    """Make a file of heights that is damaged, of another type or length, or no file; sometimes the job itself."""
    if dice.random() < 0.1:
        return odd_file(dice, directory / "job.yaml")
    path = directory / f"damaged.{dice.choice(['npy', 'txt', 'xyz'])}"
    part = {"shape": "topography", "unit": "m", "size": [1e-3, 1e-3]} if path.suffix == ".xyz" else {"shape": "file"}
    grid, surface = {"points": 16, "size": 1e-3}, {**part, "path": path.name}
    job = _write(directory, yaml_text.dump({**draw(dice, directory), "grid": grid, "surface": surface}))
    heights = 1e-6 * np.random.default_rng(dice.getrandbits(32)).standard_normal((16, 16))
    odd = (heights * 1e300, heights * 1e-310, heights[:12], heights[0], heights.astype("S8"), heights * 1j)
    heights = dice.choice([*6 * [heights], *odd])
    if dice.random() < 0.1:
        odd_file(dice, path)
    elif path.suffix == ".npy":
        np.save(path, heights)
    else:
        np.savetxt(path, np.atleast_1d(heights), fmt="%s")
    if dice.random() < 0.5 and path.is_file() and path.stat().st_size < POINTS:
        content = bytearray(path.read_bytes())
        for _ in range(dice.choice([1, 5, 50]) if content else 0):
            content[dice.randrange(len(content))] = dice.randrange(256)
        path.write_bytes(content[: dice.randrange(len(content) + 1)] if dice.random() < 0.3 else content)
    return job


def odd_file(dice: Random, path: Path) -> Path:
    """Put a pipe, a device, a directory or another unreadable file at a path, or nothing."""
    kind = dice.choice(["pipe", "device", "directory", "sparse", "missing", "loop", "unreadable"])
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to(dice.choice(["/dev/zero", "/dev/random", "/dev/full"]))
    elif kind == "directory":
        path.mkdir()
    elif kind == "loop":
        path.symlink_to(path.name)
    elif kind == "sparse":
        path.touch()
        os.truncate(path, 10_000_000_000)
    elif kind == "unreadable":
        path.touch(0)
    return path


def main() -> int:
    options = campaign.parser(__doc__, 2000, "jobs", stick=(False, "let contacts stick in all jobs"))
    asked, counts = options.parse_args(), Counter[str]()
    faulty = campaign.go(asked, partial(trial, asked, counts), counts)
    peak = 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(f"at most {peak / 1e6:.0f} MB")
    return 1 if faulty or peak > BYTES else 0


if __name__ == "__main__":
    sys.exit(main())

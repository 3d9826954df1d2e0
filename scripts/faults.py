#!/usr/bin/env python3
"""Kills runs, fills disks and damages checkpoints; then the same command must finish with the undisturbed result.

    .venv/bin/python scripts/faults.py [--trials 320] [--seed 0] [--kinds kill,fill] [--only NUMBER]

Each trial is of one kind, by its number. `kill` is SIGKILL of one rank, of all ranks, or of mpirun too, at a random
instant, every other time inside the writing of a checkpoint; the others are described below. `fill` needs root (it
mounts a small tmpfs). Exit codes but those of the manual, and tracebacks, are faults too. Ends with 0 if nothing was
lost, hung or changed.
"""

import contextlib
import csv
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from random import Random
from shutil import copytree, rmtree
from typing import Any

import campaign
import h5py
import runs

from parcontact.errors import InputError
from parcontact.parallel.slab import Slab
from parcontact.storage import checkpoint

BIN = Path(sys.executable).parent
PATIENCE = 60.0  # seconds after which a run that was hit hangs
DISTANCE = 3.5e-4  # m
JOB = """
grid: {points: [96, 90], size: [1.0e-3, 0.9375e-3]}
surface: {shape: rough, hurst: 0.9, long_wavelength: 4.0e-4, short_wavelength: 8.0e-5, rms_slope: 0.02, seed: 1}
material: {model: zener, modulus_inf: 1.0e6, branches: [{modulus: 2.0e6, relaxation_time: 1.0e-4},
  {modulus: 1.5e6, relaxation_time: 1.0e-3}, {modulus: 1.0e6, relaxation_time: 1.0e-2}]}
history:
  - {name: press, pressure: 1.0e5, duration: 1.0e-3, time_step: {first: 1.0e-5, growth: 1.5}}
  - {name: slide, pressure: 1.0e5, velocity: 0.3, distance: DISTANCE, cells_per_step: 0.25}
output: {fields: [pressure, gap], every: 10, energy: true}
checkpoint: {every: 4, keep: 2}
numerics: {tolerance: 1.0e-3}
"""
KINDS = ("kill", "damage", "fall_back", "fill", "vanish", "narrow")
VANISHING = ("fields.xdmf", "run.log", "job.yaml", "job.resolved.yaml", ".lock", ".parcontact")
LIMITS = {"f": (1, 6000), "n": (8, 60), "v": (200_000, 1_500_000)}  # of ulimit: kB of a file, open files, kB of memory
Faults = Iterator[str]


class Disturbances:
    """One directory for all trials, and the undisturbed run that they are compared with."""

    def __init__(self, where: Path, asked: Any, counts: Counter[str]) -> None:
        self.where, self.counts, self.seed, self.flips = where, counts, asked.seed, asked.flips
        self.kinds = asked.kinds.split(",")
        if os.geteuid() != 0:
            self.kinds = [kind for kind in self.kinds if kind != "fill"]
        self.job = where / "job.yaml"
        self.job.write_text(JOB.replace("DISTANCE", repr(DISTANCE / asked.shorter)))
        self.whole, self.output, began = where / "whole", where / "output.txt", time.monotonic()
        self.log = self.output.open("w")
        if self.start(self.whole).wait(600) != 0:
            raise SystemExit("the undisturbed run fails")
        self.seconds = time.monotonic() - began
        self.expected = results(self.whole)

    def trial(self, number: int) -> Faults:
        """One kind after the other; in the end the same command finishes with the undisturbed result."""
        kind, self.dice = self.kinds[number % len(self.kinds)], Random(f"{self.seed} {number}")
        out, traces = self.where / f"{kind}{number}", self.output.read_text().count("Traceback")
        self.counts[kind] += 1
        yield from getattr(self, kind)(out)
        if self.output.read_text().count("Traceback") > traces:
            yield f"{kind}: a traceback in {self.output}"

    def start(self, out: Path, *within: str) -> subprocess.Popen[str]:
        words = [BIN / "mpirun", "-n", 2, *within, BIN / "parcontact", self.job, "--quiet", "--out", out]
        start = partial(subprocess.Popen, env=runs.environment(), stdout=self.log, stderr=self.log)
        return start(list(map(str, words)), start_new_session=True)

    def ended(self, process: subprocess.Popen[str], what: str, codes: tuple[int, ...] = (0, 1, 2, 3)) -> Faults:
        """Wait for a run, which must end in time with one of the codes."""
        try:
            code = process.wait(PATIENCE + 10 * self.seconds)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            yield f"{what}: hangs"
            process.wait()
            return
        self.counts[f"{what}, exit {code}"] += 1
        if code not in codes:
            yield f"{what}: ended with {code}"

    def judged(self, out: Path) -> Faults:
        """The same command finishes with the undisturbed result."""
        yield from self.ended(self.start(out), "the next run", (0,))
        found = results(out)
        if different := [key for key, value in self.expected.items() if found.get(key) != value]:
            yield f"{out.name}: differs in {different}"
        else:
            rmtree(out)

    def under_way(self, out: Path) -> subprocess.Popen[str]:
        """A run that has written a checkpoint, a little later."""
        process = self.start(out)
        while process.poll() is None and not any(out.glob("checkpoint/step-*.h5")):
            time.sleep(1e-3)
        time.sleep(self.dice.uniform(0.0, 0.3))
        return process

    def stopped(self, out: Path) -> None:
        """Make a part of a run."""
        process = self.under_way(out)
        (out / "stop").touch()
        process.wait(600)
        (out / "stop").unlink(missing_ok=True)

    # -- kinds --------------------------------------------------------------------------------------------------------

    def kill(self, out: Path) -> Faults:
        victims, process = self.dice.choice(("one rank", "all ranks", "mpirun and all")), self.start(out)
        seen, checkpoints = set[str](), self.dice.randint(1, 18)
        if self.dice.random() < 0.5:
            time.sleep(self.dice.uniform(0.3, 1.0) * self.seconds)
        else:
            while process.poll() is None and len(seen) < checkpoints:
                seen |= {part.name for part in out.glob("checkpoint/*.part")}
        ranks = runs.ranks_of(process.pid) if process.poll() is None else []
        chosen = ranks if victims != "one rank" else [self.dice.choice(ranks)] if ranks else []
        for pid in ([process.pid] if victims == "mpirun and all" and ranks else []) + chosen:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        yield from self.ended(process, f"SIGKILL of {victims}", (0, 1, -9, 128 + 9, 255))
        self.counts["inside a checkpoint"] += any(out.glob("checkpoint/*.part"))
        yield from self.judged(out)

    def fill(self, out: Path) -> Faults:
        """A disk that is too small."""
        mount = self.where / "small"
        mount.mkdir(exist_ok=True)
        size = sum(path.stat().st_blocks * 512 for path in self.whole.rglob("*") if path.is_file()) // 1024
        kilobytes = int(size * self.dice.uniform(0.05, 1.1))
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", mount], check=True)
        try:
            yield from self.ended(self.start(mount / "out"), "full disk", (0, 1, 2))
            subprocess.run(["mount", "-o", f"remount,size={10 * size}k", mount], check=True)
            yield from self.judged(mount / "out")
        finally:
            subprocess.run(["umount", mount], check=True)

    def vanish(self, out: Path) -> Faults:
        """A file is removed, or replaced, while a run writes it; or all of the directory is removed."""
        process, name = self.under_way(out), self.dice.choice((*VANISHING, "all"))
        if name == "all":
            rmtree(out.rename(f"{out}-gone"), ignore_errors=True)  # at once: else the run may put a file back meanwhile
        else:
            (out / name).unlink(missing_ok=True)
            if self.dice.random() < 0.5 and not name.startswith("."):
                (out / name).write_text("mine")
        yield from self.ended(process, f"{name} removed")
        yield from self.judged(out)

    def narrow(self, out: Path) -> Faults:
        """The ranks may write no long files, open few, or use little memory."""
        kind = self.dice.choice(list(LIMITS))
        if self.dice.random() < 0.5:
            self.stopped(out)
        limited = f'ulimit -{kind} {self.dice.randint(*LIMITS[kind])}; exec "$@"'
        yield from self.ended(
            self.start(out, "sh", "-c", limited, "sh"), f"ulimit -{kind}", (0, 1, 2, 3, 134, 137, 139)
        )
        yield from self.judged(out)

    def fall_back(self, out: Path) -> Faults:
        """The newest checkpoint is damaged in one place: the run goes on from the one before."""
        copytree(self.whole, out)
        path = newest(out)
        data, (_, start, stop) = bytearray(path.read_bytes()), self.dice.choice(list(regions(path)))
        data[self.dice.randrange(start, stop)] ^= 1 << self.dice.randrange(8)
        path.write_bytes(data)
        yield from self.judged(out)

    def damage(self, out: Path) -> Faults:
        """Flip bits in and around each dataset of a checkpoint, or cut it short: refused, or it says what was saved."""
        path, whole = out.with_suffix(".h5"), newest(self.whole)
        data, true, places = whole.read_bytes(), contents(whole), list(regions(whole))
        for index in range(self.flips):
            name, start, stop = places[index % len(places)]
            at, changed = self.dice.randrange(start, stop), bytearray(data)
            changed[at] ^= 1 << self.dice.randrange(8)
            path.write_bytes(changed if index % 20 else data[:at])
            try:
                verdict = "harmless" if contents(path) == true else "accepted"
            except InputError:
                verdict = "refused"
            self.counts[f"damaged checkpoints {verdict}"] += 1
            if verdict == "accepted":
                yield f"damage at byte {at} in {name}: accepted"


def newest(out: Path) -> Path:
    return max(out.glob("checkpoint/step-*.h5"), key=lambda path: int(path.stem[5:]))


def results(out: Path) -> dict[str, Any]:
    """Everything a run leaves that must not depend on its interruptions."""
    with (out / "measures.csv").open(newline="") as file:
        rows = [{key: text for key, text in row.items() if key != "seconds"} for row in csv.DictReader(file)]
    found: dict[str, Any] = {"measures.csv": rows, "newest": newest(out).name}
    for path in (out / "fields.h5", newest(out)):
        with h5py.File(path) as file:
            data = {item.name: item[()].tobytes() for item in datasets(file) if item.name != "/plans/all"}
        found |= {f"{path.name}{name}": value for name, value in data.items()}
    return found


def datasets(file: h5py.File) -> list[h5py.Dataset]:
    names: list[str] = []
    file.visit(names.append)
    return [file[name] for name in names if isinstance(file[name], h5py.Dataset)]


def contents(path: Path) -> Any:
    """All that a checkpoint says; raises InputError for one that is not sound."""
    found = checkpoint.inspect(path)
    if problem := checkpoint.verify(found, Slab.alone(*found.shape[::-1])):
        raise InputError(problem)
    with h5py.File(path) as file:
        maps = {name: file[name][...].tobytes() for name in found.maps}
    numbers = {name: value.tobytes() for name, value in found.numbers.items()}
    return found.step, found.time, found.job, found.chain, found.units, numbers, maps


def regions(path: Path) -> Iterator[tuple[str, int, int]]:
    """Each dataset of a file, the seal, and all of the file, which is mostly what is around them."""
    with h5py.File(path) as file:
        for item in datasets(file):
            if item.id.get_offset() is not None:
                yield item.name, item.id.get_offset(), item.id.get_offset() + item.nbytes
    yield "the file", 0, path.stat().st_size


def main() -> int:
    options = campaign.parser(
        __doc__,
        trials=320,
        flips=(100, "damaged checkpoints in a trial of that kind"),
        shorter=(1, "times as short a slide"),
        kinds=(",".join(KINDS), "what is done"),
    )
    asked, counts = options.parse_args(), Counter[str]()
    with tempfile.TemporaryDirectory(prefix="faults-") as directory:
        faulty = campaign.go(asked, Disturbances(Path(directory), asked, counts).trial, counts)
    return 1 if faulty else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Kills runs, fills disks and damages checkpoints; then the same command must finish with the undisturbed result.

    .venv/bin/python scripts/faults.py [--trials 200] [--around 100] [--flips 2000] [--fills 10] [--ranks 2] [--seed 0]

Kills are SIGKILL of one rank, of all ranks, or of mpirun too, at random instants, every other time inside the writing
of a checkpoint. Around them (disturbances.py): races, planted links, files that vanish, locks, narrow limits. Filling a
disk needs root (it mounts a small tmpfs). Ends with 0 if nothing was lost, hung or changed.
"""

import argparse
import csv
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from shutil import copytree, rmtree
from typing import Any

import disturbances
import h5py
import outside
from mpi4py import MPI

from parcontact.errors import InputError
from parcontact.parallel.slab import Slab
from parcontact.storage import checkpoint

BIN = Path(sys.executable).parent
PATIENCE = 60.0  # seconds after which a run that was hit hangs
DISTANCE = 3.5e-4  # m
JOB = """
title: a run that is killed
grid: {points: [96, 90], size: [1.0e-3, 0.9375e-3]}
surface:
  - {shape: rough, hurst: 0.9, long_wavelength: 4.0e-4, short_wavelength: 8.0e-5, rms_slope: 0.02, seed: 1}
material:
  model: zener
  modulus_inf: 1.0e6
  branches:
    - {modulus: 2.0e6, relaxation_time: 1.0e-4}
    - {modulus: 1.5e6, relaxation_time: 1.0e-3}
    - {modulus: 1.0e6, relaxation_time: 1.0e-2}
history:
  - {name: press, pressure: 1.0e5, duration: 1.0e-3, time_step: {first: 1.0e-5, growth: 1.5}}
  - {name: slide, pressure: 1.0e5, velocity: 0.3, distance: DISTANCE, cells_per_step: 0.25}
output: {fields: [pressure, gap], every: 10, energy: true}
checkpoint: {every: 4, keep: 2}
numerics: {tolerance: 1.0e-3}
"""


class Campaign:
    """One directory for all trials, and what came of them."""

    seconds = PATIENCE  # of an undisturbed run

    def __init__(self, where: Path, ranks: int, seed: int, shorter: int) -> None:
        self.where, self.ranks = where, ranks
        self.random = random.Random(seed)
        self.count: Counter[str] = Counter()
        self.bad: list[str] = []
        self.job = where / "job.yaml"
        self.job.write_text(JOB.replace("DISTANCE", repr(DISTANCE / shorter)))
        self.whole = where / "whole"
        self.log = (where / "output.txt").open("w")
        began = time.monotonic()
        if self.run(self.whole) != 0:
            raise SystemExit("the undisturbed run fails")
        self.seconds = time.monotonic() - began
        self.expected = results(self.whole)

    def start(self, out: Path, within: Sequence[str] = ()) -> subprocess.Popen[str]:
        ranks = [*within, BIN / "parcontact", self.job, "--quiet", "--out", out]
        words, env = list(map(str, [BIN / "mpirun", "-n", self.ranks, *ranks])), outside.environment()
        return subprocess.Popen(words, env=env, stdout=self.log, stderr=self.log, text=True, start_new_session=True)

    def run(self, out: Path) -> int:
        process = self.start(out)
        try:
            return process.wait(PATIENCE + 10 * self.seconds)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            return -1

    def judge(self, what: str, out: Path) -> None:
        """The same command finishes with the undisturbed result."""
        code = self.run(out)
        if code != 0:
            self.bad.append(f"{what}: the next run ended with {code}")
        elif (found := results(out)) != self.expected:
            different = [key for key, value in self.expected.items() if found.get(key) != value]
            self.bad.append(f"{what}: differs in {different}")
        else:
            self.count["recovered"] += 1
            rmtree(out)

    # -- kills --------------------------------------------------------------------------------------------------------

    def kill(self, trial: int) -> None:
        out = self.where / f"kill{trial}"
        victims = self.random.choice(("one rank", "all ranks", "mpirun and all"))
        inside = trial % 2 == 1
        process = self.start(out)
        self._wait(process, out, inside)
        self._strike(process, victims)
        began = time.monotonic()
        try:
            code = process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.bad.append(f"kill {trial}: hangs after SIGKILL of {victims}")
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            return
        self.count[f"killed {victims}"] += 1
        self.count["seconds to end, at most"] = max(
            self.count["seconds to end, at most"], round(time.monotonic() - began)
        )
        if code == 0:
            self.count["too late"] += 1
        if any(out.glob("checkpoint/*.part")):
            self.count["inside a checkpoint"] += 1
        if not any(out.glob("checkpoint/step-*.h5")):
            self.count["before the first checkpoint"] += 1
        self.judge(f"kill {trial} ({victims})", out)

    def _wait(self, process: subprocess.Popen[str], out: Path, inside: bool) -> None:
        """Until the instant to strike."""
        if not inside:
            time.sleep(self.random.uniform(0.3, 1.0) * self.seconds)
            return
        seen: set[str] = set()
        for _ in range(self.random.randint(1, 18)):
            while process.poll() is None:
                part = next((out / "checkpoint").glob("*.part"), None) if (out / "checkpoint").exists() else None
                if part and part.name not in seen:
                    seen.add(part.name)
                    break
                time.sleep(1e-4)
        time.sleep(self.random.uniform(0.0, 0.015))

    def _strike(self, process: subprocess.Popen[str], victims: str) -> None:
        ranks = outside.ranks_of(process.pid)
        chosen = ranks if victims != "one rank" else ranks[-1:] if self.random.random() < 0.5 else ranks[:1]
        for pid in ([process.pid] if victims == "mpirun and all" else []) + chosen:
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                continue

    # -- full disks ---------------------------------------------------------------------------------------------------

    def fill(self, trial: int) -> None:
        mount = self.where / "small"
        mount.mkdir(exist_ok=True)
        size = sum(path.stat().st_blocks * 512 for path in self.whole.rglob("*") if path.is_file()) // 1024
        kilobytes = int(size * self.random.uniform(0.05, 1.1))
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", mount], check=True)
        try:
            code = self.run(mount / "out")
            self.count[f"full disk, exit {code}"] += 1
            if code not in (0, 1, 2):
                self.bad.append(f"fill {trial} with {kilobytes} kB: ended with {code}")
            subprocess.run(["mount", "-o", f"remount,size={10 * size}k", mount], check=True)
            self.judge(f"fill {trial} with {kilobytes} kB", mount / "out")
        finally:
            subprocess.run(["umount", mount], check=True)

    # -- damage -------------------------------------------------------------------------------------------------------

    def damage(self, flips: int) -> None:
        """Flip bits in each dataset of a checkpoint and in what is around them, and cut it short."""
        newest = max((self.whole / "checkpoint").glob("step-*.h5"), key=lambda path: int(path.stem[5:]))
        data, true = newest.read_bytes(), contents(newest)
        places = list(regions(newest))
        for index in range(flips):
            name, start, stop = places[index % len(places)]
            at, bit = self.random.randrange(start, stop), self.random.randrange(8)
            changed = bytearray(data)
            changed[at] ^= 1 << bit
            self._look(f"bit {bit} of byte {at} flipped", name, bytes(changed), true)
        for _ in range(max(1, flips // 20)):
            length = self.random.randrange(len(data))
            self._look(f"cut to {length} bytes", "the length", data[:length], true)

    def _look(self, what: str, name: str, data: bytes, true: Any) -> None:
        """A damaged file is refused, or (in bytes that mean nothing) says what was saved."""
        path = self.where / "damaged.h5"
        path.write_bytes(data)
        try:
            verdict = "harmless" if contents(path) == true else "accepted"
        except InputError:
            verdict = "refused"
        self.count[f"damage in {name}: {verdict}"] += 1
        if verdict == "accepted":
            self.bad.append(f"{what} in {name}: accepted")

    def fall_back(self, trial: int) -> None:
        """The newest checkpoint is damaged in one place: the run goes on from the one before."""
        out = self.where / f"back{trial}"
        copytree(self.whole, out)
        newest = max((out / "checkpoint").glob("step-*.h5"), key=lambda path: int(path.stem[5:]))
        name, start, stop = self.random.choice(list(regions(newest)))
        with newest.open("r+b") as file:
            file.seek(self.random.randrange(start, stop))
            byte = file.read(1)
            file.seek(-1, os.SEEK_CUR)
            file.write(bytes([byte[0] ^ 1 << self.random.randrange(8)]))
        self.count["fell back"] += 1
        self.judge(f"damage in {name} of {newest.name}", out)


def results(out: Path) -> dict[str, Any]:
    """Everything a run leaves that must not depend on its interruptions."""
    with (out / "measures.csv").open(newline="") as file:
        rows = [{key: text for key, text in row.items() if key != "seconds"} for row in csv.DictReader(file)]
    newest = max((out / "checkpoint").glob("step-*.h5"), key=lambda path: int(path.stem[5:]))
    found: dict[str, Any] = {"measures.csv": rows, "newest": newest.name}
    for path in (out / "fields.h5", newest):
        with h5py.File(path) as file:
            names: list[str] = []
            file.visit(names.append)
            datasets = [file[name] for name in names if isinstance(file[name], h5py.Dataset)]
            found |= {f"{path.name}{item.name}": item[()].tobytes() for item in datasets if item.name != "/plans/all"}
    return found


def contents(path: Path) -> Any:
    """All that a checkpoint says; raises InputError for one that is not sound."""
    found = checkpoint.inspect(path)
    if problem := checkpoint.verify(found, Slab(MPI.COMM_SELF, *found.shape[::-1])):
        raise InputError(problem)
    with h5py.File(path) as file:
        maps = {name: file[name][...].tobytes() for name in found.maps}
    numbers = {name: value.tobytes() for name, value in found.numbers.items()}
    return found.step, found.time, found.job, found.chain, found.units, numbers, maps


def regions(path: Path) -> Iterator[tuple[str, int, int]]:
    """Each dataset of a file, the seal, and all of the file, which is mostly what is around them."""
    with h5py.File(path) as file:
        names: list[str] = []
        file.visit(names.append)
        for item in (file[name] for name in names):
            if isinstance(item, h5py.Dataset) and item.id.get_offset() is not None:
                yield item.name, item.id.get_offset(), item.id.get_offset() + item.nbytes
    yield "the seal", 0, 200
    yield "the file", 0, path.stat().st_size


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, value, what in (
        ("--trials", 200, "runs that are killed"),
        ("--around", 100, "races, links, vanishing files, locks, wishes to stop, narrow limits"),
        ("--flips", 2000, "damaged checkpoints"),
        ("--backs", 10, "runs that must fall back to an older checkpoint"),
        ("--fills", 10, "runs on a disk that is too small (root only)"),
        ("--ranks", 2, "ranks of each run"),
        ("--shorter", 1, "times as short a slide"),
        ("--seed", 0, "of all that is chosen"),
    ):
        parser.add_argument(name, type=int, default=value, help=what)
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no further trial after so many")
    return parser.parse_args()


def main() -> int:
    chosen = arguments()
    where = Path(tempfile.mkdtemp(prefix="faults-"))
    campaign, began = Campaign(where, chosen.ranks, chosen.seed, chosen.shorter), time.monotonic()
    campaign.damage(chosen.flips)
    trials: list[Callable[[], None]] = [partial(campaign.fall_back, trial) for trial in range(chosen.backs)]
    trials += [partial(campaign.fill, trial) for trial in range(chosen.fills if os.geteuid() == 0 else 0)]
    trials += [partial(disturbances.disturb, campaign, trial) for trial in range(chosen.around)]
    trials += [partial(campaign.kill, trial) for trial in range(chosen.trials)]
    campaign.random.shuffle(trials)
    while trials and time.monotonic() - began < 60.0 * chosen.minutes:
        trials.pop()()
        campaign.count["trials"] += 1
    if found := (where / "output.txt").read_text().count("Traceback"):
        campaign.bad.append(f"{found} tracebacks in {where / 'output.txt'}")
    for what, count in sorted(campaign.count.items()):
        print(f"{count:6d} {what}")
    print("\n".join(campaign.bad) or "nothing lost, nothing hung, no traceback, nothing accepted that was damaged")
    if not campaign.bad:
        rmtree(where)
    return 1 if campaign.bad else 0


if __name__ == "__main__":
    sys.exit(main())

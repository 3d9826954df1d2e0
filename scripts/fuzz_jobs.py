#!/usr/bin/env python3
"""Jobs and files that nobody would write: each must run, or end in a sentence, soon, in little memory, without a trace.

    .venv/bin/python scripts/fuzz_jobs.py [--jobs 2000] [--seed 0] [--only NUMBER]

A third of the jobs are texts with characters changed, cut, doubled or put in; a third sound jobs with some values
changed to extreme ones or to values of another kind; a third sound jobs with a file of heights, or a job file, that is
damaged, of another type or length, no regular file, or leads elsewhere. All are driven in this process: read,
described, built, and marched a few steps. Counted as faults: exceptions other than those that say a sentence, more than
3 s of CPU time to refuse, files left after a refusal, results that are not finite, and more than 1 GB. Ends with 0 if
there are none.
"""

import contextlib
import io
import math
import os
import resource
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

import campaign
import numpy as np
import runs
import yaml

from parcontact import job as jobs
from parcontact.errors import InputError, RunError
from parcontact.history.timeline import Timeline
from parcontact.job.text import yamltext
from parcontact.scene import sanity

CPU_SECONDS = 3.0  # to refuse a job
HANG_SECONDS = 20.0  # of CPU time for all that is done with a job
BYTES = 1e9
POINTS = 2**14  # of a grid that is built here
STEPS = 3  # that are made of a history
ROUGH = {"shape": "rough", "hurst": 0.8, "long_wavelength": 2.5e-4, "short_wavelength": 1.25e-4, "rms_slope": 0.1}
ZENER = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]}
KELVIN = {"model": "zener", "poisson": 0.4, "branches": [{"G0": 2.75e6, "G1": 3e5, "eta1": 3e3}]}
PRESS = {"name": "press", "pressure": 1e4, "duration": 1e-3, "time_step": {"first": 1e-5, "growth": 1.5}}
SLIDE = {"pressure": 1e4, "velocity": [0.1, 0.0], "distance": 1e-4, "cells_per_step": 1}
BASES: tuple[dict[str, Any], ...] = (
    {"grid": {"points": 16, "size": 1e-3}, "surface": ROUGH, "material": ZENER, "history": [PRESS, SLIDE]},
    {
        "title": "a sphere",
        "grid": {"points": [16, 12], "size": [1.5e-3, 1e-3], "boundary": "free"},
        "surface": [{"shape": "sphere", "radius": 1e-2, "center": [7e-4, 5e-4], "profile": "exact"}],
        "material": KELVIN,
        "history": [{"force": 1e-2}, {"approach": {"from": 1e-5, "to": 2e-5}, "duration": 1e-3, "time_step": 2e-4}],
        "numerics": {"tolerance": 1e-3, "integrator": "backward-euler", "kernel": "love"},
    },
    {
        "grid": {"points": 16, "size": 1e-3},
        "surface": [{"shape": "wave", "amplitude": 1e-6, "waves": [1, 2], "phase": 0.5}, {"shape": "flat"}],
        "material": {"model": "elastic", "shear_modulus": 1e6, "poisson": 0.3},
        "history": [{"pressure": 1e4}, {"pressure": {"from": 1e4, "to": 0.0}, "duration": 1.0, "time_step": 0.3}],
        "output": {"fields": ["pressure", "gap"], "every": 2, "energy": True},
        "checkpoint": {"every": 3, "keep": 1},
    },
    {
        "grid": {"points": 16, "size": 1e-3},
        "surface": {"shape": "cylinder", "radius": 1e-2, "axis": "y"},
        "material": {"include": "synthetic_tyre"},
        "initial": {"state": "steady", "velocity": 0.1, "pressure": 1e4},
        "history": [{"pressure": 1e4, "velocity": 0.1, "duration": 1e-3, "time_step": 3e-4}],
        "steady": {"velocities": "1e-3:1:3", "pressures": [1e4]},
    },
)
EXTREME = (
    *(0, -0.0, 1, -1, 0.5, 5e-324, 1e-300, 1e-150, 1e-30, 1e30, 1e150, 1e300, 1.7e308, -1e300, 1e18, 2**31,
    2**63, 2**64), *(2**128, 10**40, -(10**40), math.inf, -math.inf, math.nan, True, False, None, "", "x",
    "~nosuchuser/x", "a\0b"), *("1e-3:1:1000000000", "1:2:x", "2026-01-01", "010", "\u202e\x1b[31m", "n" * 5000,
    [], {}, [[]], [None], {"a": 1}), *([1] * 1000, [1e-3, 2e-3], {"from": 1, "to": 2},
    {"first": 1e-300, "growth": 1.0}, {"first": 1e-9, "growth": 1e300}),
)  # fmt: skip
SPLICES = (
    *("\t", "\n", "\0", "\x1b", "\ufeff", "\ud800", "é", "[", "]", "{", "}", ":", ": ", "- ", "#", "&a ", "*a",
    "<<: *a", "!!int "), *("!!float ''", "!!python/object:os.system {}", "|\n", ">-\n", "'", '"', "---\n",
    "...\n", "?", "9" * 5000, "[" * 3000, "%YAML 9\n"), *("a: &a [*a]\n", "'\\ud800'", '"\\ud800"',
    "1" + "0" * 400, "0x1F", "1_000", "12:30", ".inf", ".nan", "~", "null", "yes"),
)  # fmt: skip
BOMB = "\n".join(["b0: &b0 [x]", *(f"b{i}: &b{i} [{', '.join([f'*b{i - 1}'] * 9)}]" for i in range(1, 12))])


class HangError(Exception):
    """More CPU time than anything here may take."""


def drive(path: Path) -> str:
    """Do with a job in this process what the program would do: how it ended."""
    began = time.process_time()
    try:
        job = jobs.load_cases(path)[0].job
    except InputError as error:
        if not 0 < len(str(error).strip()) <= 50_000:
            raise AssertionError(f"a message of {len(str(error))} characters") from error
        if (spent := time.process_time() - began) > CPU_SECONDS:
            raise HangError(f"{spent:.1f} s to refuse it") from error
        return "refused"
    jobs.describe(job)
    again = jobs.Job.model_validate(yamltext.parse(job.resolved(), "resolved").data, context=None)
    assert again.material == job.material or job.included, "the resolved job is another one"
    assert again.title == job.title, "the resolved job has another title"
    timeline = Timeline.of(job)
    _ = job.warnings, [timeline[n] for n in {1, timeline.count // 2, timeline.count} if 1 <= n <= timeline.count]
    try:
        sanity.refuse_impossible(job, timeline)
        if job.grid.nx * job.grid.ny > POINTS:
            return "large"
        marching = runs.begun(job)
        sanity.check_heights(marching.scene.setup)
        watch = sanity.ContactWatch(job.numerics.strict, timeline)
        for step, _ in zip(timeline, range(STEPS), strict=False):
            m = marching.advance(step).measures
            watch.judge(step.number, m)
            values = (m.pressure, m.force_x, m.friction, m.contact_area, m.approach, m.mean_gap, m.max_pressure)
            assert all(map(math.isfinite, values)), f"not finite: {m}"
    except InputError:
        return "refused"
    except RunError:
        return "failed to run"
    return "ran"


def listing(directory: Path) -> set[str]:
    return {str(path) for path in directory.rglob("*")}


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


def trial(seed: int, counts: Counter[str], number: int) -> Iterator[str]:
    """Faults of one job."""
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        dice, here = Random(f"{seed} {number}"), Path(name)
        path = dice.choice([changed_text, changed_values, changed_file])(dice, here)
        before = listing(here)
        with bounded(), contextlib.redirect_stdout(io.StringIO()), np.errstate(all="ignore"):
            ended = drive(path)
        counts[ended] += 1
        if ended == "refused" and listing(here) != before:
            yield f"wrote {listing(here) - before}"


# -- making them ---


def _base(dice: Random) -> dict[str, Any]:
    return yaml.safe_load(yaml.safe_dump(dice.choice(BASES)))


def _write(directory: Path, text: str) -> Path:
    path = directory / "job.yaml"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    return path


def changed_text(dice: Random, directory: Path) -> Path:
    text = yamltext.dump(_base(dice))
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
    """The ways to everything in a job."""
    if path:
        yield path
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield from leaves(value, (*path, key))


def changed_values(dice: Random, directory: Path) -> Path:
    data = _base(dice)
    for _ in range(dice.choice([1, 1, 1, 2, 3])):
        *way, last = dice.choice(list(leaves(data)))
        node: Any = data
        for key in way:
            node = node[key]
        old = node[last]
        if isinstance(old, float | int) and dice.random() < 0.5:
            decades = dice.choice([2, 5, 30, 300])
            node[last] = old * 10.0 ** dice.uniform(-decades, decades) if dice.random() < 0.8 else -old
        elif dice.random() < 0.1:
            del node[last]
        elif dice.random() < 0.1 and isinstance(node, dict):
            node[str(last) + "x"] = node.pop(last)
        else:
            node[last] = dice.choice(EXTREME)
    return _write(directory, dice.choice([yamltext.dump, yaml.safe_dump])(data))


def changed_file(dice: Random, directory: Path) -> Path:
    """A file of heights that is damaged, of another type or length, or no file; sometimes the job itself."""
    if dice.random() < 0.1:
        return odd_file(dice, directory / "job.yaml")
    path = directory / f"road.{dice.choice(['npy', 'txt', 'xyz'])}"
    part = {"shape": "topography", "unit": "m", "size": [1e-3, 1e-3]} if path.suffix == ".xyz" else {"shape": "file"}
    job = _write(directory, yamltext.dump({**_base(dice), "surface": {**part, "path": path.name}}))
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
    """No regular file that can be read, or nothing at all."""
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
    asked, counts = campaign.parser(__doc__, 2000, "jobs").parse_args(), Counter[str]()
    faulty = campaign.go(asked, partial(trial, asked.seed, counts), counts)
    peak = 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(f"at most {peak / 1e6:.0f} MB")
    return 1 if faulty or peak > BYTES else 0


if __name__ == "__main__":
    sys.exit(main())

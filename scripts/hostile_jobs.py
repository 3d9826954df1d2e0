"""Jobs and files that nobody would write, drawn at random: what fuzz_jobs.py drives."""

import math
import os
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

import h5py
import numpy as np
import yaml
from SurfaceTopography import Topography

from parcontact.job.text import yamltext

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


def write_job(dice: Random, directory: Path) -> Path:
    """A job file somewhere in a directory, and what it needs."""
    make = dice.choice([changed_text, changed_values, changed_file])
    return make(dice, directory)


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
    path = directory / f"road.{dice.choice(['npy', 'txt', 'xyz', 'h5', 'x3p'])}"
    named = {".npy": {"shape": "file"}, ".txt": {"shape": "file"}, ".h5": {"shape": "file", "dataset": "heights"}}
    part = {"path": path.name, **named.get(path.suffix, {"shape": "topography", "unit": "m", "size": [1e-3, 1e-3]})}
    job = _write(directory, yamltext.dump({**_base(dice), "surface": part}))
    heights = 1e-6 * np.random.default_rng(dice.getrandbits(32)).standard_normal((16, 16))
    odd = (heights * 1e300, heights * 1e-310, heights[:12], heights[0], heights.astype("S8"), heights * 1j)
    heights = dice.choice([*6 * [heights], *odd])
    if path.suffix == ".npy":
        np.save(path, heights)
    elif path.suffix == ".h5":
        with h5py.File(path, "w") as file:
            file["heights"] = heights
    elif path.suffix == ".x3p" and heights.dtype == float and heights.ndim == 2:
        Topography(heights, (1e-3, dice.choice([1e-3, 0.0, np.nan, 1e-300])), unit="m").to_x3p(str(path))
    elif dice.random() < 0.8:
        np.savetxt(path, np.atleast_1d(heights), fmt="%s")
    else:
        return odd_file(dice, path) and job
    if dice.random() < 0.5:
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

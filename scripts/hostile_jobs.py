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
    make = dice.choice([changed_text, changed_values, changed_file, changed_map])
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
        kind = dice.choice(
            ["cut", "put", "double", "swap", "bomb"] if dice.random() < 0.1 else ["cut", "put", "double", "swap"]
        )
        if kind == "cut":
            text = text[:place] + text[place + size :]
        elif kind == "put":
            text = text[:place] + dice.choice(SPLICES) + text[place:]
        elif kind == "double":
            text = text[: place + size] + text[place:]
        elif kind == "bomb":
            text = text.rstrip("\n") + "\n" + BOMB + "\n"
        else:
            text = (
                text[:place] + chr(dice.choice([dice.randrange(32, 127), dice.randrange(0xD7FF)])) + text[place + 1 :]
            )
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
        node = data
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
    text = yamltext.dump(data) if dice.random() < 0.8 else yaml.safe_dump(data)
    return _write(directory, text)


def changed_file(dice: Random, directory: Path) -> Path:
    """A surface file, mostly; sometimes the job itself."""
    if dice.random() < 0.1:
        return odd_file(dice, directory, directory / "job.yaml")
    data = _base(dice)
    nx, ny = (
        (data["grid"]["points"], data["grid"]["points"])
        if isinstance(data["grid"]["points"], int)
        else data["grid"]["points"]
    )
    kind = dice.choice(["npy", "h5", "h5", "txt"])
    path = directory / f"road.{kind}"
    data["surface"] = {"shape": "file", "path": path.name, "scale": dice.choice([1.0, 1e-6])}
    if kind == "h5":
        data["surface"]["dataset"] = dice.choice(
            ["heights", "soft", "one", "out", "deep/map", "time", "raw", "", "/", "."]
        )
    job = _write(directory, yamltext.dump(data))
    if dice.random() < 0.1:
        odd_file(dice, directory, path)
        return job
    heights = 1e-6 * np.random.default_rng(dice.getrandbits(32)).standard_normal((ny, nx))
    heights = dice.choice(
        [heights, heights, heights * 1e300, heights * 1e-310, heights.T, heights[0], heights.astype("S8")]
    )
    if dice.random() < 0.1 and heights.dtype == float:
        heights.flat[dice.randrange(heights.size)] = dice.choice([np.nan, np.inf, 1e308])
    write_heights(path, heights)
    if dice.random() < 0.5:
        damage(dice, path)
    return job


def changed_map(dice: Random, directory: Path) -> Path:
    """A measured map that is damaged, of another type, with odd positions or lengths, or much larger than the box."""
    kind = dice.choice(["npy", "xyz", "x3p", "gwy"])
    path, step = directory / f"road.{kind}", 1e-4
    part: dict[str, Any] = {"shape": "topography", "path": path.name}
    heights = 1e-6 * np.random.default_rng(dice.getrandbits(32)).standard_normal((16, 16))
    if kind == "npy":
        part |= {"unit": "m", "size": [16 * step, 16 * step]}
        types = (heights * 1j, heights > 0.0, heights.astype("M8[s]"), heights.view([("z", "f8")]), heights * 1e-302)
        if dice.random() < 0.2:  # more than any memory holds
            with path.open("wb") as file:
                shape = (10 ** dice.choice([6, 9, 18]), 10**6)
                np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": shape})
        else:
            np.save(path, dice.choice([heights, *types]))
    elif kind == "xyz":
        part |= {"unit": "m"}
        y, x = np.indices(heights.shape)
        table = np.stack([x.ravel() * step, y.ravel() * step, heights.ravel()], axis=1)
        table[dice.randrange(len(table)), dice.randrange(3)] = dice.choice([np.inf, np.nan, 10.0, -1e9, 1e300, 1e-300])
        np.savetxt(path, table)
    else:
        size = dice.choice([16 * step, 16 * step, 0.0, np.nan, np.inf, 1e-300])
        made = Topography(heights, (16 * step, size), unit="m")
        (made.to_x3p if kind == "x3p" else made.to_gwy)(str(path))
    if dice.random() < 0.3:
        damage(dice, path)
    size = dice.choice([1e-3, 1e-3, 1e-6, 1e-300, [1e-3, 1e-6]])
    return _write(directory, yamltext.dump({**BASES[0], "surface": part, "grid": {"points": 16, "size": size}}))


def write_heights(path: Path, heights: Any) -> None:
    if path.suffix == ".npy":
        np.save(path, heights)
    elif path.suffix == ".txt":
        np.savetxt(path, np.atleast_1d(heights), fmt="%s")
    else:
        with h5py.File(path, "w") as file:
            file["heights"] = file["deep/map"] = heights
            file["soft"], file["one"] = h5py.SoftLink("/deep/map"), h5py.SoftLink("/one")
            file["out"] = h5py.ExternalLink(str(path.with_name("pipe")), "/heights")
            space = h5py.h5s.create_simple(np.atleast_1d(heights).shape)
            h5py.h5d.create(file.id, b"time", h5py.h5t.UNIX_D32LE, space)
            file.create_dataset("raw", heights.shape, "f8", external=[("raw.bin", 0, h5py.h5f.UNLIMITED)])
        os.mkfifo(path.with_name("pipe"))


def damage(dice: Random, path: Path) -> None:
    content = bytearray(path.read_bytes())
    for _ in range(dice.choice([1, 5, 50])):
        if content:
            content[dice.randrange(len(content))] = dice.randrange(256)
    path.write_bytes(content[: dice.randrange(len(content) + 1)] if dice.random() < 0.3 else content)


def odd_file(dice: Random, directory: Path, path: Path) -> Path:
    kind = dice.choice(["pipe", "device", "directory", "sparse", "missing", "loop", "unreadable"])
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to(dice.choice(["/dev/zero", "/dev/random", "/dev/full"]))
    elif kind == "directory":
        path.mkdir()
    elif kind == "sparse":
        with path.open("wb") as file:
            file.truncate(10_000_000_000)
    elif kind == "loop":
        path.symlink_to(path.name)
    elif kind == "unreadable":
        path.write_text("")
        path.chmod(0)
    return path

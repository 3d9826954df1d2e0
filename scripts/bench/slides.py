"""Parts `slide` and `steady`: sliding step by step and directly.

The slide that is compared with tamaas has eight branches and backward Euler, which tamaas has, too. Relaxation times
are from 1e-4 to 1e3, each modulus is 2, and the long-term modulus is 1, in a box of length 1 at a velocity of 1 with
steps of one cell. Errors of friction and times of a step are taken from the second half of the steps: FIRST steps of
tamaas, LATER steps of this program. Later steps of tamaas take as long as its first ones, because it starts each solve
from zero. This program uses mixed precision. Its times are means, because some of its steps need no iteration and take
half as long as others.
"""

import argparse
import statistics
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from runs import Json, begun, marched

import parcontact as pc
from parcontact.job import load
from parcontact.march import scene
from parcontact.march.steady import SteadySliding
from parcontact.parallel.slab import Slab

from .peers import TAMAAS_SLIDING, Task, compare_peers
from .table import Line, Map, interleave
from .work import pair, sliding_job

DEFAULT, EXACT = 5e-3, 5e-5  # default tolerance of jobs, and tolerance of the reference
LARGER = (0.1, 0.05, 0.02, 0.01)
ERROR = 1e-3  # allowed error of friction
FEWEST = 8  # steps: the first ones differ from the others
FIRST, LATER = 12, 48  # steps compared with other programs
PRESSURE = 0.165  # compared with other programs, for 7 to 9 % of contact
RELAXATION_TIMES = [10.0**k for k in range(-4, 4)]
MODULUS = 2.0
EXACT_FOR_PEERS = 1e-7
TOLERANCES = [1e-2, 5e-3, 2e-3, 1e-3, 5e-4]
PEERS = (Task("tamaas", TAMAAS_SLIDING, -3.0),)


def slide(points: int, rounds: int, asked: argparse.Namespace) -> Iterator[Line]:
    """Yield means over the second half of the steps, at the default tolerance and at the largest one whose errors of
    friction are all at most ERROR; compare a slide with eight branches with other programs."""
    steps = max(4 * rounds, FEWEST)
    half = steps // 2
    exact = _friction(sliding_job(points, steps, EXACT))[half:]
    for tolerance in (DEFAULT, *LARGER):
        march = begun(sliding_job(points, steps, tolerance))
        rows, clock = marched(march)
        late, at = rows[half:], f"tolerance {tolerance:g}"
        error = float(np.abs(np.array([row.measures.friction for row in late]) / exact - 1.0).max())
        if tolerance != DEFAULT and error > ERROR:
            continue
        yield Line(f"{at}: largest error of friction", error)
        yield Line(f"{at}: operator calls per step", statistics.fmean(row.operator_calls for row in late))
        yield Line(f"{at}: iterations per step", statistics.fmean(row.iterations for row in late))
        step = statistics.median(np.diff(clock)[half:].tolist())
        bare = statistics.median(interleave({"pair": pair(march.scene.slab, "float64")}, 10)["pair"])
        yield Line(f"{at}: a step", 1e3 * step, "ms")
        yield Line(f"{at}: a step over a transform and its inverse", step / bare)
        if tolerance != DEFAULT:
            break
    if asked.peers is not None:
        yield from _compare_with_peers(points, asked.peers)


def _friction(job: Json) -> Map:
    return np.array([row.measures.friction for row in marched(begun(job))[0]])


def _backward_euler_job(points: int, tolerance: float, precision: str = "double") -> Json:
    """Return a job in which all branches have a map."""
    numerics = {"integrator": "backward-euler", "tolerance": tolerance, "branch_error": 0.0, "precision": precision}
    rough = {"hurst": 0.8, "long_wavelength": 0.25, "short_wavelength": 8 / points, "rms_slope": 0.1, "seed": 1}
    branches = [{"modulus": MODULUS, "relaxation_time": tau} for tau in RELAXATION_TIMES]
    return {
        "grid": {"points": points, "size": 1.0},
        "surface": {"shape": "rough", **rough},
        "material": {"model": "zener", "modulus_inf": 1.0, "branches": branches},
        "history": [{"pressure": PRESSURE, "velocity": 1.0, "distance": LATER / points, "cells_per_step": 1}],
        "numerics": numerics,
    }


def _compare_with_peers(points: int, directory: Path) -> Iterator[Line]:
    """Measure this program at the tolerance that needs the fewest calls for an error of friction of at most ERROR, and
    other programs."""
    half, tried = LATER // 2, []
    with warnings.catch_warnings(action="ignore"):  # the body is as soft as 1 Pa
        rows = marched(begun(_backward_euler_job(points, EXACT_FOR_PEERS)))[0][-LATER:]
        exact = np.array([row.measures.friction_x for row in rows])
        for tolerance in TOLERANCES:
            rows, clock = marched(begun(_backward_euler_job(points, tolerance, "mixed")))
            friction = np.array([row.measures.friction_x for row in rows[-LATER:]])
            error = float(np.abs(friction / exact - 1.0)[half:].max())
            calls = statistics.fmean(row.operator_calls for row in rows[-half:])
            tried.append((calls, error, tolerance, np.diff(clock)[-LATER:], rows[-1].measures.contact_area))
    good = [found for found in tried if found[1] <= ERROR] or tried[-1:]
    calls, error, tolerance, seconds, area = min(good, key=lambda found: found[0])
    what, ours = f"8 branches, mixed precision, tolerance {tolerance:.2g}", float(np.mean(seconds[half:]))
    yield Line(f"{what}: contact area", area)
    yield Line(f"{what}: largest error of friction", error)
    yield Line(f"{what}: operator calls per step", calls)
    yield Line(f"{what}: a step", 1e3 * ours, "ms")
    yield Line(f"{what}: a step of the first {FIRST}", 1e3 * float(np.mean(seconds[FIRST // 2 : FIRST])), "ms")
    job = _backward_euler_job(points, EXACT_FOR_PEERS)
    heights = np.asarray(pc.surface(job["surface"], job["grid"]))
    q = 2j * np.pi * np.fft.rfftfreq(points, 1.0 / points)
    slope = np.fft.irfft(q * np.fft.rfft(heights, axis=1), points, axis=1)
    given = {"heights": heights, "slope": slope, "friction": exact[:FIRST], "load": PRESSURE, "wanted": ERROR}
    given |= {"relaxation_times": np.array(RELAXATION_TIMES), "modulus": MODULUS}
    yield from compare_peers(directory, PEERS, given, ours)


def steady(points: int, rounds: int, _: argparse.Namespace) -> Iterator[Line]:
    base = scene.set_up(load(sliding_job(points, 1)), Slab.alone(points, points))
    for speed in (0.01, 0.3, 10.0):
        yield Line(
            f"cold at {speed:g} m/s: operator calls", SteadySliding(base).solve((speed, 0.0), 1e5).operator_calls
        )
    sliding = SteadySliding(base)
    curve = [sliding.solve((0.03 * 10 ** (k / 8), 0.0), 1e5).operator_calls for k in range(min(17, rounds + 2))]
    yield Line("curve: operator calls per further point", statistics.fmean(curve[1:]))
    yield Line("curve: most operator calls per point", max(curve[1:]))

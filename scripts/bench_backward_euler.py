"""Sliding with eight branches by backward Euler, as tamaas can do it too: for part `slide` of scripts/bench.py.

Relaxation times from 1e-4 to 1e3, moduli of 2 each over a long-term modulus of 1, in a box of length 1 at a velocity of
1, by one cell a step. Friction is judged, and a step is timed, over the second half of STEPS steps, of both programs
alike: tamaas starts each solve from nothing, so that later steps take it no less.
"""

import statistics
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from bench_lines import Line, Map
from bench_peers import TAMAAS_SLIDING, Task, compare_peers
from bench_slid import slid

import parcontact as pc
from parcontact import job as jobs

STEPS = 12
PRESSURE = 0.15  # for 8 % of contact at the end
RELAXATION_TIMES = [10.0**k for k in range(-4, 4)]
MODULUS = 2.0
ERROR = 1e-3  # of friction
EXACT = 1e-7  # a tolerance whose friction others are compared with
LOOSER = (1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4)
PEERS = (Task("tamaas", TAMAAS_SLIDING, -3.0),)


def sliding(points: int, tolerance: float) -> dict[str, Any]:
    """The job, as a mapping; all branches have a map."""
    rough = {"hurst": 0.8, "long_wavelength": 0.25, "short_wavelength": 8 / points, "rms_slope": 0.1, "seed": 1}
    branches = [{"modulus": MODULUS, "relaxation_time": tau} for tau in RELAXATION_TIMES]
    slide = {"pressure": PRESSURE, "velocity": 1.0, "distance": STEPS / points, "cells_per_step": 1}
    return {
        "grid": {"points": points, "size": 1.0},
        "surface": {"shape": "rough", **rough},
        "material": {"model": "zener", "modulus_inf": 1.0, "branches": branches},
        "history": [slide],
        "numerics": {"integrator": "backward-euler", "tolerance": tolerance, "branch_error": 0.0},
    }


def beside_peers(points: int, directory: Path) -> Iterator[Line]:
    """Ours at the loosest tolerance with which friction is good to ERROR, and theirs."""
    exact, *_ = _slid(points, EXACT)
    for tolerance in LOOSER:
        friction, calls, seconds, area = _slid(points, tolerance)
        error = float(np.abs(friction / exact - 1.0)[STEPS // 2 :].max())
        if error <= ERROR:
            break
    what = f"8 branches, tolerance {tolerance:g}"
    yield Line("slide", f"{what}: contact area", area, "")
    yield Line("slide", f"{what}: largest error of friction", error, "")
    yield Line("slide", f"{what}: operator calls per step", calls, "")
    yield Line("slide", f"{what}: a step", 1e3 * seconds, "ms")
    heights = _heights(points)
    given = {"heights": heights, "slope": _slope(heights), "friction": exact, "load": PRESSURE, "wanted": ERROR}
    given |= {"relaxation_times": np.array(RELAXATION_TIMES), "modulus": MODULUS}
    yield from compare_peers(directory, "slide", PEERS, given, seconds)


def _slid(points: int, tolerance: float) -> tuple[Map, float, float, float]:
    """Friction along x of all steps; operator calls and seconds of a step, and the contact area at the end."""
    with warnings.catch_warnings(action="ignore"):  # of a body as soft as 1 Pa
        _, rows, clock = slid(jobs.load(sliding(points, tolerance)))
    later = rows[-(STEPS // 2) :]
    friction = np.array([row.measures.friction_x for row in rows[-STEPS:]])
    calls = statistics.fmean(row.operator_calls for row in later)
    return friction, calls, statistics.median(np.diff(clock)[-(STEPS // 2) :].tolist()), later[-1].measures.contact_area


def _heights(points: int) -> Map:
    job = sliding(points, EXACT)
    return np.asarray(pc.surface(job["surface"], job["grid"]))


def _slope(heights: Map) -> Map:
    """Along x, of the waves as they are."""
    count = heights.shape[1]
    q = 2.0 * np.pi * np.fft.rfftfreq(count, 1.0 / count)
    return np.asarray(np.fft.irfft(1j * q * np.fft.rfft(heights, axis=1), count, axis=1))

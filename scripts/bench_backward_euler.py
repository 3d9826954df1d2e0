"""Sliding with eight branches by backward Euler, as tamaas can do it too: for part `slide` of scripts/bench.py.

Relaxation times from 1e-4 to 1e3, moduli of 2 each over a long-term modulus of 1, in a box of length 1 at a velocity of
1, by one cell a step. Friction is judged, and a step is timed, over the second half of FIRST steps of others and of
LATER ones of ours: tamaas starts each solve from nothing, so that its later steps take as long as its first ones. Ours
are solved in mixed precision, and timed in the mean: for some the start does, which take half as long as others.
"""

import statistics
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from bench_lines import Line, Map
from bench_peers import TAMAAS_SLIDING, Task, compare_peers
from bench_slid import slid

import parcontact as pc
from parcontact import job as jobs

FIRST, LATER = 12, 48  # steps
PRESSURE = 0.165  # for 7 to 9 % of contact
RELAXATION_TIMES = [10.0**k for k in range(-4, 4)]
MODULUS = 2.0
ERROR = 1e-3  # of friction
EXACT = 1e-7  # a tolerance whose friction others are compared with
TOLERANCES = [1e-2, 5e-3, 2e-3, 1e-3, 5e-4]
PEERS = (Task("tamaas", TAMAAS_SLIDING, -3.0),)


def sliding(points: int, tolerance: float, precision: str = "double") -> dict[str, Any]:
    """The job, as a mapping; all branches have a map."""
    numerics = {"integrator": "backward-euler", "tolerance": tolerance, "branch_error": 0.0, "precision": precision}
    rough = {"hurst": 0.8, "long_wavelength": 0.25, "short_wavelength": 8 / points, "rms_slope": 0.1, "seed": 1}
    branches = [{"modulus": MODULUS, "relaxation_time": tau} for tau in RELAXATION_TIMES]
    slide = {"pressure": PRESSURE, "velocity": 1.0, "distance": LATER / points, "cells_per_step": 1}
    return {
        "grid": {"points": points, "size": 1.0},
        "surface": {"shape": "rough", **rough},
        "material": {"model": "zener", "modulus_inf": 1.0, "branches": branches},
        "history": [slide],
        "numerics": numerics,
    }


def beside_peers(points: int, directory: Path) -> Iterator[Line]:
    """Ours at the tolerance that makes friction good to ERROR with the fewest calls, and theirs."""
    exact = _slid(points, EXACT, "double").friction
    tried = [_slid(points, tolerance, "mixed") for tolerance in TOLERANCES]
    good = [found for found in tried if found.error(exact) <= ERROR] or tried[-1:]
    found = min(good, key=lambda found: found.calls)
    what = f"8 branches, mixed precision, tolerance {found.tolerance:.2g}"
    ours = statistics.fmean(found.seconds[LATER // 2 :])
    yield Line("slide", f"{what}: contact area", found.area, "")
    yield Line("slide", f"{what}: largest error of friction", found.error(exact), "")
    yield Line("slide", f"{what}: operator calls per step", found.calls, "")
    yield Line("slide", f"{what}: a step", 1e3 * ours, "ms")
    early = statistics.fmean(found.seconds[FIRST // 2 : FIRST])
    yield Line("slide", f"{what}: one of the first {FIRST}", 1e3 * early, "ms")
    heights = _heights(points)
    given = {"heights": heights, "slope": _slope(heights), "friction": exact[:FIRST], "load": PRESSURE, "wanted": ERROR}
    given |= {"relaxation_times": np.array(RELAXATION_TIMES), "modulus": MODULUS}
    yield from compare_peers(directory, "slide", PEERS, given, ours)


@dataclass(frozen=True)
class Slid:
    """Of all steps friction along x and seconds; operator calls of a later step; and the contact area at the end."""

    tolerance: float
    friction: Map
    seconds: list[float]
    calls: float
    area: float

    def error(self, exact: Map) -> float:
        """The largest one of friction in later steps."""
        return float(np.abs(self.friction / exact - 1.0)[LATER // 2 :].max())


def _slid(points: int, tolerance: float, precision: str) -> Slid:
    with warnings.catch_warnings(action="ignore"):  # of a body as soft as 1 Pa
        _, rows, clock = slid(jobs.load(sliding(points, tolerance, precision)))
    steps, seconds = rows[-LATER:], np.diff(clock)[-LATER:].tolist()
    friction = np.array([row.measures.friction_x for row in steps])
    calls = statistics.fmean(row.operator_calls for row in steps[LATER // 2 :])
    return Slid(tolerance, friction, seconds, calls, rows[-1].measures.contact_area)


def _heights(points: int) -> Map:
    job = sliding(points, EXACT)
    return np.asarray(pc.surface(job["surface"], job["grid"]))


def _slope(heights: Map) -> Map:
    """Along x, of the waves as they are."""
    count = heights.shape[1]
    q = 2.0 * np.pi * np.fft.rfftfreq(count, 1.0 / count)
    return np.asarray(np.fft.irfft(1j * q * np.fft.rfft(heights, axis=1), count, axis=1))

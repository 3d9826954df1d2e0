"""Part `flow`: the leakage through the gap of a rough contact, along x and along y."""

import argparse
import time
from collections.abc import Iterator

import numpy as np

from parcontact.effects.leakage.flow import Flow, solve_flow

from .table import Line
from .work import Cold

LOAD = 0.15  # mean pressure over E*, for 30 % of contact at a slope of 1
TOLERANCE = 1e-5  # tolerance of the contact solve
WARM = 32  # points of a small map, for which loops are compiled


def flow(points: int, rounds: int, _: argparse.Namespace) -> Iterator[Line]:
    gap = gap_of(points)
    yield Line("contact area", float(np.mean(gap == 0.0)))
    solve_flow(gap[:WARM, :WARM], (1.0, 1.0))
    began = time.process_time()
    for axis in ("x", "y"):
        start = time.process_time()
        found: Flow = solve_flow(gap, (1.0, 1.0), axis)
        yield Line(f"flow along {axis}", time.process_time() - start, "s")
        yield Line("  missing outflow over inflow", found.imbalance)
    yield Line("flow along x and along y", time.process_time() - began, "s")


def gap_of(points: int) -> np.ndarray:
    """The gap of a cold elastic solve, in units of the box."""
    surface = Cold(points, load=LOAD)
    solver = surface.solver(TOLERANCE)
    found = surface.solve_from(solver, surface.start(solver))
    return np.where(found.p > 0.0, 0.0, np.maximum(found.u - surface.heights - found.d, 0.0))

"""Tractive rolling: closed forms of Carter, limits of rubber, energies, and jobs that are refused."""

import math
from typing import Any

import pytest
from marched_jobs import column, marched

from parcontact.storage.step_row import StepRow

G, RADIUS, HALF_WIDTH, MU = 1e6, 1e-2, 1e-4, 0.5
LINE_LOAD = math.pi * G * HALF_WIDTH**2 / RADIUS  # Hertz, load [N/m] of a cylinder on an incompressible half space
HALF = 1.0 - math.sqrt(0.5)  # of the creep at which all slips: half of the force of sliding (F. W. Carter, 1926)


def cylinder(share: Any, cells: int = 8, ways: float = 8.0, across: int = 16, **more: Any) -> dict[str, Any]:
    """A cylinder that rolls over `ways` half-widths of its contact in steps of a cell, with a share of the creep at
    which all slips, on one row of points with `across` half-widths."""
    cell, size = HALF_WIDTH / cells, across * HALF_WIDTH
    load = {"pressure": LINE_LOAD / size}
    roll = {
        "velocity": 1.0,
        "distance": ways * HALF_WIDTH,
        "cells_per_step": 1,
        "creep": share * MU * HALF_WIDTH / RADIUS,
    }
    return {
        "grid": {"points": [across * cells, 1], "size": [size, cell]},
        "surface": {"shape": "cylinder", "radius": RADIUS},
        "material": {"model": "elastic", "shear_modulus": G, "poisson": 0.5},
        "interface": {"coefficient": MU, "stick": True},
        "history": [load, {**load, **roll}],
        "numerics": {"tolerance": 1e-4},
        **more,
    }


def shares(rows: list[StepRow]) -> Any:
    """Tangential force over the force of sliding, of each row."""
    return -column(rows, "force_x")[1:] / (MU * LINE_LOAD * HALF_WIDTH / 8)


def test_carter() -> None:
    """Half of the force of sliding: the error is of first order in the step over the half-width, 3.1 and 1.5 % of the
    force of sliding with 8 and 16 steps; extrapolated to short steps the force is right to 0.5 %, of which the box of
    16 half-widths makes 0.2 %. The zone that sticks is right to a cell."""
    errors = []
    for cells in (8, 16):
        march, rows = marched(cylinder(HALF, cells, ways=12.0))
        errors.append(shares(rows)[-1] * cells / 8 - 0.5)
        sticking = rows[-1].added[2] * march.scene.slab.points / cells / 2.0
        assert sticking == pytest.approx(math.sqrt(0.5), abs=1.0 / cells)
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)
    assert abs(2.0 * errors[1] - errors[0]) < 0.005 * 0.5

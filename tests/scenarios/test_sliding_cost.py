"""What a sliding step costs: operator calls, memory, and the same on any number of ranks."""

import tracemalloc
from typing import Any

import numpy as np
import pytest
from marching import column, marched
from mpi4py import MPI
from numpy.testing import assert_allclose
from sliding import TYRE, Json, rough, slide

from parcontact.parallel.fft import BLOCK_BYTES


def calls_per_step(points: int, history: list[Json], tolerance: float = 5e-3) -> tuple[float, float]:
    """Operator applications per step after the tenth, and the last friction."""
    _, rows = marched(rough(points, history, numerics={"tolerance": tolerance}))
    return float(np.mean(column(rows[11:], "operator_calls"))), rows[-1].measures.friction


@pytest.mark.parametrize(
    ("most", "change"),
    [
        (11, {}),
        (11, {"velocity": [0.0, 0.3]}),
        (13, {"cells_per_step": 0.25}),
        (15, {"velocity": [0.2, 0.2]}),
    ],
)
def test_warm_starts_save_work(most: float, change: Json) -> None:
    """A start that moves with the surface and is extrapolated: 9, 9, 10 and 13 operator applications are measured."""
    cells = 8 if "cells_per_step" in change else 30
    calls, _ = calls_per_step(512, [slide(512, cells, **change)])
    assert calls < most


def test_tolerance_of_friction() -> None:
    """At the default tolerance, 5e-3, friction is good to 1e-3."""
    stages = [slide(256, 30)]
    assert calls_per_step(256, stages)[1] == pytest.approx(calls_per_step(256, stages, 1e-7)[1], rel=1e-3)


@pytest.mark.mpi(3)
@pytest.mark.parametrize("velocity", [0.3, [0.0, 0.3]])
def test_memory(comm: MPI.Intracomm, velocity: Any) -> None:
    """At most one map of a rank's rows per branch and 14 more, counted and traced, beside the blocks of transforms
    and the larger cells of the preconditioner: two maps of 4 bytes on 1/4 + 1/16 + ... of the points, of which several
    ranks have the largest cells all, less than half a map in all."""
    data = rough(1024, [slide(1024, 2, velocity=velocity)], numerics={"tolerance": 0.1})
    data["material"] = {**TYRE, "branches": TYRE["branches"][:2]}  # type: ignore[index]
    blocks = 4 * BLOCK_BYTES
    marched({**data, "grid": {**data["grid"], "points": 128}, "numerics": {"accept_unconverged": True}}, comm=comm)
    tracemalloc.start()
    try:
        march, rows = marched(data, comm=comm)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    maps = 8 * march.scene.slab.shape[0] * 1024
    assert len(rows) == 4
    assert march.scene.slab.tally["map bytes"] <= 16 * maps + blocks
    assert peak <= 16.5 * maps + blocks


@pytest.mark.mpi(3)
@pytest.mark.parametrize(
    ("velocity", "tolerance", "agreement"), [(0.3, 1e-11, 1e-8), ([0.2, -0.1], 1e-11, 1e-8), ([0.2, -0.1], 1e-4, 1e-3)]
)
def test_any_number_of_ranks(comm: MPI.Intracomm, tolerance: float, agreement: float, velocity: Any) -> None:
    """After 80 steps of a rough contact: as one rank, to 1e-8 of solves at 1e-11 and 1e-3 of solves at 1e-4."""
    steps = {"velocity": velocity, "duration": 80 * 1e-3 / 32 / 0.3, "time_step": 1e-3 / 32 / 0.3}
    data = rough(32, [steps], numerics={"tolerance": tolerance}, output={"energy": True})
    data["surface"]["short_wavelength"] = 1.25e-4
    names = ("pressure", "force_x", "force_y", "friction", "contact_area", "approach", "max_pressure", "dissipated")
    alone, rows = marched(data)
    assert len(rows) == 82
    march, same = marched(data, comm=comm)
    for name in names:
        found, expected = column(same, name), column(rows, name)
        points = 3 / 32**2 if name == "contact_area" and tolerance > 1e-6 else 0.0
        assert_allclose(found, expected, rtol=0, atol=agreement * np.abs(expected).max() + points, err_msg=name)
    for name in ("pressure", "displacement"):
        whole, field = np.concatenate(march.scene.slab.from_all(march.field(name))), alone.field(name)
        share = agreement if tolerance < 1e-6 else 0.03
        assert_allclose(whole, field, rtol=0, atol=share * np.abs(field).max(), err_msg=name)

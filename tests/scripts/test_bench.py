"""What scripts/bench.py counts and concludes; what it times is judged by nobody but its reader."""

import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from marching import load_script
from mpi4py import MPI

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics import loops
from parcontact.solve import kernels
from parcontact.solve.preconditioner import extension


@pytest.fixture(scope="module")
def meter() -> ModuleType:
    return load_script("bench.meter")


@pytest.fixture(scope="module")
def peers() -> ModuleType:
    return load_script("bench.peers")


@pytest.mark.parametrize(
    ("function", "expected"),
    [
        (kernels.residual, {"working": 1, "u": 1, "h": 1, "r": 1}),
        (kernels.turn, {"working": 1, "z": 1, "t": 2}),  # t <- z + beta t
        (kernels.scale, {"p": 2}),
        (loops.travel, {"p": 1, "p_old": 1, "out": 1}),
        (loops.commit, {"displacement": 1, "buffer": 2, "u": 1, "heights": 1, "out": 1}),
        (extension._add_up_back, {"cells": 1, "beside": 1, "points": 2}),  # rows of maps, picked by a function
        (extension._interpolate_back, {"known": 1, "known_beside": 1, "points": 1, "beside": 1, "cells": 1}),
    ],
    ids=lambda value: value.py_func.__name__ if hasattr(value, "py_func") else "",
)
def test_what_a_loop_reads_and_writes(meter: ModuleType, function: Any, expected: dict[str, int]) -> None:
    passes = meter.passes_of(function.py_func)
    assert {name: count for name, count in passes.items() if count} == expected


def test_a_transform_by_its_bytes(meter: ModuleType) -> None:
    """Along x a map becomes n/2 + 1 waves a row, along y these are transformed in place; and back."""
    n = 32
    slab = Slab(MPI.COMM_SELF, n, n)
    field, out = slab.zeros(), slab.zeros()
    with meter.Meter().in_place() as seen:
        fft = FFT(slab)
        fft.backward(fft.forward(field), out)
        kernels.scale(out, 2.0)
    map_bytes, waves = 8 * n * n, 16 * n * (n // 2 + 1)
    assert seen.bytes == {"transform": 2 * (map_bytes + 3 * waves), "scale": 2 * map_bytes}
    assert seen.flops == 2 * (2.5 * n * n * 5 + 5 * n * (n // 2 + 1) * 5)  # log2(32) = 5
    assert seen.seconds["transform"] > 0.0
    kernels.scale(out, 2.0)
    assert seen.bytes["scale"] == 2 * map_bytes  # no longer in place


def test_what_memory_lets_two_ranks_do() -> None:
    """Nothing passes through memory: twice as fast; all of it at the rate of one rank: as fast as one."""
    scale = load_script("bench.scaling")
    one = scale.Run(3.0, {"transform": 2.0, "exchange": 0.0, "everything else": 1.0}, 0.0, 0.0, 0.0)
    assert scale.best_ratio(one, scale.Run(2.0, {}, 0.0, 0.0, 0.0), 1.0, 10.0) == 2.0
    assert scale.best_ratio(one, scale.Run(2.0, {}, 20.0, 10.0, 0.0), 1.0, 10.0) == 1.0
    assert scale.best_ratio(one, scale.Run(2.0, {}, 20.0, 10.0, 15.0), 1.0, 10.0) == 0.5  # 30 more for what is sent
    assert scale.best_ratio(one, scale.Run(2.0, {}, 0.0, 0.0, 0.0), 2.0, 10.0) == 2.0  # twice the work


@pytest.mark.parametrize(
    ("begins", "needs"),
    [(-2.0, 1e-3), (-4.0, 1e-3)],  # the first tolerance is too loose, or tighter than it need be
)
def test_the_loosest_tolerance_is_found(peers: ModuleType, begins: float, needs: float) -> None:
    """A program whose error is its tolerance, and which takes a second for each digit."""
    code = "def attempt(tolerance):\n    return -float(np.log10(tolerance)), tolerance"
    given = {"heights": np.zeros((2, 2)), "load": 1.0, "wanted": needs * (1.0 + 1e-12)}
    found = peers.search(Path(sys.executable), peers.Task("it", code, begins), given)
    assert found.reached
    assert found.seconds == pytest.approx(3.0)
    assert found.error == pytest.approx(1e-3)


def test_a_program_that_is_too_slow(peers: ModuleType) -> None:
    """What its last try took at least counts, or a longer one before."""
    first = [{"began": 0.0}, {"seconds": 100.0, "error": 1e-5}, {"began": 120.0}]
    assert peers.judge(first, 1e-7).seconds == peers.LIMIT - 120.0
    assert not peers.judge(first, 1e-7).reached
    assert peers.judge([*first[:2], {"began": 400.0}], 1e-7).seconds == 100.0


def test_a_slide_goes_on_for_as_many_rounds_as_are_asked_for() -> None:
    """Also past the length of the box, whose surface comes round again."""
    slide = load_script("bench.work").Slide(64)
    for _ in range(66):
        slide.step()
    assert slide.march.row.distance == pytest.approx(65e-3 / 64, rel=1e-12)  # the first step is the jump of the load

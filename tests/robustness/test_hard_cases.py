"""The cases in which contact codes fail, each at its physical outcome, in every precision, on any number of ranks.

What is expected and how far off it may be stands with the cases: here, and in parcontact/doctor.
"""

from collections.abc import Callable

import pytest
from mpi4py import MPI

from parcontact.doctor.bench import Bench
from parcontact.doctor.checks import CHECKS, Check, run_check

from . import hard_sliding, hard_times
from .strict_bench import StrictBench

CASES: tuple[Callable[[Bench], None], ...] = (
    *(check.run for check in CHECKS),
    *(hard_times.long_steps, hard_times.short_steps, hard_times.moduli_far_apart, hard_times.odd_branches),
    *(hard_times.vanishing_load, hard_times.many_decades),
    *(hard_times.load_again, hard_sliding.single_point, hard_sliding.shortest_wave, hard_sliding.long_box),
    *(hard_sliding.reversal, hard_sliding.stop, hard_sliding.extreme_velocities),
    *(hard_sliding.two_waves, hard_sliding.flat_surface),
)
NAMES = [case.__name__ for case in CASES]
BY_NAME = {case.__name__: Check(case.__name__, "", case) for case in CASES}


@pytest.mark.mpi(3)
@pytest.mark.parametrize("name", NAMES)
def test_double_precision(comm: MPI.Intracomm, name: str) -> None:
    assert run_check(BY_NAME[name], StrictBench(comm)).wrong == []


@pytest.mark.mpi(2)
@pytest.mark.parametrize("name", NAMES)
def test_mixed_precision(comm: MPI.Intracomm, name: str) -> None:
    assert run_check(BY_NAME[name], StrictBench(comm, "mixed")).wrong == []

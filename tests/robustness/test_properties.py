"""Random scenes: what must hold after every step, whatever the body, the surface, the history and the grid.

`scripts/random_scenes.py` makes them by the hundred, others with every seed. Here Hypothesis draws the seeds, the same
ones in every run, and prints that of a scene that fails.
"""

from pathlib import Path
from random import Random

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mpi4py import MPI

from . import scenes
from .witness import distance, trial, witness

FEW = 25  # scenes of Hypothesis; each is marched twice
SEEDS = range(6)  # of scenes on many ranks


@settings(max_examples=FEW, derandomize=True, suppress_health_check=list(HealthCheck))
@given(seed=st.integers(0, 2**64 - 1), stages=st.integers(1, 4))
def test_any_scene(tmp_path_factory: pytest.TempPathFactory, seed: int, stages: int) -> None:
    """No tension, no penetration beyond the certificate, the load met, nothing gained or lost, no NaN; and the same
    from above or below, in other units (to the last bit), in the mirror, with x and y exchanged."""
    found = trial(Random(seed), tmp_path_factory.getbasetemp(), stages)
    assert found.violations == [], found.about
    assert found.counts["failed"] == 0, (found.about, found.failures)


@pytest.mark.mpi
@pytest.mark.parametrize("seed", SEEDS)
def test_any_number_of_ranks(comm: MPI.Intracomm, tmp_path: Path, seed: int) -> None:
    """The same scenes, from the same seeds on all ranks: what must hold does, and pressures are no farther from those
    of one rank than two solutions within the certificate may be."""
    sketch = scenes.sketch(Random(f"ranks {seed}"), stages=3)
    together, alone = witness(sketch, tmp_path, comm), witness(sketch, tmp_path)
    assert together.violations == []
    assert not together.failure
    rows = together.march.scene.slab.rows
    assert distance(together, alone, lambda p: p[rows]) <= 1.0
    assert np.isclose(together.last.time, alone.last.time)

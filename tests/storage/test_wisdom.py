"""FFTW's wisdom is kept for runs with the same transforms, where nobody else can have put it."""

import os
from pathlib import Path

import pytest

from parcontact.job import load
from parcontact.parallel.slab import Slab
from parcontact.scene import choices
from parcontact.storage import wisdom

NOBODY = 65534  # a user other than the one who runs the tests
JOB = """\
grid: {points: [16, 4], size: [1.0e-3, 2.5e-4]}
surface: {shape: wave, amplitude: 1.0e-6, waves: [1, 0]}
material: {model: elastic, shear_modulus: 1.0e6}
history: [{pressure: 1.0e4}]
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="gives a directory to somebody else")
def test_plans_in_a_directory_of_others_are_not_read(cache: Path, tmp_path: Path) -> None:
    (tmp_path / "job.yaml").write_text(JOB)
    job, slab = load(tmp_path / "job.yaml"), Slab.alone(16, 4)
    wisdom.keep(choices(job).transforms, slab)
    (kept,) = (cache / "parcontact" / "plans").iterdir()
    assert wisdom._place(choices(job).transforms, slab) == kept
    os.chown(kept.parent, NOBODY, NOBODY)
    assert wisdom._place(choices(job).transforms, slab) is None
    wisdom.keep(choices(job).transforms, slab)
    assert [path.name for path in kept.parent.iterdir()] == [kept.name]


def test_plans_are_those_of_a_precision(cache: Path, tmp_path: Path) -> None:
    """An operator in single precision has transforms of its own."""
    (tmp_path / "job.yaml").write_text(JOB)
    slab, mixed = Slab.alone(16, 4), "numerics.precision=mixed"
    jobs = [load(tmp_path / "job.yaml", [mixed, f"numerics.tolerance={size}"]) for size in ("1e-3", "1e-4")]
    assert len({wisdom._place(choices(job).transforms, slab) for job in jobs} - {None}) == 2


def test_wisdom_of_a_checkpoint(cache: Path) -> None:
    """It is used for as many ranks; what is none is left alone, as is what was kept before."""
    slab = Slab.alone(16, 4)
    saved = wisdom.gather(slab)
    assert wisdom._adopt(saved.tobytes(), slab)
    assert not wisdom._adopt(b"none", slab)
    wisdom.keep(["a"], slab)
    (kept,) = (cache / "parcontact" / "plans").iterdir()
    before = kept.stat().st_mtime_ns
    wisdom.keep(["a"], slab)
    wisdom.recall(["a"], slab, None)
    assert kept.stat().st_mtime_ns == before

"""The examples of jobs/ that slide, as they promise."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from marching import JOBS, column, example, marched
from numpy.testing import assert_allclose

from parcontact.storage import tables

if TYPE_CHECKING:
    from conftest import Main, RunParcontact


def test_example_of_full_contact() -> None:
    """What jobs/full_contact.yaml promises, to its four digits and the 1e-4 of its steps."""
    _, rows = marched(example("full_contact"))
    t, friction = column(rows, "time"), column(rows, "friction")
    ends = [20e-3, 30e-3, 40e-3]
    assert_allclose(np.interp(ends, t, friction), [1.945e-4, 9.771e-4, 9.771e-4], rtol=5e-4)
    peaks = [(20e-3, 30e-3, 1.178e-3, 1.47e-3), (30.6e-3, 40e-3, 1.108e-3, 2.36e-3 - 0.6e-3)]
    for start, end, highest, when in peaks:
        there = (t > start) & (t < end)
        assert friction[there].max() == pytest.approx(highest, rel=5e-4)
        assert t[there][friction[there].argmax()] - start == pytest.approx(when, abs=5e-5)
    force = column(rows, "force_x")
    assert np.all(np.abs(np.diff(force[t > 1e-3])) < 0.05 * np.abs(force).max())  # it does not jump
    assert friction[-1] == pytest.approx(9.771e-4 * np.exp(-5.0), rel=5e-3)


def test_example_of_a_sphere() -> None:
    """What jobs/sphere_sliding.yaml promises for V* = 1, within 3 % with 8 cells per a* and steps twice as long."""
    _, rows = marched(example("sphere_sliding", "grid.points=176", "history.0.time_step=2.5e-4"))
    t, friction = column(rows, "time") / 1e-2, column(rows, "friction") * 1e-2 / 0.46765e-3
    promised = np.array([0.0948, 0.3435, 0.4740, 0.5394, 0.5746, 0.5953])
    assert_allclose(np.interp([0.2, 0.6, 1.0, 1.4, 1.8, 2.2], t, friction), promised, rtol=3e-2)


@pytest.mark.rendered
def test_example_of_a_velocity_step(run_parcontact: "RunParcontact", main: "Main", tmp_path: Path) -> None:
    """As a user would, at an eighth of the waves and points: friction peaks and settles, the area falls; a picture."""
    job = JOBS / "velocity_step.yaml"
    smaller = ["--set", "grid.points=128", "--set", "surface.0.short_wavelength=1.25e-4", "--quiet"]
    ran = run_parcontact([job, "--out", tmp_path / "out", *smaller], ranks=2)
    assert ran.returncode == 0, ran.stderr
    table = tables.read(tmp_path / "out/measures.csv")
    distance, friction, area = (np.array(table[name]) for name in ("distance", "friction", "contact_area"))
    slow, late = distance < 2.01e-5, distance > 2e-4
    peak = int(friction.argmax())
    assert 2e-5 < distance[peak] < 5e-5
    assert friction[peak] > 1.4 * friction[late].max()
    assert friction[peak] > 1.4 * friction[slow].max()
    assert area[late].max() < 0.3 * area[slow].min()
    assert main("plot", tmp_path / "out")[0] == 0
    assert (tmp_path / "out/picture.png").stat().st_size > 10_000

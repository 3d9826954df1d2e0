"""A viscoelastic body under a surface that does not slide: creep, relaxation, unloading, full contact."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from closed_forms import step_responses
from marching import PRONY, SLS, column, example, marched
from numpy.testing import assert_allclose

from parcontact.march.loop import March
from parcontact.storage.row import StepRow
from parcontact.theory import lee_radok

Json = dict[str, Any]
FORCE, RADIUS = 0.15, 1e-2  # N, m
LONG = 1e-2  # s, the creep time of the body


def sphere(points: int, size: float, history: list[Json], **numerics: Any) -> Json:
    return {
        "grid": {"points": points, "size": size, "boundary": "free"},
        "surface": {"shape": "sphere", "radius": RADIUS},
        "material": SLS,
        "history": history,
        "numerics": {"tolerance": 1e-5, **numerics},
        "output": {"energy": True},
    }


def contact_radius(march: March, area: np.ndarray) -> np.ndarray:
    grid = march.scene.job.grid
    return np.sqrt(area * grid.lx * grid.ly / np.pi)


def force(march: March, pressure: np.ndarray) -> np.ndarray:
    grid = march.scene.job.grid
    return pressure * grid.lx * grid.ly


# -- a sphere ----------------------------------------------------------------------------------------------------------


def test_creep_under_a_load() -> None:
    """Lee and Radok, 40 to 90 cells per radius: radius (from the area), approach and pressure within 0.5 %.

    Pressures are compared in the inner nine tenths of the contact, relative to the highest; the edge is a cell wide.
    """
    profiles = []

    def keep(march: March) -> None:
        if march.row.step:
            profiles.append(march.field("pressure")[128, 128:])

    history = [{"force": FORCE, "duration": 3e-2, "time_step": {"first": 1e-4, "growth": 1.05}}]
    march, rows = marched(sphere(256, 3e-3, history), [keep])
    t = column(rows[1:], "time")
    radius = step_responses.load_step_contact_radius(t, FORCE, RADIUS, *PRONY)
    assert_allclose(contact_radius(march, column(rows[1:], "contact_area")), radius, rtol=5e-3)
    assert_allclose(column(rows[1:], "approach"), radius**2 / RADIUS, rtol=5e-3)
    assert_allclose(column(rows[1:], "friction"), 0.0, atol=1e-4)
    r = np.arange(128) * march.scene.job.grid.dx
    for n in range(0, len(t), 6):
        exact = step_responses.load_step_pressure(r, t[n], FORCE, RADIUS, *PRONY)
        inner = r < 0.9 * radius[n]
        assert_allclose(profiles[n][inner], exact[inner], rtol=0, atol=5e-3 * exact.max())


def test_relaxation_at_an_approach() -> None:
    """The force follows G(t) exactly, the contact stays; the sphere's force itself to 0.1 % at 34 cells per radius."""
    depth = 5e-5
    history = [{"approach": depth, "duration": 5e-3, "time_step": {"first": 1e-5, "growth": 1.5}}]
    march, rows = marched(sphere(96, 2e-3, history, tolerance=1e-8))
    found = force(march, column(rows[1:], "pressure"))
    exact = step_responses.displacement_step_force(column(rows[1:], "time"), depth, RADIUS, *PRONY)
    assert_allclose(found, exact, rtol=1e-3)
    assert_allclose(found / found[0], exact / exact[0], rtol=1e-6)
    assert len(set(column(rows[1:], "contact_area"))) == 1


@pytest.mark.parametrize("rise", [1e-4, 1e-3])
def test_retraction(rise: float) -> None:
    """Ting: force within 1e-4 of its peak, lift-off within one step although the sphere is still below the surface."""
    depth, steps = 5e-5, 50
    history = [
        {"approach": {"from": start, "to": end}, "duration": rise, "time_step": rise / steps}
        for start, end in ((0.0, depth), (depth, 0.0))
    ]
    march, rows = marched(sphere(128, 2e-3, history, tolerance=1e-6))
    t, found = column(rows, "time"), force(march, column(rows, "pressure"))
    exact = lee_radok.triangle_force(t, depth, rise, RADIUS, *PRONY)
    assert_allclose(found, exact, rtol=0, atol=1e-4 * exact.max())
    lift_off = lee_radok.triangle_lift_off_time(rise, *PRONY)
    assert t[np.flatnonzero(found)[-1]] == pytest.approx(lift_off, abs=rise / steps)
    assert found.min() == 0.0
    assert np.all(found[t > lift_off] == 0.0)
    assert np.all(column(rows, "contact_area")[t > lift_off] == 0.0)
    assert column(rows, "approach")[t > lift_off].max() > 0.05 * depth  # no contact, and yet below the surface


def test_no_load_on_a_body_at_rest() -> None:
    """Nothing happens, and nothing is undefined."""
    history = [{"force": 0.0, "duration": 1e-3, "time_step": 5e-4}, {"force": FORCE}]
    march, rows = marched(sphere(16, 3e-3, history))
    assert [row.measures.friction for row in rows[:3]] == [0.0, 0.0, 0.0]
    assert [row.measures.contact_area for row in rows[:3]] == [0.0, 0.0, 0.0]
    assert rows[2].work == rows[2].stored == rows[2].dissipated == 0.0
    assert_allclose(force(march, np.array(rows[-1].measures.pressure)), FORCE, rtol=1e-12)


def near(rows: list[StepRow], t: float, name: str) -> float:
    """A number at an instant, between steps linearly."""
    return float(np.interp(t, column(rows, "time"), column(rows, name)))


def test_example_of_creep() -> None:
    """What jobs/creep.yaml promises, within 0.5 % of approach and 1 % of radius at a third of its points."""
    march, rows = marched(example("creep", "grid.points=96"))
    promised = [(1, 0.5748, 33.03), (3, 0.6985, 48.79), (10, 0.8811, 77.64), (50, 1.0055, 101.1)]
    for t, radius, approach in [(0, 0.4676, 21.87), *promised]:
        area = near(rows[1:], 1e-3 * t, "contact_area")
        assert contact_radius(march, np.array(area)) == pytest.approx(1e-3 * radius, rel=1e-2)
        assert near(rows[1:], 1e-3 * t, "approach") == pytest.approx(1e-6 * approach, rel=5e-3)


@pytest.mark.parametrize(("between", "approach"), [(0.0, 43.88), (0.075, 71.68)])
def test_example_of_unloading(between: float, approach: float) -> None:
    """What jobs/unload_reload.yaml promises of the second loading: the approach, to 0.5 % at a third of its points."""
    _, rows = marched(example("unload_reload", "grid.points=96", f"history.1.force={between}"))
    jumps = [after for before, after in pairwise(rows) if before.time == after.time]
    found = [row.measures.approach for row in jumps if row.measures.pressure > 0.0]
    assert found[0] == pytest.approx(21.87e-6, rel=5e-3)
    assert found[-1] == pytest.approx(1e-6 * approach, rel=5e-3)
    assert (jumps[1].measures.contact_area > 0.0) == (between > 0.0)


# -- waves -------------------------------------------------------------------------------------------------------------


def test_contact_that_spreads_until_it_is_full() -> None:
    """Westergaard's wave under a load step, which grows as J(t) says: 1.5 cells of 256 and 1 % in time."""
    amplitude, wavelength, pressure, cells = 5e-7, 2.5e-4, 1e4, 256
    data = {
        "grid": {"points": [cells, 1], "size": [wavelength, wavelength]},
        "surface": {"shape": "wave", "amplitude": amplitude, "waves": [1, 0]},
        "material": SLS,
        "history": [{"pressure": pressure, "duration": 1.5e-2, "time_step": {"first": 5e-5, "growth": 1.02}}],
        "numerics": {"tolerance": 1e-7},
    }
    _, rows = marched(data)
    t, found = column(rows[1:], "time"), column(rows[1:], "contact_area")
    low, high = (
        step_responses.load_step_contact_fraction(factor * t, pressure, amplitude, wavelength, *PRONY)
        for factor in (0.99, 1.01)
    )
    assert np.all((found > low - 1.5 / cells) & (found < high + 1.5 / cells))
    full = step_responses.load_step_full_contact_time(pressure, amplitude, wavelength, *PRONY)
    assert full == pytest.approx(10.69e-3, rel=1e-3)
    assert np.all((found == 1.0) == (t > full))


@pytest.mark.parametrize("integrator", ["exponential", "backward-euler"])
def test_flat_surface(integrator: str) -> None:
    """Uniform pressure, no gap, no friction, no energy: a mean pressure moves nothing in a periodic body."""
    data = {
        "grid": {"points": 8, "size": 1e-3},
        "surface": {"shape": "flat"},
        "material": SLS,
        "history": [{"pressure": 1e5, "velocity": [0.3, 0.1], "duration": 1e-3, "time_step": 2e-4}],
        "numerics": {"integrator": integrator},
        "output": {"energy": True},
    }
    march, rows = marched(data)
    assert_allclose(march.field("pressure"), 1e5, rtol=1e-12)
    assert_allclose(march.field("gap"), 0.0, atol=1e-15)
    for row in rows[1:]:
        assert row.measures.contact_area == 1.0
        assert_allclose([row.measures.friction, row.work, row.stored, row.dissipated], 0.0, atol=1e-20)

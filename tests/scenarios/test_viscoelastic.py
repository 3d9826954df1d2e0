"""A viscoelastic body under a surface that does not slide: creep, relaxation, unloading, full contact."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from closed_forms import step_responses
from marched_jobs import PRONY, SLS, begun, column, example, marched
from mpi4py import MPI
from numpy.testing import assert_allclose
from sliding import TYRE

from parcontact.march.loop import March
from parcontact.physics.body import BodyMemory, ZenerBody, surface_of
from parcontact.physics.energy import ElasticPressure, ZenerEnergy
from parcontact.theory import hertz

Json = dict[str, Any]
FORCE, RADIUS = 0.15, 1e-2  # N, m


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
    exact = hertz.triangle_force(t, depth, rise, RADIUS, *PRONY)
    assert_allclose(found, exact, rtol=0, atol=1e-4 * exact.max())
    lift_off = hertz.triangle_lift_off_time(rise, *PRONY)
    assert t[np.flatnonzero(found)[-1]] == pytest.approx(lift_off, abs=rise / steps)
    assert found.min() == 0.0
    assert np.all(found[t > lift_off] == 0.0)
    assert np.all(column(rows, "contact_area")[t > lift_off] == 0.0)
    assert column(rows, "approach")[t > lift_off].max() > 0.05 * depth  # no contact, and yet below the surface


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


# -- a viscoelastic body with branches far from its time steps, and its energies --------------------------------------


def bumps(**changes: Any) -> Json:
    return {
        "grid": {"points": [32, 24], "size": [1e-3, 0.75e-3]},
        "surface": [
            {"shape": "wave", "amplitude": 1e-6, "waves": [2, 1]},
            {"shape": "wave", "amplitude": 5e-7, "waves": [-1, 3], "phase": 0.4},
            {"shape": "sphere", "radius": 0.05},
        ],
        "material": SLS,
        "history": [
            {"pressure": 2e4, "duration": 2e-3, "time_step": {"first": 1e-4, "growth": 1.5}},
            {"pressure": 3e4, "velocity": [0.1, 0.02], "duration": 2e-3, "time_step": 2e-4},
            {"pressure": 0.0, "duration": 1e-3, "time_step": 5e-4},
            {"pressure": {"from": 0.0, "to": 2e4}, "velocity": -0.05, "duration": 2e-3, "time_step": 5e-4},
        ],
        "numerics": {"tolerance": 1e-9},
        "output": {"energy": True},
        **changes,
    }


# -- energy ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("boundary", "kernel"), [("periodic", "spectral"), ("periodic", "love"), ("free", "love")])
def test_energies_are_those_of_the_maps(boundary: str, kernel: str) -> None:
    """Stored energy from the branch maps themselves and A^-1, and the balance, after jumps, sliding, no contact.

    In a free scene the inverse of the operator is known only through what has been: the body's laws in pressures.
    """
    data = bumps(numerics={"tolerance": 1e-6, "kernel": kernel})
    data["grid"]["boundary"] = boundary
    checked = []

    def check(march: March) -> None:
        energy, body = march.scene.energy, march.scene.material
        assert march.state.energy is not None
        assert isinstance(energy, ZenerEnergy)
        assert isinstance(body, ZenerBody)
        maps = maps_of(body, march.state.body)
        if isinstance(energy.inverse, ElasticPressure):
            inner = maps_of(energy.inverse.body, march.state.energy.elastic)[0]
            assert_allclose(applied(march, inner), maps[0], rtol=0, atol=1e-12 * np.abs(maps[0]).max())
        inverses = [inverse(march, index) for index in range(len(maps))]
        weights = [body.prony.modulus_inf, *(1.0 / body.prony.moduli)]
        direct = 0.5 * sum(w * np.sum(a * b) for w, a, b in zip(weights, maps, inverses, strict=True))
        assert march.state.energy.stored == pytest.approx(direct, rel=1e-9, abs=1e-30)
        checked.append(direct)

    _, rows = marched(data, [check])
    assert max(checked) > 0.0
    for row in rows:
        assert row.stored + row.dissipated == pytest.approx(row.work, rel=1e-11, abs=1e-30)
        assert row.dissipated == pytest.approx(sum(row.branch_dissipation), rel=1e-12, abs=0.0)


def maps_of(body: ZenerBody, memory: BodyMemory | None) -> list[np.ndarray]:
    """The displacement and the branch maps."""
    assert memory is not None
    body.advance_branches(memory)
    return [surface_of(memory), *memory.branches]


def applied(march: March, field: np.ndarray) -> np.ndarray:
    out = np.empty_like(field)
    return march.scene.operators.operator.apply(np.ascontiguousarray(field), out)


def inverse(march: March, index: int) -> np.ndarray:
    """A^-1 of the displacement (0) or of a branch map (1, 2, ...)."""
    scene = march.scene
    body, energy = scene.material, scene.energy
    assert march.state.energy is not None
    assert isinstance(energy, ZenerEnergy)
    assert isinstance(body, ZenerBody)
    if isinstance(energy.inverse, ElasticPressure):
        return maps_of(energy.inverse.body, march.state.energy.elastic)[index]
    field = maps_of(body, march.state.body)[index]
    return scene.operators.preconditioner.apply(field, np.empty_like(field))


# -- errors of friction that rises from rest in steps of whole cells: it comes late, most of all in the first ---------

POINTS, CELLS, FINER = 48, 4, 16
ROUGH = {"shape": "rough", "hurst": 0.8, "rms_slope": 0.05, "long_wavelength": 5e-4, "short_wavelength": 1.25e-4}


def job(material: Any, speed: float, seed: int, cells_per_step: float = 1.0) -> dict[str, Any]:
    """A load of 20 kPa at once, and a slide of some cells."""
    slide = {"velocity": speed, "distance": CELLS * 1e-3 / POINTS, "cells_per_step": cells_per_step}
    return {
        "grid": {"points": POINTS, "size": 1e-3},
        "surface": {**ROUGH, "seed": seed},
        "material": material,
        "history": [{"pressure": 2e4, **slide}],
    }


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(("material", "speed"), [(TYRE, 1e-4), (TYRE, 1e-3), (SLS, 1e-3)])
def test_stated_errors_cover_what_comes_late(material: Any, speed: float, seed: int) -> None:
    """Errors by time steps, in the mean over the slide: at least 0.7 and at most 4 times those of its steps against
    sixteen times shorter ones. Without what comes late they are 0.05 to 0.25 times."""
    march, rows = marched(job(material, speed, seed))
    _, finer = marched(job(material, speed, seed, 1.0 / FINER))
    found, exact = column(rows, "friction")[-CELLS:], column(finer, "friction")[-FINER * CELLS :][FINER - 1 :: FINER]
    true = np.abs(found - exact).mean() / found.mean()
    assert march.state.errors.friction is not None
    assert 0.7 * true < march.state.errors.friction.time < 4.0 * true


def test_errors_of_energies_and_of_the_mean_gap() -> None:
    """A rough surface is pressed and slides, and a ball that sticks is rubbed once, on 24 and 48 cells: stated errors
    cover the differences and are at most a seventh of the work. Without energies nothing is summed."""
    rough = {"shape": "rough", "hurst": 0.8, "long_wavelength": 5e-4, "short_wavelength": 2.5e-4, "rms_slope": 0.05}
    slide = [{"pressure": 3e4, "duration": 1e-3}, {"pressure": 3e4, "velocity": 0.3, "distance": 1e-4}]
    rub = [{"force": 0.01}, {"force": 0.01, "velocity": {"amplitude": 1e-3, "frequency": 100.0}, "cycles": 1}]
    stuck = {"material": {"model": "elastic", "shear_modulus": 1e6}, "interface": {"coefficient": 0.3, "stick": True}}
    ball = {"surface": {"shape": "sphere", "radius": 1e-2}, "history": rub, **stuck}
    for boundary, scene in (("periodic", {"surface": rough, "material": SLS, "history": slide}), ("free", ball)):
        rows = []
        for points in (24, 48):
            grid = {"points": points, "size": 1e-3, "boundary": boundary}
            march, found = marched({"grid": grid, **scene, "output": {"energy": True}})
            rows.append(found[-1])
        coarse, fine = rows
        assert 0.0 < coarse.error_energy < coarse.work / 7.0
        assert max(abs(coarse.work - fine.work), abs(coarse.dissipated - fine.dissipated)) < coarse.error_energy
        if boundary == "free":
            assert abs(coarse.added[-1] - fine.added[-1]) < coarse.error_energy
        else:
            assert abs(coarse.measures.mean_gap / fine.measures.mean_gap - 1.0) < coarse.error_gap < 0.1
        assert "errors/energy" in march.entries()
    plain = begun({"grid": {"points": 8, "size": 1e-3}, **ball})
    assert "errors/energy" not in plain.entries()
    assert math.isnan(plain.row.error_energy)


@pytest.mark.mpi
@pytest.mark.parametrize("middle", [(0.5, 0.5), (0.35, 0.4), (0.64, 0.52)])
def test_error_of_the_mean_gap_in_a_free_box(middle: tuple[float, float], comm: MPI.Intracomm) -> None:
    """A paraboloid that hardly touches, against its mean height in closed form. The points are shifted by half a cell
    against the box. The stated error covers the error by this shift, where it is of first order in the cell and where
    it is of second order, and is at most four times as large."""
    size, points = 1e-3, 32
    ball = {"shape": "sphere", "radius": RADIUS, "center": [size * share for share in middle]}
    grid, body = {"points": points, "size": size, "boundary": "free"}, {"model": "elastic", "shear_modulus": 1e6}
    _, rows = marched({"grid": grid, "surface": ball, "material": body, "history": [{"force": 1e-9}]}, comm=comm)
    exact = sum(size**2 * (1 / 12 + (share - 0.5) ** 2) for share in middle) / (2 * RADIUS)
    error, measures = abs(rows[-1].measures.mean_gap / exact - 1.0), rows[-1].measures
    assert error < measures.gap_by_edges / exact < 4.0 * error

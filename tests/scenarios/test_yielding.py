"""Contact with a counterbody that yields: no change below the hardness, edges of yielded points, slides, mistakes."""

from typing import Any

import numpy as np
import pytest
from marched_jobs import column, marched
from numpy.testing import assert_allclose

import parcontact as pc
from parcontact.march import budget, state
from parcontact.march.time_error import radius_of

GRID = {"points": [64, 64], "size": [1e-3, 1e-3]}
ELASTIC = {"model": "elastic", "shear_modulus": 1e6}
ZENER = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 2e6, "relaxation_time": 1e-4}]}
SPHERE = {"shape": "sphere", "radius": 1e-2}
ROUGH = {"shape": "rough", "hurst": 0.8, "long_wavelength": 5e-4, "short_wavelength": 1.25e-4, "rms_slope": 0.1}
PRESS = {"pressure": 5e4, "duration": 1e-4, "time_step": {"first": 1e-6, "growth": 1.5}}
SLIDE = {"pressure": 5e4, "velocity": [1.0, 0.5], "distance": 1e-4, "cells_per_step": 1}


def scene(**changes: Any) -> dict[str, Any]:
    free = {"grid": {**GRID, "boundary": "free"}, "surface": SPHERE, "material": ELASTIC, "history": [{"force": 1e-3}]}
    return {**free, **changes}


@pytest.mark.parametrize("stage", [{"force": 1e-3}, {"pressure": 1e3}, {"approach": 1e-6}])
@pytest.mark.parametrize("boundary", ["free", "periodic"])
def test_below_the_hardness_nothing_changes(boundary: str, stage: dict[str, float]) -> None:
    """To round-off."""
    data = scene(grid={**GRID, "boundary": boundary}, history=[stage])
    expected, rows = marched(data)
    found, others = marched({**data, "material": {**ELASTIC, "hardness": 1e7}})
    assert_allclose(found.field("pressure"), expected.field("pressure"), rtol=1e-12, atol=1e-7)
    assert others[-1].iterations == rows[-1].iterations
    assert others[-1].operator_calls == rows[-1].operator_calls
    corrected = [each[-1].measures.contact_area_corrected for each in (rows, others)]
    assert corrected[1] == pytest.approx(corrected[0], rel=1e-14)


@pytest.mark.mpi
@pytest.mark.parametrize("pressure", [1e7, 2e8, 9e8])
def test_edges_where_the_pressure_ends_at_the_hardness(comm: Any, pressure: float) -> None:
    """The load is at most hardness times area, and just that of a rigid body, as steel is here: its pressures without
    yielding are ten times the hardness. Elastic edges are at most 0.05 % of the area, by meshes of 256 and 512
    points; 1 % is for the 92 cells of contact. The gaps that are open have a mean above 0, up to full contact."""
    steel = {"model": "elastic", "shear_modulus": 8e10, "poisson": 0.3, "hardness": 1e9}
    rough = {**ROUGH, "long_wavelength": 2.5e-4, "short_wavelength": 3.2e-5, "seed": 3}
    job = scene(grid={"points": 96, "size": 1e-3}, surface=rough, material=steel, history=[{"pressure": pressure}])
    march, rows = marched(job, comm=comm)
    measures, least = rows[-1].measures, pressure / 1e9
    assert least <= measures.contact_area_corrected < 1.01 * least
    assert measures.contact_area_corrected < measures.contact_area
    opened = comm.allreduce(float(np.maximum(march.field("gap"), 0.0).sum())) / 96**2
    assert measures.mean_gap == pytest.approx(opened, rel=1e-3, abs=1e-4 * 1.5e-6)  # residual of solves; rms height


@pytest.mark.parametrize(("hardness", "share"), [(0.7e5, 0.53), (1.9e5, 0.5), (1.9e5, 0.2), (3e5, 0.3)])
def test_edges_along_points_that_have_yielded(hardness: float, share: float) -> None:
    """The pressure falls to 0 over about a cell there, and the corrected area is the one of a grid four times as fine
    to 2 %, and to its stated error. The finer grid has an error a quarter as large."""
    rough = {**ROUGH, "hurst": 0.9, "long_wavelength": 3.3e-4, "short_wavelength": 8.4e-5, "seed": 192622}
    body = {**ELASTIC, "hardness": hardness}

    def area(points: int) -> tuple[float, float]:
        grid = {"points": points, "size": 1e-3}
        _, rows = marched(scene(grid=grid, surface=rough, material=body, history=[{"pressure": share * hardness}]))
        assert rows[-1].errors is not None
        return rows[-1].measures.contact_area_corrected, rows[-1].errors.area.total

    (coarse, stated), (fine, _) = area(64), area(256)
    assert coarse == pytest.approx(fine, rel=min(stated, 0.02))


@pytest.mark.mpi
def test_a_slide_of_a_viscoelastic_body(comm: Any) -> None:
    """The hardness is the same pressure whatever the modulus of a step; contact grows and friction falls with it."""
    data = scene(grid=GRID, surface=ROUGH, material=ZENER, history=[PRESS, SLIDE])
    _, rows = marched(data, comm=comm)
    _, yielded = marched({**data, "material": {**ZENER, "hardness": 4e5}}, comm=comm)
    highest = column(yielded, "max_pressure")[1:]
    assert column(rows, "max_pressure").max() > 1e6
    assert_allclose(highest, 4e5, rtol=1e-9)
    assert np.all(column(yielded, "contact_area")[1:] > column(rows, "contact_area")[1:])
    assert yielded[-1].measures.friction < rows[-1].measures.friction
    assert column(yielded, "iterations").sum() <= 1.5 * column(rows, "iterations").sum()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"history": [{"force": 1e-3}]}, "history.0.force leads to a mean pressure of 1000 Pa"),
        ({"history": [{"pressure": {"from": 0.0, "to": 900.0}, "duration": 1.0}]}, "history.0.pressure leads to a"),
        ({"initial": {"state": "steady", "velocity": 1.0, "pressure": 1e2}}, "initial cannot be used with material"),
        ({"steady": {"velocities": [1.0], "pressures": [1e2]}}, "steady cannot be used with material.hardness"),
    ],
)
def test_what_cannot_be(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(pc.JobError, match=said):
        pc.Simulation(scene(material={**ZENER, "hardness": 900.0}, **changes))


def test_a_hardness_above_the_whole_load_on_one_point_is_none() -> None:
    """No pressure can reach it, however high it is: every number is that of the job without. One of 2e18 Pa took
    pressures below its 1e-12th part for none, and the solve stalled."""
    surface = {"shape": "rough", "hurst": 0.8, "long_wavelength": 1e-3, "short_wavelength": 2e-4, "rms_slope": 0.1}
    job = {"grid": {"points": 16, "size": 1e-3}, "surface": surface, "history": [{"pressure": 1e4}]}
    body = {"model": "elastic", "shear_modulus": 1e9}
    found = [marched({**job, "material": {**body, **more}})[1][-1] for more in ({}, {"hardness": 2e18})]
    assert found[0].measures == found[1].measures


def test_steps_are_judged_by_the_whole_edge_of_spots(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their radius is that of all sides between points in contact and others, of yielded points, too; exactly."""
    seen: list[Any] = []

    def estimate(*given: Any) -> Any:
        seen.append(given)
        return budget.estimate(*given)

    monkeypatch.setattr(state, "estimate", estimate)
    job = scene(grid=GRID, surface=ROUGH, material={**ZENER, "hardness": 2e5}, history=[PRESS, SLIDE])
    march, _ = marched(job)
    touches, (run, observed) = march.field("pressure") > 0.0, seen[-1]
    assert march.field("pressure").max() == pytest.approx(2e5)
    sides = sum(np.count_nonzero(touches != np.roll(touches, 1, axis)) for axis in (0, 1))
    area = min(touches.mean(), 1.0 - touches.mean())
    assert radius_of(run, observed) == pytest.approx(8.0 / np.pi * area * touches.size / sides, rel=1e-9)

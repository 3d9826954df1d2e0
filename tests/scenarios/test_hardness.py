"""Jobs with a counterbody that yields."""

from typing import Any

import numpy as np
import pytest
from marching import column, marched
from numpy.testing import assert_allclose

import parcontact as pc

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


def test_where_all_yields_the_load_is_hardness_times_area() -> None:
    """All but the rim of the contact of a sphere: a hardness of a twentieth of Hertz's highest pressure."""
    hardness = 1.5e3
    march, rows = marched(scene(material={**ELASTIC, "hardness": hardness}))
    p, measures = march.field("pressure"), rows[-1].measures
    rim = np.count_nonzero((p > 0.0) & (p < hardness * (1.0 - 1e-12)))
    assert_allclose(measures.max_pressure, hardness, rtol=1e-12)
    assert rim < 0.02 * np.count_nonzero(p)
    assert abs(measures.contact_area * p.size * hardness - p.sum()) <= rim * hardness
    assert march.field("gap")[p > 0.0].min() < -1e-7  # of some 1e-6 m of approach


@pytest.mark.mpi
def test_steel_of_a_round_hardness(comm: Any) -> None:
    """1 GPa under 1 MPa on 100 x 100 points, of which ten yield; what people type. The load is made up of these."""
    steel = {"model": "elastic", "shear_modulus": 8e10, "poisson": 0.3, "hardness": 1e9}
    rough = {**ROUGH, "long_wavelength": 2.5e-4, "short_wavelength": 4e-5, "rms_slope": 0.2, "seed": 0}
    grid = {"points": 100, "size": 1e-3}
    _, rows = marched(scene(grid=grid, surface=rough, material=steel, history=[{"pressure": 1e6}]), comm=comm)
    assert rows[-1].measures.contact_area == 1e-3
    assert_allclose(rows[-1].measures.max_pressure, 1e9, rtol=1e-12)
    assert_allclose(rows[-1].measures.pressure, 1e6, rtol=1e-12)


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
        ({"initial": {"state": "steady", "velocity": 1.0, "pressure": 1e2}}, "initial does not go with material.hard"),
        ({"steady": {"velocities": [1.0], "pressures": [1e2]}}, "steady does not go with material.hardness"),
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

"""Surfaces that detach under a load, and stay apart until they are brought together again (`detached: open`)."""

from typing import Any

import numpy as np
import pytest
from marched_jobs import column, marched
from numpy.testing import assert_allclose
from restarting import ELASTIC, SPHERE, ZENER

from parcontact.effects.effect import columns_of

STICK = {"work": 0.05, "range": 1e-6, "detached": "open"}
OFF = {"name": "off", "force": {"from": 0.0, "to": -5e-3}, "duration": 1e-3, "time_step": 1e-4}


@pytest.mark.parametrize("material", [ELASTIC, ZENER], ids=["elastic", "rubber"])
@pytest.mark.parametrize("boundary", ["periodic", "free"])
@pytest.mark.parametrize("control", ["approach", "force"])
def test_open_after_detachment(control: str, boundary: str, material: dict[str, Any]) -> None:
    """If the job says so, the run goes on with open surfaces. Approached or pressed, they touch again as surfaces that
    never did before, to the solver's tolerance; rubber relaxes in 4e-3 of a step."""
    job = {"grid": {"points": 20, "size": 1e-3, "boundary": boundary}, "surface": SPHERE, "material": material}
    job["adhesion"] = STICK
    start, from_rest, end = {"approach": (-3e-6, -3e-6, 2e-6), "force": (-5e-3, 0.0, 1e-2)}[control]
    again = {control: {"from": start, "to": end}, "duration": 1.0, "time_step": 0.25}
    _, found = marched({**job, "history": [OFF, again]})
    _, fresh = marched({**job, "history": [{**again, control: {"from": from_rest, "to": end}}]})
    apart, now, never_apart = (row.measures for row in (found[10], found[-1], fresh[-1]))
    assert apart.pressure == apart.contact_area == 0.0
    assert now.contact_area == never_apart.contact_area > 0.0
    assert_allclose([now.pressure, now.approach], [never_apart.pressure, never_apart.approach], rtol=5e-3)
    assert sum(row.operator_calls for row in found[-4:]) < 200
    assert ["the surfaces detach" in row.remark for row in found].count(True) == 1  # once, when they detach


@pytest.mark.parametrize("count", [1, 4])
@pytest.mark.parametrize("material", [ELASTIC, ZENER], ids=["elastic", "rubber"])
def test_open_surfaces_add_neither_work_nor_losses(material: dict[str, Any], count: int) -> None:
    """A body that was pressed has pushed the surface back before it detaches, also in one step: little but what the
    body dissipates is lost then. Open rubber dissipates what it stores, in steps of any length."""
    job = {"grid": {"points": 20, "size": 1e-3, "boundary": "free"}, "surface": SPHERE, "material": material}
    press = {"force": {"from": 0.0, "to": 5e-2}, "duration": 1.0, "time_step": 0.25}
    pull = {"force": {"from": 5e-2, "to": -5e-3}, "duration": 1.0, "time_step": 1.0 / count}
    wait = {"force": {"from": -5e-3, "to": -9e-3}, "duration": 1.0, "time_step": 0.5}
    _, found = marched({**job, "adhesion": STICK, "history": [press, pull, wait], "output": {"energy": True}})
    lost, top = [row.added[3] for row in found], len(found) - 3 - count
    assert found[top].measures.pressure == max(column(found, "pressure")) > 0.0
    assert found[-3].measures.contact_area == 0.0
    assert lost[-3] == lost[top]
    assert found[-3].work < found[top].work
    assert len(set(lost[-3:])) == len({row.work for row in found[-3:]}) == 1
    inside = [row.stored + row.dissipated for row in found[-3:]]
    assert_allclose(inside, inside[0], rtol=1e-12)


@pytest.mark.parametrize("interface", [{}, {"interface": {"shear_stress": 1e4}}], ids=["bulk", "interface"])
@pytest.mark.parametrize("force", [0.0, -1e-4])
def test_work_of_a_slide_under_no_load(force: float, interface: dict[str, Any]) -> None:
    """On a mesh far too coarse an elastic contact snaps from node to node, and loses all work of the force along the
    sliding but that of the interface; also under tension. Ten steps a cell leave 1 % to the trapezoidal rule."""
    cell, cells = 5e-5, 4
    job = {"grid": {"points": 24, "size": 24 * cell}, "surface": SPHERE | {"radius": 2e-3}, **interface}
    load = {"force": {"from": 0.0, "to": force}, "duration": 1.0, "time_step": 0.25}
    slide = {"force": force, "velocity": 1e-3, "distance": 2 * cells * cell, "cells_per_step": 0.1}
    job |= {"material": ELASTIC | {"shear_modulus": 3e5}, "adhesion": {"work": 0.05, "range": 6e-7}}
    job |= {"output": {"energy": True}}
    march, found = marched({**job, "history": [{"force": 0.0, "duration": 1.0}, load, slide]})
    lost = columns_of(march.scene.effects).index("snap_loss")
    rows = found[-10 * cells - 1 :]
    distance, force_x = np.array([row.distance for row in rows]), column(rows, "force_x")
    own = interface["interface"]["shear_stress"] * (24 * cell) ** 2 if interface else 0.0
    dragged = -np.trapezoid(force_x + own * column(rows, "contact_area_corrected"), distance)
    assert (column(rows, "friction") == 0.0).all()
    assert_allclose([rows[-1].work - rows[0].work, rows[-1].added[lost] - rows[0].added[lost]], dragged, rtol=1e-2)


@pytest.mark.parametrize("count", [4, 16])
@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_a_cycle_under_a_load_loses_what_the_touch_sets_free(boundary: str, count: int) -> None:
    """An elastic body in a cycle of loads loses in all what it does in the snap into contact under no load, as the work
    of coming off is the least that this takes. So it does in steps of any length, and again in the next cycle; open
    surfaces add nothing, and are no snaps. The trapezoidal rule leaves some 1e-3."""
    job = {"grid": {"points": 20, "size": 1e-3, "boundary": boundary}, "surface": SPHERE, "material": ELASTIC}
    pull = {"force": {"from": 0.0, "to": -5e-3}, "duration": 1.0, "time_step": 1.0 / count}
    wait = {"force": {"from": -5e-3, "to": -9e-3}, "duration": 1.0, "time_step": 0.5}
    cycle = [{"force": 0.0, "duration": 1.0}, pull, wait]
    march, found = marched({**job, "adhesion": STICK, "history": [*cycle, *cycle], "output": {"energy": True}})
    touching, lost = column(found, "contact_area") > 0.0, np.array([row.added[3] for row in found])
    ends = np.flatnonzero(touching[:-1] & ~touching[1:]) + 1
    assert len(ends) == 2
    assert_allclose(lost[ends], lost[ends[0]] * np.array([1.0, 2.0]), rtol=1e-3)
    assert_allclose(lost[ends[0]], lost[1], rtol=1e-3)
    assert_allclose([found[end].work for end in ends], lost[ends], rtol=1e-4)
    assert len(set(lost[ends[0] : ends[0] + 3])) == len(set(lost[ends[1] :])) == 1
    assert march.state.memories["adhesion"].snaps == 4

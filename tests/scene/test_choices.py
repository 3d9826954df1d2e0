"""What an effect costs when it is off: nothing. A test for each row of the table that `parcontact plan` prints.

Programs are compared by all their counts: operator calls, transforms by size and precision, sums over ranks, bytes sent
and held. A solve that is given up after a fixed number of iterations makes them the same for all loads and bodies.
"""

import math

import pytest
from counting import (
    ELASTIC,
    ITERATIONS,
    MAP,
    NX,
    NY,
    PART,
    PRESS,
    RUBBER,
    SLIDE,
    SPHERE,
    STAND,
    TRANSFORM,
    WAVES,
    Json,
    extra,
    job,
    row,
    whole,
)
from marching import begun, marched

from parcontact import scene
from parcontact.history.timeline import Timeline
from parcontact.march.dry_law import DryLaw
from parcontact.solve import contact as contact_solver
from parcontact.solve.constraint import NonNegative
from parcontact.solve.problem import Approach, Problem


@pytest.fixture
def iterations_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """How often the load is restored near by, which takes a message, and a step is made exact, which takes an operator
    call, depends on the pressures."""
    monkeypatch.setattr(contact_solver, "LEAST_CUT", math.inf)
    monkeypatch.setattr(contact_solver, "MAX_STEP_RATIO", math.inf)


def test_every_row_has_a_test() -> None:
    """By name, in ROWS or TESTED."""
    assert {effect.name for effect in scene.choices(job()).decisions} == {*ROWS, *TESTED}


FROZEN = {**RUBBER, "branches": [*RUBBER["branches"], {"modulus": 1e5, "relaxation_time": 1e6}]}
ROWS: dict[str, tuple[Json, Json, dict[str, int] | None]] = {  # off, on, and what that counts more
    "viscoelasticity": (
        {"history": [PRESS]},
        {"history": [PRESS], "material": RUBBER},
        {
            "map bytes": 4 * MAP,
            "allreduce": 10,
        },  # branch, displacement, two increments; at each of 5 steps the embedded pair and both views of friction
    ),
    "layer": ({"history": [PRESS]}, {"history": [PRESS], "body": {"thickness": 1e-2}}, {}),
    "folded branches": (
        {"history": [PRESS], "material": FROZEN, "numerics": {"branch_error": 0.0}},
        {"history": [PRESS], "material": FROZEN},
        {"map bytes": -MAP},
    ),
    "sliding": (
        {"history": [PRESS]},
        {"history": [SLIDE]},
        {"map bytes": MAP},  # the moved heights of an elastic body
    ),
    "sub-cell or oblique sliding": (
        {"material": RUBBER, "history": [{**SLIDE, "distance": 2e-3 / NX}]},
        {"material": RUBBER, "history": [{**PART, "distance": 1e-3 / NX}]},  # as many steps
        {"fft": 2, TRANSFORM: 2, "shift": 2},
    ),
    "energies": (
        {"history": [PRESS]},
        {"history": [PRESS], "output": {"energy": True}},
        {"allreduce": 5},  # one in each step
    ),
    "energy memory": (
        {"history": [PRESS], "material": RUBBER, "numerics": {"kernel": "love"}},
        {"history": [PRESS], "material": RUBBER, "numerics": {"kernel": "love"}, "output": {"energy": True}},
        {"allreduce": 5, "map bytes": 4 * MAP},
    ),
    "preconditioner in single precision": ({}, {"numerics": {"precision": "mixed"}}, None),
    "operator in single precision": (
        {"numerics": {"precision": "mixed", "tolerance": 0.99e-3}},
        {"numerics": {"precision": "mixed", "tolerance": 1e-3}},
        None,
    ),
    "surface spectrum": (
        {"surface": SPHERE},
        {},
        {"fft": 3, TRANSFORM: 3, "map bytes": WAVES, "allreduce": 2},  # heights twice, forces once; mean, moments
    ),
}


@pytest.mark.usefixtures("iterations_alike")
@pytest.mark.parametrize("name", ROWS)
def test_rows(name: str) -> None:
    """Off, it is not there; on, it counts what it is made of, and nothing else changes."""
    off, on, more = ROWS[name]
    assert not row(job(**off), name).on
    assert row(job(**on), name).on
    assert more is None or extra(job(**on), job(**off)) == more


def test_energy_of_a_body_with_memory() -> None:
    """One operator application and one reduction per step, no map: the inverse is at hand."""
    planned = {"history": [PRESS], "material": RUBBER}
    more = {"operator": 5, "fft": 10, TRANSFORM: 10, "allreduce": 5}
    assert extra(job(**planned, output={"energy": True}), job(**planned)) == more
    assert not row(job(**planned, output={"energy": True}), "energy memory").on


def test_mixed_precision() -> None:
    """Off: no transform in single precision."""
    off, on, _ = ROWS["preconditioner in single precision"]
    assert [name for name in whole(job(**off)) if name.startswith("fft ")] == [TRANSFORM]
    assert whole(job(**on))[f"fft {NX}x{NY} float32"] == 2 * ITERATIONS


@pytest.mark.parametrize(
    ("changes", "on"),
    [
        ({"tolerance": 1e-5}, True),
        ({"tolerance": 0.99e-5}, False),
        ({"tolerance": 1e-5, "energy": True}, False),
        ({"tolerance": 1e-5, "energy": True, "kernel": "love"}, True),
    ],
)
def test_preconditioner_of_loose_solves(changes: Json, on: bool) -> None:
    """In single precision beside double, unless energies take it for the inverse of the operator."""
    numerics = {key: value for key, value in changes.items() if key != "energy"}
    planned = job(history=[PRESS], material=RUBBER, numerics=numerics, output={"energy": "energy" in changes})
    assert row(planned, "preconditioner in single precision").on == on


def test_single_operator(monkeypatch: pytest.MonkeyPatch) -> None:
    """On, only the surface and the forces are transformed in double precision, as often as with other tolerances; these
    solves, which are all given up, would be tried again with an operator in double precision."""
    monkeypatch.setattr(DryLaw, "_retry", lambda law, step, past, problem, failed: (failed, ""))
    off, on, _ = ROWS["operator in single precision"]
    double, single = whole(job(**off)), whole(job(**on))
    assert double["fft"] == single["fft"]
    assert single[f"fft {NX}x{NY} float32"] == 2 * single["operator"]
    assert double[f"fft {NX}x{NY} float32"] == 2 * ITERATIONS


@pytest.mark.parametrize(
    ("changes", "on"),
    [({"precision": "mixed"}, True), ({"precision": "double"}, False), ({"precision": "mixed", "energy": True}, False)],
)
def test_operator_of_very_loose_solves(changes: Json, on: bool) -> None:
    """In single precision only where that is asked for, and no energies are balanced."""
    numerics = {"tolerance": 1e-3, "precision": changes["precision"]}
    planned = job(history=[PRESS], material=RUBBER, numerics=numerics, output={"energy": "energy" in changes})
    assert row(planned, "operator in single precision").on == on


def test_isolated_contact() -> None:
    """Off: no padded transform; on: one for every operator call but the preconditioner's."""
    off, on = job(surface=SPHERE), job(surface=SPHERE, grid={"boundary": "free"})
    assert [name for name in whole(off) if name.startswith("fft ")] == [TRANSFORM]
    assert whole(on)[f"fft {2 * NX}x{2 * NY} float64"] == 1 + 2 * (1 + ITERATIONS)  # of the coefficients
    assert not row(off, "isolated contact").on
    assert row(on, "isolated contact").on


def test_extrapolated_starts() -> None:
    """Off: no earlier pressure is kept; the same solves otherwise."""
    single, lasts = job(history=[STAND, {"pressure": 4e3}]), job(history=[STAND, {**PRESS, "time_step": 1e-3}])
    assert len(begun(single).state.contact.pressures) == 1
    assert extra(lasts, single) == {"map bytes": MAP}
    assert [row(planned, "extrapolated starts").on for planned in (single, lasts)] == [False, True]


def test_starts_from_whole_cells_ago() -> None:
    """Off: the pressure before the last is the only earlier one. On: two more, where steps are chosen in a slide."""
    chosen = {key: value for key, value in SLIDE.items() if key != "cells_per_step"}
    off, on = (job(history=[stage], material=RUBBER) for stage in (SLIDE, chosen))
    elastic = job(history=[chosen], material=ELASTIC)
    assert [row(planned, "starts from a whole cell earlier").on for planned in (off, on, elastic)] == [
        False,
        True,
        False,
    ]
    assert [len(begun(planned).state.contact.pressures) for planned in (off, on, elastic)] == [2, 4, 2]


def test_rest_cut_short() -> None:
    """Off: every step of the history is made; on: an elastic body at rest needs its jump and one more."""
    dwell = {"pressure": 2e3, "duration": 1e-3}
    off, on = (job(history=[{**dwell, "time_step": step}]) for step in (2.5e-4, {"first": 1e-4, "growth": 1.1}))
    assert [len(marched(planned)[1]) - 1 for planned in (off, on)] == [5, 2]
    assert [row(planned, "rest cut short").on for planned in (off, on)] == [False, True]


def test_chosen_time_steps() -> None:
    """Off: no step is judged and nothing is remembered of them. On: no map more, at rest."""
    chosen = {key: value for key, value in PRESS.items() if key not in ("time_step", "cells_per_step")}
    off, on = (job(history=[stage], material=RUBBER) for stage in (PRESS, chosen))
    elastic = job(history=[chosen], material=ELASTIC)
    assert [row(planned, "chosen time steps").on for planned in (off, on, elastic)] == [False, True, False]
    marches = [marched(planned)[0] for planned in (off, on)]
    assert [march.state.chosen is None for march in marches] == [True, False]
    assert len({march.scene.slab.tally["map bytes"] for march in marches}) == 1


def test_steady_start() -> None:
    """Off: nothing is solved before the first step."""
    start = {"state": "steady", "velocity": 0.1, "pressure": 2e3}
    solved = {"tolerance": 1e-4, "max_iterations": 500}
    off, on = (job(history=[SLIDE], material=RUBBER, numerics=solved, **more) for more in ({}, {"initial": start}))
    assert begun(off).scene.slab.tally["operator"] == 0
    assert begun(on).scene.slab.tally["operator"] > 0
    assert [row(planned, "steady start").on for planned in (off, on)] == [False, True]


def test_adhesion() -> None:
    """Off: no operator of gaps, no map; on: all of the gaps and their solver."""
    off, on = job(history=[PRESS]), job(history=[PRESS], adhesion={"work": 1e-9, "range": 1e-6})
    assert [row(planned, "adhesion").on for planned in (off, on)] == [False, True]
    march = begun(off)
    assert march.scene.law is None
    assert march.state.law is None


def test_yielding_counterbody() -> None:
    """A bound that nothing reaches costs sums over ranks alone, and one above the whole load on a point, here 1.9 MPa,
    costs nothing: see `solve/test_bounded` for one that is reached."""
    off, on = job(history=[PRESS]), job(history=[PRESS], material={**ELASTIC, "hardness": 9e5})
    assert [row(planned, "yielding counterbody").on for planned in (off, on)] == [False, True]
    assert set(extra(on, off)) == {"allreduce"}
    assert not extra(job(history=[PRESS], material={**ELASTIC, "hardness": 2e6}), off)


def test_displacement_control() -> None:
    """A reduction in each step tells whether the approach can be; off, there is none: see `test_elastic_static`."""
    planned = job(history=[{"approach": -5e-7}])
    assert row(planned, "displacement control").on
    assert not row(job(), "displacement control").on
    march = begun(planned)
    march.advance(next(iter(Timeline.from_job(planned))))
    solver, slab = march.scene.solver, march.scene.slab
    spent = slab.tally["allreduce"]
    heights = march.scene.motion.at((0.0, 0.0)).base
    control = Approach(-5e-7 / march.scene.units.height)
    solver.solve(Problem(*march.scene.operators, heights, NonNegative(), control), slab.zeros())
    of_solve = slab.tally["allreduce"] - spent
    of_measures = 2
    before = begun(planned).scene.slab.tally["allreduce"]
    assert spent == before + 1 + of_solve + of_measures


TESTED = {
    *(
        "isolated contact",
        "extrapolated starts",
        "starts from a whole cell earlier",
        "chosen time steps",
        "rest cut short",
        "steady start",
        "displacement control",
        "dissipation per branch",
        "yielding counterbody",
        "adhesion",
    ),
    *("fields", "checkpoints", "interface", "leakage", "thermal"),  # the last ones where they are made
}

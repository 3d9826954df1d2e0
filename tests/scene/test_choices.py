"""What an effect costs when it is off: nothing. A test for each row of the table that `parcontact plan` prints.

Programs are compared by all their counts: operator calls, transforms by size and precision, sums over ranks, bytes sent
and held. A solve that is given up after a fixed number of iterations makes them the same for all loads and bodies.
"""

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
from marched_jobs import begun, marched

from parcontact.contact.problem import Approach, Box, Problem
from parcontact.job.history import Timeline
from parcontact.march import choices


def test_every_row_has_a_test() -> None:
    """By name, in ROWS or TESTED."""
    assert {effect.name for effect in choices.choices(job()).decisions} == {*ROWS, *TESTED}


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
    "body": ({"history": [PRESS]}, {"history": [PRESS], "body": {"thickness": 1e-2}}, {}),
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
    solver.solve(Problem(*march.scene.operators, heights, Box(), control), slab.zeros())
    of_solve = slab.tally["allreduce"] - spent
    of_measures = 2
    before = begun(planned).scene.slab.tally["allreduce"]
    assert spent == before + 1 + of_solve + of_measures


TESTED = {
    *(
        "isolated contact",
        "counterbody",
        "softening",
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

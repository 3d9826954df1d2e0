"""A steady start holds what is planned, and comes before the maps of the march; a start at rest."""

from typing import Any

import pytest
from mpi4py import MPI

from parcontact import Simulation, scene
from parcontact.job import Job
from parcontact.parallel.slab import Slab
from parcontact.plan import memory, report
from parcontact.solve.nonsymmetric import steady
from parcontact.steady_sliding import start
from parcontact.steady_sliding.sliding import SteadySliding

Json = dict[str, Any]
WAVE: Json = {"shape": "wave", "amplitude": 1e-6, "waves": [2, 1]}
SPHERE: Json = {"shape": "sphere", "radius": 1e-2}
SCENES: dict[str, tuple[Json, Json, tuple[float, float]]] = {
    "along x": ({"points": 128}, WAVE, (0.1, 0.0)),
    "long cells": ({"points": [128, 32]}, WAVE, (0.1, 0.0)),
    "oblique": ({"points": [128, 96]}, WAVE, (0.1, 0.05)),
    "free": ({"points": 64, "boundary": "free"}, SPHERE, (0.1, 0.0)),
}


def job(
    grid: Json, surface: Json, velocity: tuple[float, float], branches: int = 2, tolerance: float = 5e-3, **more: Json
) -> Job:
    times = [{"modulus": 1e6, "relaxation_time": 10.0 ** -(k / 4 + 1)} for k in range(branches)]
    return Job.model_validate(
        {
            "grid": {"size": 1e-3, **grid},
            "surface": surface,
            "material": {"model": "zener", "modulus_inf": 1e6, "branches": times},
            "initial": {"state": "steady", "velocity": velocity, "pressure": 1e5},
            "history": [{"pressure": 1e5, "velocity": velocity, "duration": 1e-4, "time_step": 1e-5}],
            "numerics": {"branch_error": 0.0, "tolerance": tolerance},
            **more,
        }
    )


@pytest.mark.mpi
@pytest.mark.parametrize("name", SCENES)
def test_what_is_held_while_it_is_solved(comm: MPI.Intracomm, name: str) -> None:
    """To the byte, by projected steps alone; or more, in a free box, for a moment, as the table of the wake is made."""
    grid, surface, velocity = SCENES[name]
    planned = job(grid, surface, velocity)
    slab = Slab(comm, *planned.grid.points)
    sliding = SteadySliding(scene.set_up(planned, slab))
    assert sliding.solve(velocity, 1e5).sets == 0
    few, most = (memory.steady_start(planned, comm.size, comm.rank, sets) for sets in (False, True))
    held = slab.tally["map bytes at most"]
    assert held == few < most or (name == "free" and few < held)


@pytest.mark.mpi
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(("tolerance", "itemsize"), [(5e-3, 4), (2e-3, 8)])
def test_what_is_held_where_sets_change(
    comm: MPI.Intracomm, monkeypatch: pytest.MonkeyPatch, name: str, tolerance: float, itemsize: int
) -> None:
    """To the byte, without projected steps, and with linear steps that use all their directions: a map more, and two
    for each of seven directions, in single precision where six tenths of the tolerance are 1.5e-3 or more."""
    monkeypatch.setattr(steady, "MAX_STEPS_TO_HALVE", 0)
    monkeypatch.setattr(steady, "REDUCTION", 0.0)
    grid, surface, velocity = SCENES[name]
    planned = job(grid, surface, velocity, tolerance=tolerance)
    slab = Slab(comm, *planned.grid.points)
    assert SteadySliding(scene.set_up(planned, slab)).solve(velocity, 1e5 if name == "free" else 3e3).sets > 0
    few, most = (memory.steady_start(planned, comm.size, comm.rank, sets) for sets in (False, True))
    assert slab.tally["map bytes at most"] == most
    assert most - few == (8 + 2 * 7 * itemsize) * slab.shape[0] * slab.nx


@pytest.mark.mpi
def test_no_more_than_steps_hold(comm: MPI.Intracomm) -> None:
    """With twelve branches: the solver's maps are gone when those of the march are made."""
    planned = job(*SCENES["along x"], branches=12)
    slab = Slab(comm, *planned.grid.points)
    march = start.first(planned, slab)
    assert march.row.measures.friction > 0.0
    assert slab.tally["map bytes at most"] == slab.tally["map bytes"] == memory.total(planned, comm.size, comm.rank)


@pytest.mark.parametrize("name", SCENES)
def test_no_rank_has_more_than_is_planned(name: str) -> None:
    """On three ranks or seven, of which the first have fewer rows than the last."""
    planned = job(*SCENES[name])
    for ranks in (3, 7):
        each = [memory.steady_start(planned, ranks, rank) for rank in range(ranks)]
        waves = 16 * 3 * 3  # bytes of those up to (2, 1), which another rank may have
        assert each[0] < max(each) <= memory.steady_start(planned, ranks) <= max(each) + waves


def test_plan_tells_both() -> None:
    """In rows of their own, where there is a steady start."""
    planned = job(*SCENES["along x"])
    rows = {text[2:26].rstrip(): text[26:].split() for text in report.maps(planned, [1, 2])}
    for what, sets in (("steady start, before", False), ("steady start, with sets", True)):
        assert rows[what] == [f"{memory.steady_start(planned, ranks, sets=sets) / 1e6:.4g}" for ranks in (1, 2)]
    virgin = planned.model_copy(update={"initial": type(planned.initial)()})
    assert not any("steady" in text for text in report.maps(virgin, [1]))
    assert memory.steady_start(virgin) == 0


def test_at_rest_the_body_is_relaxed() -> None:
    """The contact is the elastic one of the long-term modulus, to the tolerance of both solves, without friction."""
    planned = job({"points": 64}, WAVE, (0.0, 0.0), tolerance=1e-6)
    point = SteadySliding(scene.set_up(planned, Slab.alone(64, 64))).solve((0.0, 0.0), 1e5)
    elastic = Simulation(
        {
            "grid": {"points": 64, "size": 1e-3},
            "surface": WAVE,
            "material": {"model": "elastic", "shear_modulus": 1e6},
            "history": [{"pressure": 1e5}],
            "numerics": {"tolerance": 1e-6},
        },
        comm=MPI.COMM_SELF,
    ).run()
    assert point.friction == 0.0
    assert point.measures.contact_area == elastic.contact_area
    assert point.measures.max_pressure == pytest.approx(elastic.max_pressure, rel=1e-5)


def test_at_rest_nothing_is_warm() -> None:
    """A start at rest makes no heat, so that there is no time in which it warmed the rubber."""
    thermal = {"conductivity": 0.2, "diffusivity": 1e-7}
    planned = job({"points": 16, "boundary": "free"}, SPHERE, (0.0, 0.0), thermal=thermal)
    march = start.first(planned, Slab.alone(16, 16))
    assert march.scene.effects["thermal"].values(march.state.memories["thermal"])[:2] == (0.0, 0.0)
    point = SteadySliding(march.scene.setup).solve((0.0, 0.0), 1e5)
    assert point.flash is not None
    assert (point.flash.mean, point.flash.highest) == (0.0, 0.0)

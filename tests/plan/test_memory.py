"""The memory that a plan tells: to the byte what each rank holds and a checkpoint has."""

import numpy as np
import pytest
from marched_jobs import marched
from mpi4py import MPI

from parcontact.door import memory, plan
from parcontact.door.memory import try_job
from parcontact.march import scene
from parcontact.march.steady import SteadySliding
from parcontact.parallel.slab import Slab
from parcontact.physics.convolution import SIDE, Tiles

from .planned import JOBS, ROUGH, TWO, Json, job


@pytest.mark.mpi(2, 3)
@pytest.mark.parametrize("name", JOBS)
def test_memory(comm: MPI.Intracomm, name: str) -> None:
    """What each rank holds after a run, and what a checkpoint has in maps, to the byte."""
    planned = job(**JOBS[name])
    march, _ = marched(planned, comm=comm)
    slab = march.scene.slab
    assert memory.total_bytes(planned, comm.size, comm.rank) == slab.tally["map bytes"]
    maps = [np.asarray(entry.value) for entry in march.entries().values() if entry.is_map]
    saved = sum(rows.nbytes + 4 * len(rows) for rows in maps)
    assert sum(slab.from_all(saved)) == memory.saved(planned)


def test_the_most_that_is_held() -> None:
    """The first solve of 256 x 256 points is found on nested grids, whose maps are gone afterwards."""
    planned = job(grid={"points": 256}, surface={**ROUGH, "short_wavelength": 6.25e-5})
    march, _ = marched(planned)
    tally = march.scene.slab.tally
    assert tally["map bytes at most"] > 1.1 * tally["map bytes"]
    assert memory.most_bytes(planned, 1) >= tally["map bytes at most"]


def test_steady_states_hold_what_is_planned() -> None:
    """All maps that a solve may need, some of which a short one does not make."""
    planned = job(material=TWO, history=[], steady={"velocities": [0.1], "pressures": [1e4]})
    slab = Slab.alone(*planned.grid.points)
    SteadySliding(scene.set_up(planned, slab)).solve((0.1, 0.0), 1e4)
    held = slab.tally["map bytes at most"]
    assert 0.8 * memory.steady_bytes(planned) < held <= memory.steady_bytes(planned)


def test_too_large_for_this_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where there is no memory for any grid, nothing is tried."""
    monkeypatch.setattr(memory, "free_bytes", lambda: 1000)
    assert try_job(job(), Slab.alone(48, 40), 10.0) is None


@pytest.mark.parametrize("points", [(512, 512), (96, 2048)])
def test_solvers_on_tiles_hold_what_is_planned(points: tuple[int, int], monkeypatch: pytest.MonkeyPatch) -> None:
    """To the byte, of three tiles, which are made the most; with two stacked maps."""
    monkeypatch.setattr(memory, "LARGEST_SHARE", 3.5 * SIDE**2 / (points[0] * points[1]))
    grid = {"points": points, "size": [n * 1e-6 for n in points], "boundary": "free"}
    planned = job(grid=grid, surface={"shape": "sphere", "radius": 1e-2})
    setup = scene.set_up(planned, Slab.alone(*points))
    on_tiles, tally = scene.solver_on_tiles(setup), setup.slab.tally
    assert on_tiles is not None
    before = tally["map bytes"]
    made = on_tiles(Tiles(points, np.array([0, 1, 2]), np.array([0, 1, 1])), 2.5e-3)
    assert tally["map bytes"] - before + 2 * 3 * 8 * SIDE**2 == memory.on_tiles(planned)
    del made
    assert any("tiles" in line for line in plan.maps(planned, [1, 64], 0))


@pytest.mark.parametrize(
    "changes",
    [
        {"grid": {"points": 256, "boundary": "free"}},
        {"grid": {"points": 512, "boundary": "free"}, "body": {"thickness": 1e-4}},
        {"grid": {"points": 512}},
        {"history": [], "steady": {"velocities": [0.1], "pressures": [1e4]}},
    ],
    ids=["small", "layer", "periodic", "no history"],
)
def test_runs_that_try_no_tiles(changes: Json) -> None:
    planned = job(**{"grid": {"points": 512}, "surface": {"shape": "sphere", "radius": 1e-2}, **changes})
    assert memory.on_tiles(planned) == 0

"""Branches without a map in whole runs: what they save and cost, and that restarts wake them."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from csv_rows import rows
from marching import begun, column, marched
from mpi4py import MPI
from numpy.testing import assert_allclose, assert_array_equal
from restarting import Bench

from parcontact import scene
from parcontact.effects.folded_branches import bands, phases
from parcontact.errors import InputError
from parcontact.history.timeline import Timeline
from parcontact.job import Job
from parcontact.physics.body import ZenerBody
from parcontact.physics.folding import Band, Phase

Json = dict[str, Any]

NX, NY = 24, 10
FAST, MIDDLE, SLOW, FROZEN = 1e-6, 1e-3, 3.0, 1e4  # relaxation times [s]; a step is 0.2 ms, the slide 2.5 ms
SLIDE: Json = {"pressure": 1e5, "velocity": 0.2, "distance": 0.5e-3, "cells_per_step": 1}
SHORT: Json = {"pressure": 1e5, "velocity": 0.2, "duration": 1e-6, "time_step": 5e-7}


def data(*history: Json, times: tuple[float, ...] = (FAST, MIDDLE, SLOW, FROZEN), **changes: Any) -> Json:
    """Two waves that slide on a body with terms of 1 MPa, in partial contact."""
    material = {"modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": tau} for tau in times]}
    return {
        "grid": {"points": [NX, NY], "size": [1e-3, 0.4e-3]},
        "surface": [{"shape": "wave", "amplitude": 4e-6, "waves": waves} for waves in ([2, 0], [1, 1])],
        "material": {"model": "zener", **material},
        "history": list(history) or [SLIDE],
        "numerics": {"tolerance": 1e-9, **changes.pop("numerics", {})},
        **changes,
    }


def sliding(*history: Json, **changes: Any) -> Job:
    return Job.model_validate(data(*history, **changes))


def bands_of(*shapes: Json) -> list[Band]:
    planned = sliding(surface=list(shapes))
    return list(bands(planned.grid, planned.surface))


# -- from a job to its time scales -------------------------------------------------------------------------------------


def test_phases_of_a_job() -> None:
    """Stages with their jumps, steps and velocities; the last one goes on to the first step that reaches the end."""
    press = {"pressure": {"from": 0.0, "to": 1e5}, "duration": 7e-3, "time_step": {"first": 1e-3, "growth": 2.0}}
    raised = {**SLIDE, "pressure": 3e5, "velocity": [0.0, 0.1], "distance": 1e-4, "time_step": 4e-4}
    del raised["cells_per_step"]
    found = list(phases(Timeline.of(sliding(press, SLIDE, {"pressure": 3e5}, raised), until=0.0111)))
    expected = [
        Phase(7e-3, 1e-3, 4e-3, (0.0, 0.0), jump=False),
        Phase(2.5e-3, 2.5e-3 / 12, 2.5e-3 / 12, (0.2, 0.0), jump=False),
        Phase(0.0, 0.0, 0.0, (0.0, 0.0), jump=True),
        Phase(5 / 3 * 1e-3, 1e-3 / 3, 1e-3 / 3, (0.0, 0.1), jump=False),
    ]
    for own, other in zip(found, expected, strict=True):
        assert (own.velocity, own.jump) == (other.velocity, other.jump)
        assert_allclose((own.duration, own.first, own.last), (other.duration, other.first, other.last), rtol=1e-9)


def test_bands_of_surfaces() -> None:
    """Waves have their own; roughness that of its waves; round shapes that of the box and the cells."""
    finest = np.pi / (0.4e-3 / NY)
    rough = {"shape": "rough", "hurst": 0.8, "long_wavelength": 2e-4, "short_wavelength": 1e-4, "rms_slope": 0.1}
    sphere, ridge = {"shape": "sphere", "radius": 1e-2}, {"shape": "cylinder", "radius": 1e-2, "axis": "x"}
    found = bands_of(rough, sphere, ridge, {"shape": "flat"})
    assert found == [
        Band(2 * np.pi / 2e-4, 2 * np.pi / 1e-4, np.pi / (0.4e-3 / NY)),
        Band(2 * np.pi / 1e-3, finest, finest),
        Band(2 * np.pi / 1e-3, finest, finest, (0.0, 1.0)),
    ]
    wave = bands_of({"shape": "wave", "amplitude": 1e-6, "waves": [3, -1]})[0]
    assert wave.low == wave.high == np.hypot(3 * 2 * np.pi / 1e-3, 2 * np.pi / 0.4e-3)


# -- what it saves and costs -------------------------------------------------------------------------------------------


def test_folded_branches_have_no_map_and_friction_is_within_the_bound() -> None:
    """Three of four branches: as many maps less, nothing else more; friction differs, but within the bound."""
    (fewer, new), (whole, old) = (marched(sliding(numerics={"branch_error": allowed})) for allowed in (1e-2, 0.0))
    found = fewer.scene.folded
    assert (found.kept, found.memoryless, found.frozen) == ((1,), (0,), (2, 3))
    tallies = whole.scene.slab.tally, fewer.scene.slab.tally
    assert tallies[0]["map bytes"] - tallies[1]["map bytes"] == 3 * 8 * NX * NY
    friction = column(new, "friction"), column(old, "friction")
    assert 0.2 < fewer.row.measures.contact_area < 0.9
    wrong = np.max(np.abs(friction[0] - friction[1])) / friction[1][-1]
    assert 0.01 * found.bound < wrong < found.bound <= 1e-2


@pytest.mark.parametrize("pressure", [5e3, 3e5])
def test_bound_of_a_frozen_branch_where_contacts_keep_their_tracks(pressure: float) -> None:
    """Five times through a periodic box, of which 6 or 72 % touch: the same tracks yield for longer and longer.

    A wave that passes misses 2/(w tau) < 2 % of the branch at most, one along the tracks 22 %.
    """
    slide = {**SLIDE, "pressure": pressure, "distance": 5e-3}
    numerics = {"branch_error": 0.0, "tolerance": 1e-7}
    marches = [begun(sliding(slide, times=(MIDDLE, 0.1), numerics=numerics)) for _ in range(2)]
    base = marches[1].scene.setup
    marches[1].scene.material = ZenerBody(base.slab, base.prony, "exponential", frozen=[1])
    marches[1].state = replace(marches[1].state, body=marches[1].scene.material.at_rest())
    timeline = list(Timeline.of(base.job))
    friction = [[march.advance(step).measures.friction for step in timeline] for march in marches]
    wrong = np.max(np.abs(np.diff(friction, axis=0))) / friction[0][-1]
    assert 0.05 < wrong / marches[0].scene.folded.frozen_errors[1] < 1.0


def test_nothing_to_fold_costs_nothing() -> None:
    """All counts and all rows are those of a run that must not fold."""
    runs = [marched(sliding(times=(MIDDLE,), numerics={"branch_error": allowed})) for allowed in (1e-3, 0.0)]
    tallies = [march.scene.slab.tally for march, _ in runs]
    assert runs[0][0].scene.folded.folded == 0
    assert tallies[0] == tallies[1]
    for name in ("friction", "contact_area", "max_pressure"):
        assert_array_equal(column(runs[0][1], name), column(runs[1][1], name))


def test_energies_keep_every_branch() -> None:
    found = begun(sliding(output={"energy": True})).scene
    assert found.folded.folded == 0
    assert (
        next(scene.describe_scene(found))
        == "branches: all 4 are followed in time: output.energy counts the energy of every branch"
    )


def test_a_steady_start_freezes_nothing() -> None:
    """The memoryless branch has no map to fill."""
    start = {"state": "steady", "velocity": 0.2, "pressure": 1e5}
    fewer, whole = (
        begun(sliding(initial=start, numerics={"tolerance": 1e-6, "branch_error": allowed})) for allowed in (1e-3, 0.0)
    )
    assert (fewer.scene.folded.memoryless, fewer.scene.folded.frozen) == ((0,), ())
    assert_array_equal(fewer.state.body.branches, whole.state.body.branches[1:])


# -- restarts ----------------------------------------------------------------------------------------------------------


class Place(Bench):
    """Runs of jobs, and what they leave."""

    def go(self, content: Json, name: str = "out", **options: Any) -> None:
        self.run({**content, "checkpoint": {"every": 100}}, self.where / name, **options)

    def friction(self, name: str = "out") -> list[str]:
        return [row["friction"] for row in rows(self.where / name / "measures.csv")]

    def maps(self, step: int, name: str = "out") -> dict[str, bytes]:
        """The maps of a checkpoint."""
        parts = ("contact", "material")
        with h5py.File(self.where / name / "checkpoint" / f"step-{step}.h5") as file:
            return {f"{part}/{key}": file[part][key][()].tobytes() for part in parts for key in file[part]}


@pytest.fixture
def place(comm: MPI.Intracomm, shared_path: Path) -> Place:
    return Place(comm, shared_path)


@pytest.mark.mpi(3)
def test_restart_with_folded_branches_is_bit_for_bit(place: Place) -> None:
    """Two pieces are the whole, and no map of a folded branch is in the checkpoint."""
    content = data(numerics={"branch_error": 1e-2})
    place.go(content, "whole")
    place.go(content, until=1e-3)
    place.go(content)
    assert place.friction() == place.friction("whole")
    assert place.maps(13) == place.maps(13, "whole")
    assert [name for name in place.maps(13) if "branch" in name] == ["material/branch 1"]


@pytest.mark.mpi(3)
def test_a_longer_run_wakes_frozen_branches(place: Place) -> None:
    """In twice the time the slow branch is G u no more. Its map is made, and friction is that of a run that always had
    it: within the error allowed, and not the same."""
    content = data(numerics={"branch_error": 1.5e-3})
    place.go(content)
    before = place.maps(13)
    place.go(content, until=5e-3)
    place.go(content, "whole", until=5e-3)
    assert "material/branch 2" not in before
    assert "material/branch 2" in place.maps(25)
    found, expected = (np.array([float(text) for text in place.friction(name)]) for name in ("out", "whole"))
    assert 0.0 < np.max(np.abs(found - expected)) / expected[-1] < 1.5e-3


def test_a_body_that_had_no_time_wakes_when_it_gets_some(place: Place) -> None:
    """After one solve without any branch map, a stage that lasts: it goes on as a run that always had them.

    To 1e-9, the tolerance: h = G u is what the jump leaves.
    """
    touch, hold = {"pressure": 1e5}, {"pressure": 1e5, "duration": 1e-3, "time_step": 1e-4}
    place.go(data(touch))
    before = place.maps(1)
    place.go(data(touch, hold))
    place.go(data(touch, hold), "whole")
    assert not [name for name in before if "branch" in name]
    assert [name for name in place.maps(11) if "branch" in name] == ["material/branch 1"]
    found, expected = (np.frombuffer(place.maps(11, name)["material/displacement"]) for name in ("out", "whole"))
    assert_allclose(found, expected, atol=1e-9 * np.max(np.abs(expected)))


def test_a_smaller_error_wakes_all_and_a_larger_one_folds(place: Place) -> None:
    """Either way the run goes on; the branch that had no memory starts again with none."""
    place.go(data(numerics={"branch_error": 1e-2}), until=1e-3)
    place.go(data(numerics={"branch_error": 0.0}), until=2e-3)
    assert sum("branch" in name for name in place.maps(11)) == 4
    place.go(data(numerics={"branch_error": 1e-2}))
    place.go(data(numerics={"branch_error": 0.0}), "whole")
    assert sum("branch" in name for name in place.maps(13)) == 1
    found, expected = (np.array([float(text) for text in place.friction(name)]) for name in ("out", "whole"))
    assert 0.0 < np.max(np.abs(found - expected)) / expected[-1] < 1e-2


def test_steps_too_short_for_a_branch_without_memory_are_refused(place: Place) -> None:
    """A stage to come with shorter steps would need what the branch remembered; a fresh start does it."""
    place.go(data(SLIDE))
    with pytest.raises(InputError, match=r"does not have the branch of relaxation time 1e-06 s, .*never"):
        place.go(data(SLIDE, SHORT))
    place.go(data(SLIDE, SHORT), restart="never", until=2e-4)


def test_the_log_says_what_is_folded(tmp_path: Path) -> None:
    Place(MPI.COMM_SELF, tmp_path).go(data(numerics={"branch_error": 1e-2}), until=2e-4)
    log = (tmp_path / "out" / "run.log").read_text()
    bound = scene.choices(sliding(numerics={"branch_error": 1e-2})).folded.bound
    assert "branches: 1 of 4 are followed in time; those of 1e-06 s are too fast to remember; those of 3, 10" in log
    assert f"of the modulus: at most {100 * bound:.2g} % (numerics.branch_error allows 1 %)" in log

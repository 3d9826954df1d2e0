"""Branches without a map in whole runs: what they save and cost, and that restarts wake them."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from closed_forms import step_responses
from csv_rows import rows
from marched_jobs import begun, column, marched
from mpi4py import MPI
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from restarting import Bench
from rubbers import complex_modulus

from parcontact.effects.branches import (
    FoldedBranches,
    TimeScales,
    fold_branches,
    frozen_errors,
    memoryless_errors,
    time_scales,
)
from parcontact.errors import InputError
from parcontact.job import Job
from parcontact.job.history import Timeline
from parcontact.march import scene
from parcontact.parallel.slab import Slab
from parcontact.physics.body import MovedHeights, ZenerBody
from parcontact.physics.prony import Prony, normal_form

Json = dict[str, Any]
Array = NDArray[np.float64]

POINT = Slab.alone(1, 1)
DECADES = normal_form(1e6, np.full(11, 1e6), 10.0 ** np.arange(-5, 6))  # around a wave of 1 rad/s
TYRE_MODULI = np.array([300, 350, 220, 80, 24, 7, 2.4, 1, 0.5, 0.3, 0.2, 0.15]) * 1e6  # materials/synthetic_tyre.yaml
TYRE = normal_form(1e6, TYRE_MODULI, 5e-9 * 10.0 ** np.arange(12))
BOTH: tuple[tuple[Any, tuple[str, ...]], ...] = ((memoryless_errors, ("exponential",)), (frozen_errors, ()))

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


def scales_of(*history: Json, **changes: Any) -> TimeScales:
    job = sliding(*history, **changes)
    return time_scales(Timeline.from_job(job), job.initial.state == "steady")


# -- bounds against closed forms and against all branches --------------------------------------------------------------


def frozen(prony: Prony, found: FoldedBranches) -> Prony:
    """The material with its frozen branches as springs."""
    others = [k for k in range(prony.moduli.size) if k not in found.frozen]
    spring = prony.modulus_inf + float(prony.moduli[list(found.frozen)].sum())
    return Prony(spring, prony.moduli[others], prony.relaxation_times[others])


@pytest.mark.parametrize("duration", [0.3, 3.0, 30.0])
@pytest.mark.parametrize("rest", [0.0, 2.0])
def test_friction_of_a_wave_with_frozen_branches(rest: float, duration: float) -> None:
    """Full contact of one wave that slides after a rest: the closed form, with and without the frozen branches.

    The error of friction at any instant over the steady friction is within the bound, and more than a hundredth of it:
    the bound is of the right size although it is also one for partial contact.
    """
    found = fold_branches(DECADES, TimeScales(rest + duration, 1e-9, 2 if rest else 1), "exponential", 0.2)
    t = np.linspace(0.0, duration, 400)
    whole, fewer = (
        step_responses.load_rest_slide_modulus(t, rest, 1.0, *body).imag for body in (DECADES, frozen(DECADES, found))
    )
    wrong = np.max(np.abs(fewer - whole)) / complex_modulus(1.0, *DECADES).imag
    assert len(found.frozen) >= 2
    assert not found.memoryless
    assert 0.01 * found.bound < wrong < found.bound


def stresses(moments: list[tuple[float, float]], without: tuple[int, ...] = ()) -> Array:
    """The pressure of a point whose displacement is prescribed, a (dt, u) per step, over the modulus of the step."""
    body = ZenerBody(POINT, DECADES, "exponential", memoryless=without)
    memory, found = body.at_rest(), []
    for dt, u in moments:
        trial = body.begin(memory, dt, MovedHeights(np.full((1, 1), u)))
        displacement = trial.effective.copy()
        memory = body.commit(memory, trial, displacement, np.empty((1, 1)))
        found.append(float(displacement[0, 0]) * trial.alpha)
    return np.array(found)


@pytest.mark.parametrize("dt", [0.03, 0.3, 3.0])
def test_stress_of_a_wave_without_the_memory_of_a_branch(dt: float) -> None:
    """A wave of frequency 1 rad/s that passes after a jump, for every branch whose bound is below 1.

    A wave of size 1 is wrong by |dM|, and the bound at least |dM|/G'' + |dM|/|G*|. 1e-14: rounding, where exp(-z) is
    less.
    """
    moments = [(0.0 if n == 0 else dt, float(np.cos(n * dt))) for n in range(40)]
    errors = memoryless_errors(DECADES, TimeScales(40.0 * dt, dt), "exponential")
    modulus = complex_modulus(1.0, *DECADES)
    whole = stresses(moments)
    for k in np.flatnonzero(errors < 1.0).tolist():
        wrong = np.max(np.abs(stresses(moments, (k,)) - whole)) * (1.0 / modulus.imag + 1.0 / abs(modulus))
        assert wrong < errors[k] + 1e-14


# -- what is chosen ----------------------------------------------------------------------------------------------------

FAST_SLIDE = TimeScales(5e-4 / 3, 1e-3 / 512 / 3)  # half a millimetre at 3 m/s, one cell of 2 um per step


def test_tyre_at_three_metres_per_second() -> None:
    """Five of twelve decades of relaxation times play."""
    found = fold_branches(TYRE, FAST_SLIDE, "exponential", 1e-3)
    assert (found.memoryless, found.kept, found.frozen) == ((0, 1), (2, 3, 4, 5, 6), (7, 8, 9, 10, 11))
    fast, slow = (errors(TYRE, FAST_SLIDE, *more) for errors, more in BOTH)
    assert_allclose(found.bound, fast[:2].sum() + slow[7:].sum(), rtol=1e-12)


def test_what_keeps_every_branch() -> None:
    """A reason; for memoryless ones a jump, or steps of backward Euler, which forgets too slowly; for frozen ones a
    steady start, as a branch slower than everything has relaxed there."""
    assert fold_branches(TYRE, FAST_SLIDE, "exponential", 0.5, "why").kept == tuple(range(12))
    assert fold_branches(TYRE, FAST_SLIDE._replace(jumps=True), "exponential", 1e-3).memoryless == ()
    assert fold_branches(TYRE, FAST_SLIDE, "backward-euler", 0.9).memoryless == ()
    assert fold_branches(TYRE, FAST_SLIDE._replace(steady=True), "exponential", 1e-3).frozen == ()


@pytest.mark.parametrize("count", [1, 3])
def test_a_body_that_has_no_time_is_elastic(count: int) -> None:
    instants = time_scales(Timeline.from_job(sliding(*[{"pressure": 1e5 * n} for n in range(1, count + 1)])), False)
    found = fold_branches(TYRE, instants, "exponential", 1e-3)
    assert (found.frozen, found.bound) == (tuple(range(12)), 0.0)


def test_a_longer_job_has_the_same_memoryless_branches() -> None:
    """So that --until never asks for what a memoryless branch remembered."""
    chosen = [fold_branches(TYRE, TimeScales(t, 1e-6), "exponential", 1e-3) for t in (1e-4, 1e-2, 1.0, 100.0)]
    assert {found.memoryless for found in chosen} == {(0, 1)}
    assert sorted((len(found.frozen) for found in chosen), reverse=True) == [len(found.frozen) for found in chosen]


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
    marches[1].state = marches[1].state.after(material=marches[1].scene.material.at_rest())
    timeline = list(Timeline.from_job(base.job))
    friction = [[march.advance(step).measures.friction for step in timeline] for march in marches]
    wrong = np.max(np.abs(np.diff(friction, axis=0))) / friction[0][-1]
    assert 0.01 < wrong / frozen_errors(base.prony, scales_of(slide))[1] < 1.0


def test_energies_keep_every_branch() -> None:
    found = begun(sliding(output={"energy": True})).scene
    assert found.folded.folded == 0
    assert (
        next(scene.describe_scene(found))
        == "branches: all 4 are followed in time: output.energy counts the energy of every branch"
    )


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

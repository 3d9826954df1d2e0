"""Steps that fail: tried again to the same digits on any restart, or given up with a good checkpoint and advice."""

import cProfile
import itertools
import pstats
import re
import time
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from marched_jobs import begun, column, example, marched
from mpi4py import MPI
from numpy.typing import NDArray
from restarting import ELASTIC, PRESS, ROUGH, SLIDE, SPHERE, ZENER, Bench, cut, maps, rows, same

from parcontact.contact import starts
from parcontact.contact.problem import Contact
from parcontact.contact.solver import ContactSolver
from parcontact.effects.adhesion.adhesive_law import AdhesiveLaw
from parcontact.effects.adhesion.effect import AdhesionColumns, AdhesionMemory
from parcontact.effects.effect import Changes, Instant
from parcontact.errors import InputError, RunError
from parcontact.job import Job
from parcontact.job.history import RAMP_STEPS, MadeStep, Step, Timeline
from parcontact.march.controller import RELAXING, SNAP_SHARE, cells_per_step
from parcontact.march.laws import StepError
from parcontact.march.loop import March, run_steps
from parcontact.physics.body import Trial

GRID: dict[str, Any] = {"points": [64, 64], "size": [1e-3, 1e-3]}


# -- tried again ------------------------------------------------------------------------------------------------------


@pytest.fixture
def moody(monkeypatch: pytest.MonkeyPatch) -> None:
    """Solves that fail once or not at all: this is a matter of the contact, and so is the same when repeated."""
    solve, refused = ContactSolver.solve, [False]

    def refuse(solver: ContactSolver, problem: Any, start: Any, *more: Any, **named: Any) -> Contact:
        contact = solve(solver, problem, start, *more, **named)
        if solver.slab.nx < GRID["points"][0]:
            return contact
        refused[0] = not refused[0] and solver.slab.sum(float(np.count_nonzero(contact.p)))[0] % 2 > 0
        return replace(contact, failure="is refused") if refused[0] else contact

    monkeypatch.setattr(ContactSolver, "solve", refuse)


@pytest.mark.mpi(2, 3)
@pytest.mark.usefixtures("moody")
@pytest.mark.parametrize("name", ["viscoelastic", "free"])
def test_retried_steps_restart_bit_for_bit(bench: Bench, name: str) -> None:
    """Nested starts follow from the state before the step, whatever the process has done before."""
    data = bench.job(name, grid=GRID, history=[{**PRESS, "pressure": 1e4}, {**SLIDE, "cells_per_step": 4}])
    whole = bench.where / "whole"
    assert bench.run(data, whole) == 0
    total = len(rows(whole)) - 1
    for step in (1, total // 2, total - 1) if bench.comm.size == 1 else (total // 2,):
        part = cut(bench, whole, step)
        assert bench.run(data, part) == 0
        if bench.comm.rank == 0:
            same(whole, part, total)
    log = bench.comm.bcast((bench.where / "whole" / "run.log").read_text() if bench.comm.rank == 0 else "")
    retried = re.findall(r"step \d+ at .*: the contact solve is refused; solved when retried with (.*)", log)
    assert retried
    assert all("nested grids" in text for text in retried)
    assert f", retry {len(retried)}" in log


@pytest.mark.parametrize("stretch", [1e-4, 1e4])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_stalls_at_first_is_solved(tmp_path: Path, seed: int, stretch: float) -> None:
    """White noise on a box of 10 000 : 1, where projected steps get no better than a gap of a third of the height."""
    np.save(tmp_path / "white.npy", 1e-6 * np.random.default_rng(seed).standard_normal((16, 16)))
    data = {
        "grid": {"points": 16, "size": [1e-3, 1e-3 * stretch]},
        "surface": {"shape": "file", "path": str(tmp_path / "white.npy")},
        "material": ELASTIC,
        "history": [{"approach": -5e-7}],
        "numerics": {"tolerance": 1e-8},
    }
    march, found = marched(data)
    assert found[-1].certificate.worst <= 1e-8
    said = r"stalled: no residual below \d[.]\d+ in .*; solved when retried with .*"
    assert re.search(said, found[-1].remark)
    assert march.scene.slab.tally["retry"] == 1 + found[-1].remark.count(", with ")


# -- given up ---------------------------------------------------------------------------------------------------------


def remembered(march: March) -> dict[str, NDArray[Any]]:
    """What a step must leave alone when it fails."""
    return {name: np.array(entry.value) for name, entry in march.entries().items()}


@pytest.mark.parametrize("material", [ELASTIC, ZENER])
@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_a_failed_step_leaves_no_trace(material: dict[str, Any], boundary: str) -> None:
    """Not even in the pressure before the last: the step can be made again, and ends where it would have ended, to the
    last bit."""
    slide = {"name": "slide", "pressure": 1e5, "velocity": [0.2, 0.1], "duration": 4e-4, "time_step": 1e-4}
    data = {
        "grid": {**GRID, "boundary": boundary},
        "surface": SPHERE if boundary == "free" else ROUGH,
        "material": material,
        "history": [PRESS, slide],
        "numerics": {"tolerance": 1e-9},
        "output": {"energy": True},
    }
    smooth, march = begun(data), begun(data)
    before: dict[str, Any] = {}
    shown: list[NDArray[Any]] = []

    def spoil(now: March) -> None:
        if now.row.step == 7:
            before.update(remembered(now))
            shown[:] = [now.field(name).copy() for name in ("pressure", "displacement", "gap")]
            now.scene.solver.max_iterations = 0

    run_steps(smooth, [])
    with pytest.raises(StepError, match=r"step 8 at t = \S+ s \(stage 'slide'\): the contact solve did not converge"):
        run_steps(march, [spoil])
    after = remembered(march)
    assert before["contact/earlier pressure 1"].any()
    assert before.keys() == after.keys()
    assert all(np.array_equal(before[name], after[name]) for name in before)
    assert march.row.step == 7
    for name, old in zip(("pressure", "displacement", "gap"), shown, strict=True):
        assert np.array_equal(march.field(name), old)
    march.scene.solver.max_iterations = 500
    job = march.scene.job
    run_steps(march, [], islice(Timeline.from_job(job), 7, None))
    for name in ("pressure", "displacement", "gap"):
        assert np.array_equal(march.field(name), smooth.field(name))
    assert march.row.dissipated == smooth.row.dissipated


LIGHT = {**PRESS, "pressure": 2e4}
HEAVY = {"name": "heavy", "pressure": 1e7}
SHARP = {"tolerance": 1e-14}  # a fifth of what rounding allows under the large load, 5.2e-14,
# and five times what it allows under the small one: which it is must not be a matter of the last digits


def failed(bench: Bench, history: list[dict[str, Any]], numerics: dict[str, Any]) -> tuple[dict[str, Any], Path, str]:
    """A free job that fails in its last stage: the job, its directory, and what it says; and a run up to there."""
    data = bench.job("free", grid=GRID, surface=ROUGH, history=history, numerics=numerics)
    data["checkpoint"] = {"minutes": 100}
    out = bench.where / "out"
    with pytest.raises(RunError) as raised:
        bench.run(data, out)
    assert bench.run(data | {"history": history[:-1]}, bench.where / "clean") == 0
    return data, out, str(raised.value)


@pytest.mark.mpi(2)
def test_a_failed_run_leaves_a_checkpoint(bench: Bench) -> None:
    """Of the last good step: what a run to there has; the run goes on from it when the job has been mended."""
    data, out, said = failed(bench, [LIGHT, HEAVY], SHARP)
    last = out / "checkpoint" / "step-5.h5"
    assert "step 6 at t = 0.001 s (stage 'heavy'): the contact solve stalled" in said
    assert "double precision reaches only about " in said
    assert said.endswith(f"try a larger numerics.tolerance; the newest checkpoint is {last}")
    if bench.comm.rank == 0:
        found, clean = maps(last), maps(bench.where / "clean" / "checkpoint" / last.name)
        assert found == clean
        assert rows(out) == rows(bench.where / "clean")
        counts, message = (out / "run.log").read_text().splitlines()[-2:]
        assert f", retry {1 + said.count(', with ')}," in f"{counts},"
        assert message.endswith(said)
    bench.comm.Barrier()
    assert bench.run(data | {"numerics": {"tolerance": 1e-3}}, out) == 0
    if bench.comm.rank == 0:
        assert [row["step"] for row in rows(out)] == [str(step) for step in range(7)]


def test_an_approach_beyond_full_contact_is_refused_before_the_first_step(bench: Bench) -> None:
    """Value and limit are stated, and nothing is written."""
    data, out = bench.job("viscoelastic", history=[PRESS, {"approach": 1e-3}]), bench.where / "out"
    with pytest.raises(InputError, match=r"history\.1: an approach of 0\.001 m is beyond full contact.* at 0 m; "):
        bench.run(data, out)
    if bench.comm.rank == 0:
        assert not out.exists()
    bench.comm.Barrier()


# -- what to change ---------------------------------------------------------------------------------------------------

RUBBER = {"model": "elastic", "shear_modulus": 1e6}


def test_advice_on_long_steps() -> None:
    """It is only given of a step in which the surface has moved."""
    slide = {**SLIDE, "pressure": 1e4, "cells_per_step": 3}
    march = begun({"grid": GRID, "surface": ROUGH, "material": RUBBER, "history": [slide]})
    with pytest.raises(
        StepError,
        match=r"step 2 .*; try numerics\.max_iterations above \d+, or try smaller steps: in this "
        r"step the surface moves by 2\.\d+ cells$",
    ):
        run_steps(march, [lambda now: setattr(now.scene.solver, "max_iterations", now.row.step == 0 and 500)])


# -- steps that choose themselves after a jump of the velocity: short ones at first, which grow to whole --------------

POINTS = 32
CELL = 1e-3 / POINTS
SUDDEN = {
    "grid": {"points": POINTS, "size": 1e-3},
    "surface": {"shape": "wave", "amplitude": 2e-6, "waves": [2, 1]},
    "material": {"model": "zener", "modulus_inf": 1e5, "branches": [{"modulus": 2e6, "relaxation_time": 3e-5}]},
    "initial": {"state": "steady", "velocity": 0.01, "pressure": 1e4},
    "history": [{"pressure": 1e4, "velocity": 1.0, "distance": 6.5 * CELL}],
}


def data(accuracy: float) -> dict[str, Any]:
    return {**SUDDEN, "numerics": {"accuracy": accuracy}}


def test_a_step_that_is_made_anew_leaves_nothing() -> None:
    """The state after it is that of a march to which the shorter step was proposed at once: to the last bit."""
    sudden = Job.model_validate(data(1e-3))
    tried, stated = begun(sudden), begun(sudden)
    made: list[Step] = []
    rejected = 0
    for step in itertools.islice(tried.steps(), 12):
        attempts = [step]

        def decide(error: float, front: float, begins: bool) -> Step | MadeStep:
            verdict = attempts[-1].decide(error)  # type: ignore[misc]  # noqa: B023  # it is called in this turn only
            if not isinstance(verdict, Step):
                return verdict
            attempts.append(verdict)  # noqa: B023
            return verdict._replace(decide=decide)

        tried.advance(step._replace(decide=decide) if step.decide else step)
        made.append(attempts[-1]._replace(decide=None))
        rejected += len(attempts) - 1
    for step in made:
        stated.advance(step)
    assert rejected > 0
    for name, entry in stated.entries().items():
        if not (name.startswith(("steps/", "row/")) or "position" in name):
            np.testing.assert_array_equal(np.asarray(entry.value), np.asarray(tried.entries()[name].value), name)


def test_lengths_of_steps() -> None:
    """Whole cells in powers of two; then every part of one, and four to each factor of two below an eighth."""
    parts = sorted({round(1.0 / cells_per_step(1.0 / most), 9) for most in np.arange(1.0, 40.0, 0.25)})
    assert parts == [1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40]
    assert [cells_per_step(most) for most in (1.0, 1.9, 2.0, 3.9, 4.0)] == [1, 1, 2, 2, 4]
    assert all(cells_per_step(1.0 / most) <= (1.0 + 1e-5) / most for most in np.arange(1.0, 100.0, 0.3))


def test_a_jump_of_velocity_needs_one_stage() -> None:
    """`jobs/velocity_step.yaml` on a coarse grid: the highest friction at 2 % is within 1 % of that at 0.3 %; the first
    steps after the jump are far shorter than a cell."""
    small = ("grid.points=64", "surface.0.short_wavelength=1.25e-4", "history.1.distance=3.0e-5", "output.fields=[]")
    peaks = []
    for accuracy in (0.02, 0.003):
        march, rows = marched(example("velocity_step", *small, f"numerics.accuracy={accuracy}"))
        peaks.append(column(rows[1:], "friction").max())
        jump = march.timeline().spans[1].before
        assert rows[jump + 1].distance - rows[jump].distance < 0.05 * 1e-3 / 64
    assert peaks[0] == pytest.approx(peaks[1], rel=1e-2)


# -- solves of a job that takes them unconverged ----------------------------------------------------------------------

UNCONVERGED_POINTS = 64


def test_what_a_retry_leaves_unconverged_is_not_accepted(monkeypatch: pytest.MonkeyPatch) -> None:
    """A job takes a solve as it ends. Where that is not finite, retries must solve it."""
    solve, made = ContactSolver.solve, list[Contact]()

    def refuse(solver: ContactSolver, *given: Any, **more: Any) -> Contact:
        contact = solve(solver, *given, **more)
        if solver.slab.nx < UNCONVERGED_POINTS:
            return contact
        certificate = contact.certificate if made else replace(contact.certificate, penetration=np.nan)
        made.append(replace(contact, failure="is refused", certificate=certificate))
        return made[-1]

    data = {
        "grid": {"points": UNCONVERGED_POINTS, "size": 1e-3},
        "surface": ROUGH,
        "material": ELASTIC,
        "history": [{"pressure": 1e4}],
    }
    march = begun(data | {"numerics": {"accept_unconverged": True}})
    monkeypatch.setattr(ContactSolver, "solve", refuse)
    monkeypatch.setattr(starts, "solve_by_sets", lambda *_: made[-1])
    with pytest.raises(StepError, match="is refused"):
        run_steps(march, [])


# -- loads beyond the digits of single precision: a solve that stalls is tried again in double precision --------------


@pytest.mark.mpi(2)
def test_an_operator_in_single_precision_is_made_double(comm: MPI.Intracomm) -> None:
    """Under a million times the pressure of full contact, which moves the body by roundings of single
    precision: found as with double precision, to the tolerance; without a load like that nothing is tried again."""
    series = []
    for load, precision in ((1e11, "mixed"), (1e11, "double"), (1e4, "mixed")):
        numerics = {"precision": precision, "tolerance": 1e-3}
        data = {
            "grid": {"points": 64, "size": 1e-3},
            "surface": ROUGH,
            "material": ELASTIC,
            "history": [{"pressure": load}],
        }
        march, found = marched({**data, "numerics": numerics}, comm=comm)
        assert found[-1].certificate.worst <= 1e-3
        series.append((found[-1], march.scene.slab.tally["retry"], march.field("pressure") - load))
    (mixed, tried, p), (double, none, exact), (_, also_none, _) = series
    assert (tried, none, also_none) == (1, 0, 0)
    assert mixed.remark.endswith("solved when retried with an operator in double precision")
    assert not double.remark
    largest = comm.allreduce(np.abs(exact).max(initial=0.0), MPI.MAX)
    np.testing.assert_allclose(p, exact, rtol=0, atol=2e-3 * largest)


@pytest.mark.mpi(2)
@pytest.mark.parametrize(("limit", "solved"), [(500, True), (1, False)])
def test_what_would_do_is_solved_in_double_precision(comm: MPI.Intracomm, limit: int, solved: bool) -> None:
    """A job that takes solves as they end has those of double precision, the operator's rounding is not what ends them;
    what that does not solve is taken, and nothing else is tried."""
    numerics = {"precision": "mixed", "tolerance": 1e-3, "accept_unconverged": True, "max_iterations": limit}
    load = 1e11 if solved else 1e4
    data = {
        "grid": {"points": 64, "size": 1e-3},
        "surface": ROUGH,
        "material": ELASTIC,
        "history": [{"pressure": load}],
        "numerics": numerics,
    }
    march, found = marched(data, comm=comm)
    assert march.scene.slab.tally["retry"] == 1
    assert (found[-1].certificate.worst <= 1e-3) == solved
    assert found[-1].remark.endswith("with an operator in double precision") == solved


# -- the row of a step ------------------------------------------------------------------------------------------------


def test_no_errors_are_stated_of_a_contact_that_reaches_the_edge_of_its_box() -> None:
    """They are known of a light contact in the middle, and of none that the box cuts off."""
    history = [{"force": force, "duration": 1e-3, "time_step": 1e-3} for force in (3e-3, 10.0)]
    grid = {"points": 16, "size": 1e-3, "boundary": "free"}
    _, made = marched({"grid": grid, "surface": SPHERE, "material": ZENER, "history": history})
    assert [row.measures.at_edge for row in made[1:]] == [False, False, True, True]
    assert [row.errors is None for row in made[1:]] == [False, False, True, True]


def test_steps_take_no_longer_than_the_march() -> None:
    began = time.perf_counter()
    _, made = marched({"grid": GRID, "surface": SPHERE, "material": ELASTIC, "history": [PRESS]})
    assert 0.0 < sum(row.seconds for row in made) < time.perf_counter() - began


def test_the_longest_steps_do_where_nothing_touches() -> None:
    """A ramp far beyond the range of an attraction that ends there is divided as seldom as any ramp."""
    rubber = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 2e6, "relaxation_time": 1e-3}]}
    scene = {"grid": {"points": 20, "size": 1e-3}, "surface": SPHERE | {"radius": 2e-3}, "material": rubber}
    ramp = {"approach": {"from": -9e-6, "to": -8e-6}, "duration": 4e-4}
    march = begun({**scene, "adhesion": {"work": 0.05, "range": 1e-6, "law": "dugdale"}, "history": [ramp]})
    times = [march.advance(step).time for step in islice(march.steps(), 4)]
    np.testing.assert_allclose(times, np.arange(4) * 4e-4 / RAMP_STEPS, rtol=1e-12)


def test_effects_are_given_the_energy_that_the_body_gains(monkeypatch: pytest.MonkeyPatch) -> None:
    """The stored and dissipated energies of all steps add up to the columns of the row, to rounding of their sums."""
    follow, gained = AdhesionColumns.follow, list[float]()

    def note(effect: AdhesionColumns, instant: Instant, memory: AdhesionMemory) -> Changes[AdhesionMemory]:
        gained.append(instant.gained)
        return follow(effect, instant, memory)

    monkeypatch.setattr(AdhesionColumns, "follow", note)
    press = {"force": {"from": 0.0, "to": 5e-2}, "duration": 1e-4, "time_step": 2e-5}
    scene = {"grid": {"points": 20, "size": 1e-3}, "surface": SPHERE, "material": ZENER, "history": [press]}
    _, made = marched({**scene, "adhesion": {"work": 0.05, "range": 1e-6}, "output": {"energy": True}})
    assert made[-1].dissipated > 0.01 * made[-1].stored > 0.0
    sums = [row.stored + row.dissipated for row in made]
    np.testing.assert_allclose(np.cumsum(gained), np.subtract(sums[1:], sums[0]), rtol=1e-12)


def test_steps_that_fail_are_shortened_as_far_as_a_snap_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Down to a share of the longest step and of the shortest relaxation time; no step is tried after the first one
    that is as short."""
    tried = list[float]()

    def fail(law: AdhesiveLaw, trial: Trial, step: Step, *others: Any) -> None:
        tried.append(step.dt)
        raise StepError("is refused")

    press = {"force": {"from": 0.0, "to": 5e-2}, "duration": 1e-2}
    scene = {"grid": {"points": 20, "size": 1e-3}, "surface": SPHERE, "material": ZENER, "history": [press]}
    march = begun({**scene, "adhesion": {"work": 0.05, "range": 1e-6}})
    steps = march.steps()
    for step in islice(steps, 8):
        march.advance(step)
    monkeypatch.setattr(AdhesiveLaw, "solve", fail)
    with pytest.raises(StepError, match="is refused"):
        march.advance(next(steps))
    snap = min(SNAP_SHARE * 1e-2 / RAMP_STEPS, RELAXING * march.scene.material.shortest_time)
    assert tried[-1] <= snap < min(tried[:-1])


# -- cost -------------------------------------------------------------------------------------------------------------

MOST_CALLS = 850  # calls of functions in a step; some 750 are made, and were 1550 with all made anew in each step


def test_calls_of_functions_in_a_step() -> None:
    """Steps of small grids, as those of bands and studies, are Python: what does not change is not made again."""
    slide = {"pressure": 1e5, "velocity": 0.3, "distance": 30 * 1e-3 / 64, "cells_per_step": 1}
    branches = [{"modulus": 9e6, "relaxation_time": 1e-4}, {"modulus": 4e6, "relaxation_time": 1e-2}]
    material = {"model": "zener", "modulus_inf": 1e6, "branches": branches}
    rough = {"hurst": 0.8, "long_wavelength": 2.5e-4, "short_wavelength": 1.25e-4, "rms_slope": 0.1, "seed": 1}
    march = begun({"grid": GRID, "surface": {"shape": "rough", **rough}, "material": material, "history": [slide]})
    steps = march.steps()
    for step in islice(steps, 10):
        march.advance(step)
    profile = cProfile.Profile()
    profile.enable()
    count = sum(march.advance(step).iterations <= 2 for step in steps)
    profile.disable()
    assert count == 21  # the jump and 30 steps: all are like those that the bound is about
    assert pstats.Stats(profile).total_calls / count < MOST_CALLS  # type: ignore[attr-defined]

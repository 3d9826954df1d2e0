"""Whole studies: of a wave in full contact, whose friction has a closed form, and as a user runs them."""

import math
import re
import shutil
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from statistics import fmean

import numpy as np
import pytest
from conftest import Main
from csv_rows import rows
from hypothesis import given
from hypothesis import strategies as st
from marched_jobs import marched
from mpi4py import MPI
from numpy.testing import assert_allclose

from parcontact.door import study
from parcontact.door.study import (
    Ladders,
    Limit,
    Settings,
    describe_choices,
    extrapolate,
    ladders,
    make_cases,
    overrides,
)
from parcontact.effects.adhesion.effect import law_of
from parcontact.errors import InputError
from parcontact.files import run as runner
from parcontact.files.stopping import Options
from parcontact.job import Job, load
from parcontact.job.history import Timeline
from parcontact.march.mesh import load as load_job
from parcontact.parallel.slab import Slab
from parcontact.results import results

WAVE = """
grid: {points: [32, 1], size: [2.5e-4, 2.5e-4]}
surface: {shape: wave, amplitude: 5.0e-7, waves: [1, 0]}
material: {model: zener, modulus_inf: 0.275e6, branches: [{modulus: 2.475e6, relaxation_time: 1.0e-3}]}
initial: {state: steady, velocity: 0.004, pressure: 2.0e5}
history: [{pressure: 2.0e5, velocity: 0.0397887, distance: 1.25e-3, cells_per_step: 1}]
numerics: {tolerance: 1.0e-7}
study: {mesh: [32, 64, 128], cells_per_step: [1], integrator: [exponential, backward-euler]}
output: {directory: out}
"""
EXACT = 9.770908e-4  # k^2 h0^2 G''(k v)/P0, full contact, steady at k v tau = 1
LEFT = 2e-5  # share of the transient in the mean: exp(-312/40) 40/938, with a time of relaxation of 40 micrometres
FULL = 11.78e-4 / EXACT  # its maximum after the jump of velocity over that, from the closed form of the transient


def outcomes(path: Path) -> study.Outcomes:
    """Return the rows of a study, which is run if it was not."""
    assert run_study(path, path.parent / "out", MPI.COMM_SELF) == 0
    job = load(path)
    cases = make_cases(job, ladders(job), lambda changes: load(path, changes))
    return dict(zip(cases, results.read_cases(path.parent / "out" / "sweep.csv"), strict=True))


def run_study(path: Path, out: Path, comm: MPI.Intracomm) -> int:
    def make(changes: Sequence[str]) -> Job:
        return load(path, [f"output.directory={out}", *changes])

    job = make(())
    return study.run_study(job, make, Slab(comm, *job.grid.points), quiet=True)


def test_orders_and_limits_of_full_contact(tmp_path: Path) -> None:
    """Exponential steps are of the third order, backward Euler of the first, to the same closed form."""
    path = tmp_path / "wave.yaml"
    path.write_text(WAVE)
    found = outcomes(path)
    limits = {(one.quantity, one.integrator, one.ladder): one for one in study.limits(ladders(load(path)), found)}
    for integrator, order in (("exponential", 3.0), ("backward-euler", 1.0)):
        limit = limits["mu_max", integrator, "mesh and time together"].limit
        print(f"{integrator}: mu_max {limit}")
        assert limit.value == pytest.approx(FULL * EXACT, rel=1e-3)
        limit = limits["mu_dyn", integrator, "mesh and time together"].limit
        print(f"{integrator}: mu_dyn {limit}")
        assert limit.order == pytest.approx(order, abs=0.1)
        assert abs(limit.value - EXACT) < limit.uncertainty + LEFT * EXACT
        assert limit.value == pytest.approx(EXACT, rel=2e-3)
    reference = study.references(ladders(load(path)), found)
    assert reference["mu_dyn"].value == pytest.approx(EXACT, rel=LEFT)
    alone = [one for one in found if one.integrator == "exponential" and math.isclose(one.time_step, 1 / 128)]
    errors = [
        study.estimate_errors(found[case], reference)["mu_dyn"] for case in sorted(alone, key=lambda case: case.mesh)
    ]
    assert np.ptp(errors) < 0.1 * max(errors)  # full contact is exact on every mesh: refining it alone is wasted


PARTIAL = """
grid: {points: 32, size: 1.0e-3}
surface: {shape: rough, hurst: 0.9, long_wavelength: 5.0e-4, short_wavelength: 2.5e-4, rms_slope: 0.02, seed: 1}
material: {model: zener, modulus_inf: 0.3e6, branches: [{modulus: 2.5e6, relaxation_time: 1.0e-3}]}
initial: {state: steady, velocity: 0.01, pressure: 2.0e4}
history: [{pressure: 2.0e4, velocity: 0.1, distance: 2.5e-4, cells_per_step: 1}]
numerics: {tolerance: 1.0e-5}
study: {mesh: [16, 32, 64, 128]}
"""


@pytest.mark.parametrize("integrator", ["exponential-linear", "backward-euler"])
def test_refining_one_of_mesh_and_time_is_wasted(tmp_path: Path, integrator: str) -> None:
    """A step of velocity with 23 % of contact (paper, Fig. 6): together they converge in the first order at least; the
    mesh alone, with the steps of 32 points, leaves friction where it was, and time alone, on 16 points, the area where
    the mesh has it. Against 128 points with quarter cells, known to 2e-4 or so. Quadratic steps of
    a cell are accurate enough here: their mesh alone is what is left."""
    path = tmp_path / "rough.yaml"
    path.write_text(PARTIAL)
    job = load(path)
    own = ladders(job).own

    def errors(mesh: int, cells: float, integrator: str = integrator) -> tuple[float, float]:
        _, made = marched(load(path, overrides(job, own, Settings(mesh, cells, integrator))))
        last = [row.measures for row in made[-(len(made) // 4) :]]
        friction, area = (fmean(getattr(one, name) for one in last) for name in ("friction", "contact_area_corrected"))
        return friction - limit[0], area - limit[1]

    limit = (0.0, 0.0)
    limit = errors(128, 0.25, "exponential")
    together = [abs(errors(mesh, 1)[0]) for mesh in (16, 32, 64)]
    assert all(fine < 0.55 * coarse for coarse, fine in pairwise(together))
    assert abs(errors(128, 4)[0]) > 0.8 * together[1]  # a quarter of the cells, and no less wrong
    coarse, fine = abs(errors(16, 0.125)[1]), abs(errors(64, 0.5)[1])  # the same time steps
    assert coarse > 0.02 * limit[1]
    assert fine < 0.5 * coarse  # it was the mesh


def make(seconds: float, error: float) -> study.Outcome:
    areas = dict.fromkeys(("contact_area", "contact_area_corrected"), 0.5)
    return {"mu_max": 1.0 + error, "mu_dyn": 2.0 * (1.0 + error / 2), **areas, "seconds": seconds}


def test_the_fastest_settings_that_are_accurate_enough_are_named() -> None:
    """In the least time, among those that are accurate enough."""
    results = [make(1.0, 0.1), make(2.0, 0.02), make(3.0, 0.04), make(4.0, 0.002)]
    cases = {Settings(2**k, 1.0, "exponential"): one for k, one in enumerate(results)}
    _, second, _, last = cases
    reference = {
        "mu_max": Limit(1.0, 1.0, 0.004),
        "mu_dyn": Limit(2.0, 1.0, 0.0),
        "contact_area": Limit(0.5, 1.0, 0.0),
        "contact_area_corrected": Limit(0.5, 1.0, 0.0),
    }
    lines = study.sentences(cases, reference, 2)
    assert lines[0].startswith(
        "the fastest settings with errors of mu_max, mu_dyn, contact_area_corrected within a bound"
    )
    assert lines[1] == f"for 5 %: {second}; 2 s"
    assert lines[3] == f"for 1 %: {last}; 4 s"
    assert lines[4] == "for 0.3 %: none of these settings is good enough"
    assert lines[5] == "the error of the reference, to which they are compared, is 0.4 %"
    *_, said = study.sentences(cases, {**reference, "mu_dyn": Limit(2.0, 1.0, 0.24)}, 2)
    assert said.endswith(" is 12 %: add finer values to the lists of the study to make it smaller")


def test_a_ladder_without_effect_is_no_proof(tmp_path: Path) -> None:
    """Three cases with the same numbers: no sentence has an error of zero. Steps that are chosen bound what is known by
    the accuracy for which they are."""
    path = tmp_path / "wave.yaml"
    path.write_text(WAVE.replace("[exponential, backward-euler]", "[exponential]"))
    refined = ladders(load(path))
    same = dict.fromkeys(refined.combine(), make(1.0, 0.1))
    assert all("its error is unknown" in str(one) for one in study.limits(refined, same))
    assert study.sentences(same, study.references(refined, same), 1)[-1].endswith("is not known")
    path.write_text(path.read_text().replace(", cells_per_step: 1}", "}").replace(", cells_per_step: [1]", ""))
    refined = ladders(load(path))
    found = {case: make(1.0, 1.0 / case.mesh**4) for case in refined.combine()}
    reference = study.references(refined, found)
    assert reference["mu_max"].uncertainty == 0.01 * reference["mu_max"].value
    assert study.sentences(found, reference, 1)[-1].endswith("is 1 %")


SHORT = (
    WAVE.replace("[32, 64, 128]", "[32, 64]").replace("step: [1]", "step: [1, 0.5]").replace(", backward-euler", "")
)  # four cases


def test_goes_on_where_it_was_stopped(main: Main, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the file `stop`, after the second case; the first and second are not run again, also with a longer ladder."""
    job, out = tmp_path / "wave.yaml", tmp_path / "out"
    job.write_text(SHORT)
    run, ran = runner.run_job, list[int]()

    def run_and_stop(one: Job, slab: Slab, options: Options) -> int:
        ran.append(one.grid.nx)
        if len(ran) == 2:
            (out / "stop").touch()
        return run(one, slab, options)

    monkeypatch.setattr(runner, "run_job", run_and_stop)
    code, said, err = main("study", job)
    assert (code, len(ran), "run again to go on" in said) == (3, 2, True), err
    assert not (out / "study.csv").exists()
    code, said, err = main("study", job)
    assert code == 0, err
    assert "for 5 %: mesh" in said
    for name in ("convergence.png", "study.txt", "study.csv"):
        assert (out / name).stat().st_size > 100
    made = {path: path.stat().st_mtime_ns for path in out.glob("cases/*/measures.csv")}
    assert len(made) == 4
    assert main("study", job, "--set", "study.mesh=[32,64,128]")[0] == 0
    assert all(path.stat().st_mtime_ns == when for path, when in made.items())
    code, _, err = main("study", job, "--set", "material.modulus_inf=3e5")
    assert (code, "of another job" in err) == (2, True), err


@pytest.mark.mpi(2)
def test_goes_on_with_other_ranks(comm: MPI.Intracomm, shared_path: Path) -> None:
    """Cases that one rank has made are kept; the others are those of one rank, to the tolerance of a solve, 1e-7."""
    path, out = shared_path / "wave.yaml", shared_path / "out"
    if comm.rank == 0:
        path.write_text(SHORT)
        assert run_study(path, out, MPI.COMM_SELF) == 0
        whole = rows(out / "study.csv")
        shutil.rmtree(out / "cases" / "64-1-exponential")
    comm.Barrier()
    assert run_study(path, out, comm) == 0
    if comm.rank:
        return
    table = rows(out / "study.csv")
    assert len(whole) == 4
    assert all(float(row["error_mu_dyn"]) < 0.1 for row in whole)
    for ours, theirs in zip(table, whole, strict=True):
        kept = (ours["mesh"], ours["cells_per_step"]) != ("64", "1.0")
        assert (ours["seconds"] == theirs["seconds"]) == kept
        for name in ("mu_max", "mu_dyn", "contact_area_corrected"):
            assert float(ours[name]) == pytest.approx(float(theirs[name]), rel=1e-5)


@pytest.mark.parametrize(
    ("load", "sentence"),
    [
        (
            "pressure: 1.0e4",
            "the fastest settings with errors of contact_area_corrected within a bound, times of all steps on 1 rank:",
        ),
        ("approach: -1.0e-6", "there is no contact, and no error"),
    ],
)
def test_without_a_slide_nothing_is_said_of_friction(main: Main, tmp_path: Path, load: str, sentence: str) -> None:
    """Its friction is next to nothing, or nothing, and its relative error no number."""
    history = f"history: [{{{load}}}]\nstudy: {{mesh: [16, 32, 64]}}\noutput: {{directory: out}}\n"
    job = tmp_path / "rest.yaml"
    job.write_text(WAVE.partition("initial")[0] + history)
    code, out, err = main("study", job)
    assert (code, sentence in out.splitlines()) == (0, True), err
    assert not any(word in out for word in ("nan", "mu_", "friction"))
    assert {row["error_mu_max"] for row in rows(tmp_path / "out" / "study.csv")} == {""}


def test_contacts_that_do_not_slide(main: Main, tmp_path: Path) -> None:
    """One case a mesh, as no step is given; areas are means over the loads, the last of which opens the contact."""
    job, out = tmp_path / "rest.yaml", tmp_path / "out"
    loads = "history: [{pressure: 1.0e4}, {pressure: 2.0e4}, {approach: -1.0e-6}]"
    job.write_text(WAVE.partition("initial")[0] + f"{loads}\nstudy: {{mesh: [16, 32]}}\noutput: {{directory: out}}\n")
    assert main("study", job)[0] == 0
    cases = [rows(path / "measures.csv") for path in sorted((out / "cases").iterdir())]
    table = rows(out / "study.csv")
    assert [row["mesh"] for row in table] == ["16", "32"]
    for row, steps in zip(table, cases, strict=True):
        areas = [float(step["contact_area"]) for step in steps[1:]]
        assert float(row["contact_area"]) == pytest.approx(fmean(areas), rel=1e-12)
        assert areas[-1] == 0.0 < areas[0]
    code, _, err = main("study", job, "--set", "study.cells_per_step=[2,1]")
    assert (code, "study.cells_per_step: no stage slides or has a time step" in err) == (2, True)


def test_a_press_that_takes_time_is_measured_over_time(tmp_path: Path) -> None:
    """Two areas, held for 1 s and for 3 s."""
    (tmp_path / "measures.csv").write_text(
        "time,contact_area,contact_area_corrected\n0,0,\n0,.1,.2\n1,.1,.2\n1,.5,.4\n4,.5,.4\n"
    )
    assert study._mean_areas(tmp_path) == pytest.approx({"contact_area": 0.4, "contact_area_corrected": 0.35})


def test_a_case_that_cannot_be(main: Main, tmp_path: Path) -> None:
    """All cases are read before the first is run; nothing is written."""
    job = tmp_path / "wave.yaml"
    job.write_text(WAVE.replace("waves: [1, 0]", "waves: [9, 0]").replace("[32, 64, 128]", "[16, 32]"))
    code, _, err = main("study", job)
    assert code == 2
    assert "9" in err
    assert not (tmp_path / "out").exists()


def test_a_study_whose_cases_are_all_refused_writes_nothing(
    main: Main, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(job: Job, slab: Slab, options: Options) -> int:
        raise InputError("this surface has no heights")

    monkeypatch.setattr(runner, "run_job", refuse)
    job = tmp_path / "wave.yaml"
    job.write_text(WAVE)
    code, _, err = main("study", job)
    assert code == 2
    assert err.count("this surface has no heights") == 10
    assert not (tmp_path / "out").exists()


# -- which cases a study has, and what they change in a job -----------------------------------------------------------

TEXT = """
grid: {points: [64, 32], size: [1.0e-3, 5.0e-4]}
surface: {shape: rough, hurst: 0.9, long_wavelength: 5.0e-4, short_wavelength: 1.25e-4, rms_slope: 0.02, seed: 1}
material: {model: zener, modulus_inf: 1.0e6, branches: [{modulus: 1.0e7, relaxation_time: 1.0e-5}]}
history:
  - {pressure: 1.0e5, duration: 1.0e-3, time_step: {first: 1.0e-6, growth: 1.2}}
  - {pressure: 1.0e5, velocity: 1.0, duration: 1.0e-4, time_step: 1.0e-6}
  - {pressure: 1.0e5, velocity: 1.0, distance: 1.25e-4, cells_per_step: 2}
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "job.yaml"
    path.write_text(TEXT)
    return path


def refined(path: Path, study: str) -> tuple[Job, Ladders]:
    job = load_job(path, [f"study={study}"])
    return job, ladders(job)


def test_cases(path: Path) -> None:
    """Meshes, steps and integrators combined; the mesh alone; each once, the cheapest first."""
    _, found = refined(path, "{mesh: [128, 64, 32], cells_per_step: [2, 1], integrator: [exponential, backward-euler]}")
    cases = found.combine()
    assert len(cases) == len(set(cases)) == 3 * 2 * 2 + 2 * 1  # of the mesh alone, half a cell on 32 points is new
    assert {case.mesh for case in cases} == {32, 64, 128}
    alone = [case for case in cases if case.time_step == 2 / 128]
    assert {(case.mesh, case.cells_per_step) for case in alone} == {(128, 2.0), (64, 1.0), (32, 0.5)}
    assert [case.effort for case in cases] == sorted(case.effort for case in cases)


@pytest.mark.parametrize(
    ("mesh", "cells", "factor"), [(64, 2.0, 1.0), (64, 1.0, 0.5), (128, 2.0, 0.5), (128, 4.0, 1.0)]
)
def test_steps_of_all_kinds_change_alike(path: Path, mesh: int, cells: float, factor: float) -> None:
    """Twice as fine in time: each stage has twice the steps; growing ones are rounded up."""
    job, found = refined(path, "{mesh: [64, 128]}")
    case = Settings(mesh, cells, "backward-euler")
    changed = load_job(path, overrides(job, found.own, case))
    assert changed.grid.points == (mesh, mesh // 2)
    assert (changed.numerics.integrator, changed.numerics.tolerance) == ("backward-euler", 5e-3)
    before, after = ([span.count for span in Timeline.from_job(one).spans] for one in (job, changed))
    assert after[1:] == [round(count / factor) for count in before[1:]]
    assert abs(after[0] - before[0] / factor) <= 2
    assert Timeline.from_job(changed).end == pytest.approx(Timeline.from_job(job).end, rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ([], "no ladders"),
        (["study={mesh: [48, 33]}"], r"study\.mesh\.1 must give a whole number of points along y in a box of 64 x 32"),
        (["study={mesh: [32, 64]}", "surface={shape: file, path: h.npy}"], "given on one mesh"),
        (["study={mesh: [32]}", "history=[]", "steady={velocities: 1.0, pressures: 1.0e4}"], "the job needs a history"),
    ],
)
def test_refused(path: Path, changes: list[str], sentence: str, main: Main) -> None:
    """Also by `check`, except that a job without ladders is a sound job."""
    np.save(path.with_name("h.npy"), np.zeros((32, 64)))
    with pytest.raises(InputError, match=sentence):
        ladders(load_job(path, changes))
    code, _, said = main("check", path, *(word for change in changes for word in ("--set", change)))
    assert code == (2 if changes else 0)
    assert not changes or re.search(sentence, said)


def test_check_reads_the_jobs_of_a_study(path: Path, main: Main) -> None:
    """A mesh too coarse for the shortest wave: check and study refuse it with the same sentence, with the case."""
    surface = "{shape: rough, hurst: 0.8, rms_slope: 0.1, long_wavelength: 2.5e-4, short_wavelength: 4.0e-5}"
    words = (path, "--set", f"surface={surface}", "--set", "study={mesh: [16, 32]}")
    (code, _, said), (ends, _, same) = main("check", *words), main("study", *words)
    assert (code, ends) == (2, 2)
    assert said == same
    assert "study, case mesh 16, " in said
    assert "short_wavelength must be at least two cells" in said


@pytest.mark.parametrize(
    ("study", "sentence"),
    [
        ("{}", "study needs at least one ladder: mesh, cells_per_step"),
        ("{mesh: [32, 32]}", "study.mesh.1 repeats 32"),
        ("{mesh: [0]}", "study.mesh.0 must be a list of positive whole numbers"),
        ("{mesh: [32], tolerance: [0.1]}", "compare values of numerics.tolerance by a `sweep:`"),
        ("{mesh: [32], cells: [1]}", "study.cells is not a known key"),
    ],
)
def test_mistakes(path: Path, study: str, sentence: str) -> None:
    with pytest.raises(InputError) as caught:
        load_job(path, [f"study={study}"])
    assert sentence in str(caught.value)


def test_defaults_of_a_study(path: Path) -> None:
    """One ladder is enough; the rest is the job's own, with the cells per step of its first stage that has them."""
    _, found = refined(path, "{mesh: 32}")
    assert found.combine() == [Settings(32, 2.0, "exponential")]


def chosen(path: Path, study: str) -> tuple[Job, Ladders]:
    """The job, its second slide choosing its own steps, and a press before that does too."""
    path.write_text(
        TEXT.replace(", cells_per_step: 2", "").replace("time_step: {first: 1.0e-6, growth: 1.2}", "time_step: auto")
    )
    return refined(path, study)


def test_a_ladder_takes_the_place_of_chosen_steps(path: Path) -> None:
    """Eight cells of sliding in 2, 4 and 8 steps; at rest steps are chosen, which is said."""
    job, found = chosen(path, "{cells_per_step: [4, 2, 1]}")
    jobs = [load_job(path, overrides(job, found.own, case)) for case in found.combine()]
    assert [case.steps for case in found.combine()] == ["4 cells per step", "2 cells per step", "1 cell per step"]
    assert [Timeline.from_job(one).spans[2].count for one in jobs] == [2, 4, 8]
    assert all(one.history[0].chooses for one in jobs)
    assert describe_choices(job) == ["the time steps of stage 1 are chosen in every case, for numerics.accuracy = 0.01"]


def test_steps_without_a_ladder_are_chosen_in_every_case(path: Path) -> None:
    """They say so, and on every mesh there is one case, not another with the time step of the finest mesh."""
    job, found = chosen(path, "{mesh: [32, 64]}")
    cases = found.combine()
    assert [(case.mesh, case.steps) for case in cases] == [(32, "auto steps"), (64, "auto steps")]
    assert all(load_job(path, overrides(job, found.own, case)).history[2].chooses for case in cases)
    assert "are chosen in every case" in describe_choices(job)[0]
    assert found.shared == 0.01


def test_a_time_step_of_a_slide_is_stated_in_cells(path: Path) -> None:
    """1e-6 s at 1 m/s over cells of 1e-3/64 m, and a ladder that refines it takes those cells."""
    path.write_text(TEXT.replace(", cells_per_step: 2", ", time_step: 1.0e-6"))
    _, found = refined(path, "{mesh: [64]}")
    assert [case.steps for case in found.combine()] == ["0.064 cell per step"]
    job, found = refined(path, "{cells_per_step: [0.5, 0.25]}")
    jobs = [load_job(path, overrides(job, found.own, case)) for case in found.combine()]
    assert [one.history[1].time_step for one in jobs] == pytest.approx([0.5e-3 / 64, 0.25e-3 / 64], rel=1e-12)


@pytest.mark.parametrize(("reach", "held"), [("auto", True), ("2.0e-6", False)])
def test_the_range_of_adhesion_is_that_of_the_job_on_every_mesh(path: Path, reach: str, held: bool) -> None:
    """`auto` is `sqrt(2 h w/E*)` on cells h, and would follow the ladder; it is stated that it does not."""
    path.write_text(f"{TEXT}adhesion: {{work: 0.01, range: {reach}}}\n")
    job, found = refined(path, "{mesh: [32, 64, 128]}")
    cases = [load_job(path, overrides(job, found.own, case)) for case in found.combine()]
    assert {case.grid.nx for case in cases} == {32, 64, 128}
    assert {law_of(case).range for case in cases} == {law_of(job).range}
    stated = f"adhesion.range: {math.sqrt(2 * (1e-3 / 64) * 0.01 / 4e6):.4g} m in every case"
    assert [text.startswith(stated) for text in describe_choices(job)] == [True] * held


# -- limits of sequences whose limit is known -------------------------------------------------------------------------


@given(
    st.floats(0.5, 4.0),
    st.floats(-10.0, 10.0),
    st.sampled_from([-0.3, 0.2]),
    st.sampled_from([(1.0, 0.5, 0.25), (1.0, 0.6, 0.5), (1.0, 0.5, 0.25, 0.125)]),
)
def test_power_laws(order: float, limit: float, factor: float, sizes: tuple[float, ...]) -> None:
    """`f* + c h^p` is extrapolated to f* whatever the ratios of the sizes; rounding of the differences."""
    found = extrapolate(sizes, [limit + factor * size**order for size in sizes])
    assert_allclose(found.order, order, rtol=1e-6)
    assert_allclose(found.value, limit, atol=1e-6)
    assert found.uncertainty > 0.0


def test_two_powers_stay_within_the_uncertainty() -> None:
    """A second term of the next order moves the limit by less than what it is said to be sure to."""
    sizes = (1.0, 0.5, 0.25, 0.125)
    found = extrapolate(sizes, [3.0 + 0.1 * h**1.5 + 0.05 * h**2.5 for h in sizes])
    assert 0.0 < abs(found.value - 3.0) < found.uncertainty < 0.01


@pytest.mark.parametrize("values", [(1.0, 2.0, 1.5), (1.0, 1.1, 1.5), (1.0, 1.5)])
def test_what_does_not_converge(values: tuple[float, ...]) -> None:
    """No order: the finest value, and the larger of the last two differences as what is not known."""
    found = extrapolate([0.5**k for k in range(len(values))], values)
    assert math.isnan(found.order)
    steps = [abs(b - a) for a, b in pairwise(values)]
    assert (found.value, found.uncertainty) == (values[-1], max(steps[-2:]))


@pytest.mark.parametrize("values", [[2.0, 2.0], [2.0, 2.0, 2.0], [1.0, 2.0, 2.0, 2.0]])
def test_values_that_do_not_differ_tell_nothing_of_their_error(values: list[float]) -> None:
    found = extrapolate([2.0**-k for k in range(len(values))], values)
    assert found.value == 2.0
    assert math.isnan(found.order)
    assert math.isnan(found.uncertainty)

"""Which cases a study has, and what they change in a job."""

import math
from pathlib import Path

import numpy as np
import pytest

from parcontact.errors import InputError
from parcontact.history.timeline import Timeline
from parcontact.job import Job
from parcontact.mesh import load
from parcontact.scene import choices
from parcontact.study.ladders import Ladders, Settings, describe_chosen_steps, describe_held_range, ladders, overrides

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
    job = load(path, [f"study={study}"])
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
    changed = load(path, overrides(job, found.own, case))
    assert changed.grid.points == (mesh, mesh // 2)
    assert (changed.numerics.integrator, changed.numerics.tolerance) == ("backward-euler", 5e-3)
    before, after = ([span.count for span in Timeline.of(one).spans] for one in (job, changed))
    assert after[1:] == [round(count / factor) for count in before[1:]]
    assert abs(after[0] - before[0] / factor) <= 2
    assert Timeline.of(changed).end == pytest.approx(Timeline.of(job).end, rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ([], "no ladders"),
        (["study={mesh: [48, 33]}"], "33 points along x are no whole number along y"),
        (["study={mesh: [32, 64]}", "surface={shape: file, path: h.npy}"], "given on one mesh"),
    ],
)
def test_refused(path: Path, changes: list[str], sentence: str) -> None:
    np.save(path.with_name("h.npy"), np.zeros((32, 64)))
    with pytest.raises(InputError, match=sentence):
        ladders(load(path, changes))


@pytest.mark.parametrize(
    ("study", "sentence"),
    [
        ("{}", "study needs at least one ladder: mesh, cells_per_step"),
        ("{mesh: [32, 32]}", "study.mesh.1 names 32 a second time"),
        ("{mesh: [0]}", "study.mesh.0 must be a list of positive whole numbers"),
        ("{mesh: [32], tolerance: [0.1]}", "a `sweep:` compares values of numerics.tolerance"),
        ("{mesh: [32], cells: [1]}", "study.cells is not a known key"),
    ],
)
def test_mistakes(path: Path, study: str, sentence: str) -> None:
    with pytest.raises(InputError) as caught:
        load(path, [f"study={study}"])
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
    jobs = [load(path, overrides(job, found.own, case)) for case in found.combine()]
    assert [case.steps for case in found.combine()] == ["4 cells per step", "2 cells per step", "1 cell per step"]
    assert [Timeline.of(one).spans[2].count for one in jobs] == [2, 4, 8]
    assert all(one.history[0].chooses for one in jobs)
    (line,) = describe_chosen_steps(job)
    assert line == "stage 1: time steps at rest are chosen in every case, they have no cells per step"


def test_steps_without_a_ladder_are_chosen_in_every_case(path: Path) -> None:
    """They say so, and on every mesh there is one case, not another with the time step of the finest mesh."""
    job, found = chosen(path, "{mesh: [32, 64]}")
    cases = found.combine()
    assert [(case.mesh, case.steps) for case in cases] == [(32, "auto steps"), (64, "auto steps")]
    assert all(load(path, overrides(job, found.own, case)).history[2].chooses for case in cases)
    assert "study.cells_per_step would show" in describe_chosen_steps(job)[0]
    assert found.shared == 0.01


def test_a_time_step_of_a_slide_is_told_in_cells(path: Path) -> None:
    """1e-6 s at 1 m/s over cells of 1e-3/64 m, and a ladder that refines it takes those cells."""
    path.write_text(TEXT.replace(", cells_per_step: 2", ", time_step: 1.0e-6"))
    _, found = refined(path, "{mesh: [64]}")
    assert [case.steps for case in found.combine()] == ["0.064 cell per step"]
    job, found = refined(path, "{cells_per_step: [0.5, 0.25]}")
    jobs = [load(path, overrides(job, found.own, case)) for case in found.combine()]
    assert [one.history[1].time_step for one in jobs] == pytest.approx([0.5e-3 / 64, 0.25e-3 / 64], rel=1e-12)


@pytest.mark.parametrize(("reach", "held"), [("auto", True), ("2.0e-6", False)])
def test_the_range_of_adhesion_is_that_of_the_job_on_every_mesh(path: Path, reach: str, held: bool) -> None:
    """`auto` is `sqrt(2 h w/E*)` on cells h, and would follow the ladder; it is told that it does not."""
    path.write_text(f"{TEXT}adhesion: {{work: 0.01, range: {reach}}}\n")
    job, found = refined(path, "{mesh: [32, 64, 128]}")
    cases = [load(path, overrides(job, found.own, case)) for case in found.combine()]
    assert {case.grid.nx for case in cases} == {32, 64, 128}
    assert {choices(case).adhesion for case in cases} == {choices(job).adhesion}
    told = f"adhesion.range: {math.sqrt(2 * (1e-3 / 64) * 0.01 / 4e6):.4g} m in every case"
    assert [text.startswith(told) for text in describe_held_range(job)] == [True] * held

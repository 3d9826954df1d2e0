"""What an effect costs when it is off: nothing. A test for each row of the table that `parcontact plan` prints.

Programs are compared by all their counts: operator calls, transforms by size and precision, sums over ranks, bytes sent
and held. A solve that is given up after a fixed number of iterations makes them the same for all loads and bodies.
"""

import math
import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from marching import begun, marched
from mpi4py import MPI

from parcontact import scene
from parcontact.effects.effect import Decision
from parcontact.job import Job
from parcontact.parallel.slab import Slab
from parcontact.physics import loops
from parcontact.physics.body import ElasticBody, ZenerBody
from parcontact.physics.embedded import Embedded
from parcontact.physics.ledger import Ledger
from parcontact.physics.motion import WholeCells
from parcontact.record import fields, measures
from parcontact.run import journey, runner
from parcontact.solve import contact as contact_solver
from parcontact.solve.contact import Approach, ContactSolver, MeanPressure

Json = dict[str, Any]
NX, NY = 24, 20
MAP = 8 * NX * NY  # bytes
WAVES = 16 * 3 * 3  # bytes of the lowest waves of a surface of 2 along x and 1 along y
ITERATIONS = 3
ELASTIC: Json = {"model": "elastic", "shear_modulus": 1e6}
RUBBER: Json = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]}
STAND: Json = {"pressure": 2e3}
PRESS: Json = {"pressure": {"from": 2e3, "to": 4e3}, "duration": 1e-3, "time_step": 2.5e-4}  # a jump and four steps
SLIDE: Json = {"pressure": 2e3, "velocity": 0.1, "distance": 4e-3 / NX, "cells_per_step": 1}
PART: Json = {**SLIDE, "cells_per_step": 0.5}
SPHERE: Json = {"shape": "sphere", "radius": 1e-2}


def job(**changes: Any) -> Job:
    grid = {"points": [NX, NY], "size": [1e-3, 1e-3], **changes.pop("grid", {})}
    numerics = {"tolerance": 1e-15, "max_iterations": ITERATIONS, "accept_unconverged": True}
    return Job.model_validate(
        {
            "grid": grid,
            "surface": {"shape": "wave", "amplitude": 1e-6, "waves": [2, 1]},
            "material": ELASTIC,
            "history": [STAND],
            **changes,
            "numerics": {**numerics, **changes.get("numerics", {})},
        }
    )


def whole(planned: Job) -> Counter[str]:
    """All that the program counts for a job."""
    march, _ = marched(planned)
    return march.scene.slab.tally.copy()


def extra(on: Job, off: Job) -> dict[str, int]:
    """What one job counts more than another."""
    more, less = whole(on), whole(off)
    return {name: more[name] - less[name] for name in {*more, *less} if more[name] != less[name] if "most" not in name}


def row(planned: Job, name: str) -> Decision:
    return next(effect for effect in scene.effects(planned) if effect.name == name)


# -- programs that never had an effect --------------------------------------------------------------------------------


def bare(planned: Job) -> Counter[str]:
    """A surface that stands on an elastic body: a solver, and measures. Nothing lasts, moves or remembers."""
    slab = Slab(MPI.COMM_SELF, NX, NY)
    base = scene.frame(planned, slab)
    heights = base.surface.heights((0.0, 0.0), slab.empty())
    solver = bare_solver(base)
    last, p = slab.zeros(), slab.zeros()
    ledger = Ledger(slab, base.surface, base.units)
    for stage in planned.history:
        load = MeanPressure(stage.load.end / (base.prony.modulus_inf * base.units.pressure))
        p[...] = last
        contact = solver.solve(heights, load, p)
        last, p = p, last
        ledger.measures(contact.p, base.prony.modulus_inf, contact.u, heights, contact.d, (0.0, 0.0))
    return slab.tally.copy()


def lasting(planned: Job) -> Counter[str]:
    """The same for a body with or without memory under stages that last; the surface stands or moves by whole cells."""
    slab = Slab(MPI.COMM_SELF, NX, NY)
    base = scene.frame(planned, slab)
    path = WholeCells(base.surface)
    memory = base.prony.moduli.size > 0
    body = ZenerBody(slab, base.prony, "exponential") if memory else ElasticBody(slab, base.prony.modulus_inf)
    solver = bare_solver(base)
    ledger = Ledger(slab, base.surface, base.units)
    earlier, last, p = (slab.zeros() for _ in range(3))
    moduli, cells, dt = [0.0, 0.0], 0, -1.0
    for step in planned.timeline():
        heights = path.at(step.position)
        trial = body.begin(step.dt, heights)
        alpha = trial.alpha
        now, before = (1.0 + step.growth) * moduli[1] / alpha, step.growth * moduli[0] / alpha
        loops.travel(last, earlier, now, before, heights.offset - cells, p)
        moduli, cells = [moduli[1], alpha], heights.offset
        contact = solver.solve(trial.effective, MeanPressure(step.load / (alpha * base.units.pressure)), p)
        found = ledger.measures(contact.p, alpha, contact.u, trial.effective, contact.d, step.position)
        body.commit(trial, contact.u)
        if isinstance(body, ZenerBody) and step.dt != dt:
            # The error budget looks at what the other integrator would have done, once for some steps that are alike.
            load, dt = found.pressure * slab.points / (alpha * base.units.pressure), step.dt
            pair = Embedded(slab, body, base.job.grid.dx / base.units.length)
            pair.look(step.dt, trial, contact.p, contact.u, load, found.contact_area)
        earlier, last, p = last, p, earlier
    return slab.tally.copy()


def bare_solver(base: scene.Frame) -> ContactSolver:
    operator, inverse = base.half_space.operator(base.fft), base.half_space.inverse(base.fft)
    return ContactSolver(base.slab, operator, inverse, base.height / base.units.height, 1e-15, ITERATIONS)


def test_elastic_static() -> None:
    """No branch map, no shift, no earlier pressure, no padding, no energy: exactly the solver's operator calls."""
    planned = job(history=[STAND, {"pressure": 4e3}])
    counts = whole(planned)
    assert counts == bare(planned)
    assert counts["operator"] == 2 * (1 + 2 * ITERATIONS)
    assert counts["shift"] == 0
    assert not any(
        effect.on for effect in scene.effects(planned) if effect.name not in ("surface spectrum", "checkpoints")
    )


@pytest.mark.parametrize("stage", [PRESS, SLIDE])
@pytest.mark.parametrize("material", [ELASTIC, RUBBER])
def test_lasting_stages(material: Json, stage: Json) -> None:
    """Only what is on: memory, whole cells, an earlier pressure."""
    planned = job(material=material, history=[stage])
    assert whole(planned) == lasting(planned)


@pytest.fixture
def iterations_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """How often the load is restored near by, which takes a message, and a step is made exact, which takes an operator
    call, depends on the pressures."""
    monkeypatch.setattr(contact_solver, "LEAST", math.inf)
    monkeypatch.setattr(contact_solver, "UNLIKE", math.inf)


# -- the rows of the table --------------------------------------------------------------------------------------------


def test_every_row_has_a_test() -> None:
    """By name, in ROWS or TESTED."""
    assert {effect.name for effect in scene.effects(job())} == {*ROWS, *TESTED}


FROZEN = {**RUBBER, "branches": [*RUBBER["branches"], {"modulus": 1e5, "relaxation_time": 1e6}]}
TRANSFORM = f"fft {NX}x{NY} float64"
ROWS: dict[str, tuple[Json, Json, dict[str, int] | None]] = {  # off, on, and what that counts more
    "viscoelasticity": (
        {"history": [PRESS]},
        {"history": [PRESS], "material": RUBBER},
        {
            "map bytes": 3 * MAP,
            "allreduce": 2,
        },  # branch, displacement, effective heights; 2 looks at 5 steps
    ),
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
        {"allreduce": 5, "map bytes": 3 * MAP},
    ),
    "mixed precision": (
        {},
        {"numerics": {"precision": "mixed"}},
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
    off, on, _ = ROWS["mixed precision"]
    assert [name for name in whole(job(**off)) if name.startswith("fft ")] == [TRANSFORM]
    assert whole(job(**on))[f"fft {NX}x{NY} float32"] == 2 * ITERATIONS


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
    assert begun(single).state.earlier is None
    assert extra(lasts, single) == {"map bytes": MAP}
    assert [row(planned, "extrapolated starts").on for planned in (single, lasts)] == [False, True]


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
    assert [march.chosen is None for march in marches] == [True, False]
    assert len({march.scene.slab.tally["map bytes"] for march in marches}) == 1


def test_steady_start() -> None:
    """Off: nothing is solved before the first step."""
    start = {"state": "steady", "velocity": 0.1, "pressure": 2e3}
    solved = {"tolerance": 1e-4, "max_iterations": 500}
    off, on = (job(history=[SLIDE], material=RUBBER, numerics=solved, **more) for more in ({}, {"initial": start}))
    assert begun(off).scene.slab.tally["operator"] == 0
    assert begun(on).scene.slab.tally["operator"] > 0
    assert [row(planned, "steady start").on for planned in (off, on)] == [False, True]


def test_displacement_control() -> None:
    """A reduction in each step tells whether the approach can be; off, there is none: see `test_elastic_static`."""
    planned = job(history=[{"approach": -5e-7}])
    assert row(planned, "displacement control").on
    assert not row(job(), "displacement control").on
    march = begun(planned)
    march.advance(next(iter(planned.timeline())))
    solver, slab = march.scene.solver, march.scene.slab
    spent = slab.tally["allreduce"]
    heights = march.scene.motion.at((0.0, 0.0)).base
    solver.solve(heights, Approach(-5e-7 / march.scene.units.height), slab.zeros())
    of_solve = slab.tally["allreduce"] - spent
    of_measures = 2
    before = begun(planned).scene.slab.tally["allreduce"]
    assert spent == before + 1 + of_solve + of_measures


# -- what is written --------------------------------------------------------------------------------------------------


@pytest.fixture
def run(tmp_path: Path) -> Callable[..., Path]:
    """Run a job, into a directory of its own."""

    def go(name: str, **changes: Any) -> Path:
        output = {**changes.pop("output", {}), "directory": str(tmp_path / name)}
        planned = job(history=[PRESS], output=output, **changes)
        planned._path = tmp_path / "job.yaml"
        planned.path.write_text(planned.resolved())
        assert runner.run(planned, Slab(MPI.COMM_SELF, NX, NY), runner.Options(quiet=True)) == journey.DONE
        return tmp_path / name

    return go


def test_fields(run: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """Off: no file, no byte, no map made for it; on: at their instants only, every third step and the last."""
    saved: list[int] = []
    save = fields.FieldsFile.save

    def noted(self: fields.FieldsFile, step: int, *args: Any) -> None:
        saved.append(step)
        save(self, step, *args)

    monkeypatch.setattr(fields.FieldsFile, "save", noted)
    off, on = run("off"), run("on", output={"fields": ["pressure"], "every": 3})
    assert not list(off.glob("fields*"))
    assert saved == [3, 5]
    with_maps = {path.name for path in on.iterdir()} - {path.name for path in off.iterdir()}
    assert with_maps == {"fields.h5", "fields.xdmf"}
    assert not row(job(), "fields").on
    assert row(job(output={"fields": ["gap"]}), "fields").on


def test_checkpoints(run: Callable[..., Path]) -> None:
    """The last step's always; others at their steps only."""
    names = sorted(path.stem for path in (run("last") / "checkpoint").iterdir())
    assert names == ["step-5"]
    often = run("often", checkpoint={"every": 2, "keep": 9})
    assert sorted(path.stem for path in (often / "checkpoint").iterdir()) == ["step-2", "step-4", "step-5"]


def test_dissipation_per_branch(run: Callable[..., Path]) -> None:
    """A column per branch where it is asked for and there are branches; energies alone have none, and no energies no
    numbers."""
    name = "dissipation per branch"
    off: Json = {}
    energies, on = {"energy": True}, {"energy": True, "branch_dissipation": True}
    assert [row(job(material=RUBBER, output=out), name).on for out in (off, energies, on)] == [False, False, True]
    assert not row(job(output=on), name).on
    found = [
        measures.read(run(str(n), material=RUBBER, output=out) / "measures.csv")
        for n, out in enumerate((off, energies, on))
    ]
    assert ["dissipated_0" in columns for columns in found] == [False, False, True]
    assert np.isnan(found[0]["work"]).all()
    assert not np.isnan(found[1]["work"]).any()


def test_run_on_half_the_mesh(run: Callable[..., Path]) -> None:
    """Only where it is asked for, and then no map more in the run itself."""
    name, found = "run on half the mesh", {}
    for mesh_check in (False, True):
        output = {"mesh_check": mesh_check}
        assert row(job(output=output), name).on == mesh_check
        out = run(str(mesh_check), output=output)
        assert (out / "half_mesh").exists() == mesh_check
        (found[mesh_check],) = re.findall(r"map bytes (\d+)", (out / "run.log").read_text())
    assert found[True] == found[False]


def test_counts_are_in_the_log(run: Callable[..., Path]) -> None:
    log = (run("logged") / "run.log").read_text()
    for name in ("allreduce", "fft", TRANSFORM, "map bytes", "operator"):
        assert f" {name} " in log


TESTED = {
    *(
        "isolated contact",
        "extrapolated starts",
        "chosen time steps",
        "rest cut short",
        "steady start",
        "displacement control",
        "dissipation per branch",
        "run on half the mesh",
    ),
    *("fields", "checkpoints", "interface"),  # the last in effects/test_interface.py
}

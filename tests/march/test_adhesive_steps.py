"""Steps of contacts that stick: restarts, ranks, jumps of the load, detachment."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from marched_jobs import column, marched
from numpy.testing import assert_allclose
from restarting import ELASTIC, ROUGH, ZENER, Bench, cut, rows, same

from parcontact import Simulation
from parcontact.effects.leakage.flow import leak
from parcontact.results import info

STICK = {"work": 0.05, "range": 1e-6}
PULL = {"name": "pull", "approach": {"from": 1e-6, "to": -2e-6}, "duration": 4e-4, "time_step": 1e-4}
LOAD = {"name": "load", "pressure": {"from": 2e3, "to": 1e3}, "duration": 3e-4, "time_step": 1e-4}
SLIDE = {"name": "slide", "pressure": 1e3, "velocity": [0.2, 0.1], "duration": 2e-4, "time_step": 1e-4}
OFF = {"name": "off", "force": {"from": 0.0, "to": -5e-3}, "duration": 1e-3, "time_step": 1e-4}
AGAIN = {"name": "again", "force": {"from": -5e-3, "to": 5e-3}, "duration": 1e-3, "time_step": 1e-4}
NEAR = {"name": "near", "approach": {"from": -6e-6, "to": -2e-6}, "duration": 3e-4, "time_step": 1e-4}
AWAY = {"name": "away", "approach": -8e-6, "velocity": [0.2, 0.1], "duration": 3e-4, "time_step": 1e-4}
CHOSEN = {"name": "chosen", "approach": {"from": 1e-6, "to": 5e-7}, "duration": 4e-4}
SCENES: dict[str, tuple[str, dict[str, Any]]] = {
    "rough": ("viscoelastic", {"history": [LOAD, SLIDE]}),
    "free": ("free", {"history": [PULL, {**SLIDE, "name": "slide on"}]}),
    "off": ("free", {"history": [OFF]}),
    "open": ("free", {"history": [OFF, AGAIN], "adhesion": {**STICK, "detached": "open"}}),
    "snaps": ("elastic", {"history": [NEAR, AWAY], "adhesion": {"work": 0.5, "range": 1e-6}}),
    "chosen": ("free", {"history": [CHOSEN], "numerics": {"accuracy": 0.2}}),
}


def adhesive(bench: Bench, name: str) -> dict[str, Any]:
    scene, changes = SCENES[name]
    return bench.job(scene, **{"adhesion": STICK, **changes})


@pytest.mark.mpi(2, 3)
@pytest.mark.parametrize("name", SCENES)
def test_cut_in_the_middle(bench: Bench, name: str) -> None:
    """What a run makes after a restart is what it makes at once, to the last bit; also where it detaches."""
    whole = bench.where / "whole"
    assert bench.run(adhesive(bench, name), whole) == 0
    total = len(rows(whole)) - 1
    part = cut(bench, whole, total // 2)
    assert bench.run(adhesive(bench, name), part) == 0
    if bench.comm.rank == 0:
        same(whole, part, total)


@pytest.mark.parametrize("control", ["approach", "pressure"])
@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_conditions_of_contact(boundary: str, control: str) -> None:
    """`p = c - sigma(g)`: the gap is not negative; where it is open, p is minus the attraction to the tolerance, which
    bounds what is wrong with the gap over the range; where it is closed, p is not less than that."""
    grid = {"points": 32, "size": 4e-4, "boundary": boundary}
    history = [{"approach": -5e-7, "pressure": 50.0}[control]]
    job = {"grid": grid, "surface": {"shape": "sphere", "radius": 1e-3}, "material": ELASTIC, "adhesion": STICK}
    march, _ = marched({**job, "history": [{control: history[0]}], "numerics": {"tolerance": 1e-6}})
    p, gap, strength = march.field("pressure"), march.field("gap"), 0.05 / 1e-6
    touching = gap <= 1e-14
    assert 0 < touching.sum() < 200
    assert gap.min() > -1e-14  # rounding of lengths of 1e-6 to 1e-4
    assert p[touching].min() >= -strength * (1.0 + 1e-6)
    assert_allclose(p[~touching], -strength * np.exp(-gap[~touching] / 1e-6), atol=1e-3 * strength)
    assert march.row.measures.contact_area == touching.sum() / touching.size


def test_detached(bench: Bench) -> None:
    """Under a force of which no part holds the run ends, with exit code 0, and says when; going on says it too."""
    out = bench.where / "out"
    data = adhesive(bench, "off")
    assert bench.run(data, out) == 0
    last = len(rows(out)) - 1
    assert 0 < last < 10
    assert "detached at t = " in (out / "run.log").read_text()
    assert "detached at t = " in info.describe_files(out)[0]
    assert bench.run(data, out) == 0
    assert len(rows(out)) - 1 == last


@pytest.mark.mpi(2)
def test_detached_state_from_python(bench: Bench) -> None:
    """After a second run, and after a restore, the run is over for the same reason; it goes on with another load."""
    data, out = adhesive(bench, "off"), str(bench.where / "out")
    first, second = (Simulation(data, {"output.directory": out}, bench.comm) for _ in range(2))
    rows = [run.run() for run in (first, second)]
    last = max(bench.where.glob("out/checkpoint/step-*.h5"))
    back = Simulation.restore(last, comm=bench.comm)
    assert "the surfaces detach" in first.detached
    assert [run.detached for run in (second, back)] == [first.detached] * 2
    assert (second.finished, back.finished, list(back.steps())) == (True, True, [])
    assert repr(rows[1]) == repr(back.row)
    held = {**OFF, "force": {"from": 0.0, "to": -5.0 * back.row.time}, "duration": back.row.time}
    other = Simulation.restore(last, {"history": [held, {"name": "rest", "approach": 0.0}]}, bench.comm)
    assert (other.detached, other.finished, other.run().step) == ("", False, rows[0].step + 1)


def test_a_wave_that_fills_its_free_box_comes_off() -> None:
    """Near a snap the passes of a free body cycle between two states, unless they are made on a stiffer one. The
    contact ends in long steps where it does in short ones, to a long step."""
    surface, grid = {"shape": "wave", "amplitude": 1.8e-7, "waves": [1, 0]}, {"points": 32, "size": 4.5e-5}
    job = {"grid": {**grid, "boundary": "free"}, "surface": surface, "material": ELASTIC}
    job["adhesion"] = {"work": 4e-3, "range": 9e-8}
    ends = []
    for count in (10, 30):
        pull = {"approach": {"from": -3e-7, "to": -3.6e-7}, "duration": 1.0, "time_step": 1.0 / count}
        _, found = marched({**job, "history": [{"approach": -3e-7}, pull]})
        areas = column(found, "contact_area")
        assert areas[1] > 0.1
        ends.append(column(found, "approach")[1:][areas[1:] == 0.0][0])
    assert abs(ends[0] - ends[1]) < 6.1e-9


def test_a_sphere_in_a_large_box_comes_off_under_a_force() -> None:
    """Nothing but the attraction of the contact holds the box beyond the pull-off, 0.26 mN. Steps that took mean values
    to be as stiff as under an approach needed 1081 iterations for the way off; 92 are left."""
    grid, force = {"points": 64, "size": 6e-4}, {"force": {"from": 0.0, "to": -4e-4}, "duration": 1.0, "time_step": 0.1}
    job = {"grid": grid, "surface": {"shape": "sphere", "radius": 1e-3}, "material": ELASTIC}
    job["adhesion"] = {"work": 0.05, "range": 1e-6, "detached": "open"}
    _, found = marched({**job, "history": [{"force": 0.0}, force]})
    assert not column(found, "contact_area")[-4:].any()
    assert max(row.iterations for row in found) < 150


def test_no_adhesion_costs_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A job without the section makes no solver of gaps, no operators for it and no memory of gaps, and calls nothing
    of them; it holds what its plan tells, to the byte, which has no map of theirs."""
    from parcontact.door import memory
    from parcontact.job import Job

    def refuse(*given: Any, **named: Any) -> None:
        raise AssertionError("called without an adhesion section")

    places = ["effects.adhesion.gap_solver.GapSolver.__init__", "physics.halfspace.HalfSpace.gap_operators"]
    places += ["effects.adhesion.effect.advance_energies"]
    places += [
        f"effects.adhesion.adhesive_law.AdhesiveLaw.{name}" for name in ("__init__", "at_rest", "solve", "motion")
    ]
    for place in places:
        monkeypatch.setattr(f"parcontact.{place}", refuse)
    grid, history = {"points": [20, 14], "size": [1e-3, 7e-4]}, [{**LOAD, "pressure": 2e3}, SLIDE]
    job = {"grid": grid, "surface": ROUGH, "material": ZENER, "history": history, "output": {"energy": True}}
    planned = Job.model_validate(job)
    march, _ = marched(planned)
    assert march.scene.law is None
    assert march.state.law is None
    assert not [name for name in march.entries() if name.startswith(("law", "adhesion"))]
    assert march.scene.slab.tally["map bytes"] == memory.total_bytes(planned)
    with pytest.raises(AssertionError, match="without an adhesion section"):
        marched({**job, "adhesion": STICK})


def test_energies_of_a_reversible_contact() -> None:
    """A sphere in contact is pressed and let go: the work is the integral of force over approach, by the trapezoidal
    rule of two steps extrapolated (points come into contact one by one, which leaves 2e-4 on this grid), the loop loses
    less than 1e-3 of w a^2, and work is what is stored and in the surfaces; the jump into contact is a snap."""
    sums = []
    for count in (16, 32):
        press = {"approach": {"from": 4e-7, "to": 1e-6}, "duration": 1.0, "time_step": 1.0 / count}
        back = {"approach": {"from": 1e-6, "to": 4e-7}, "duration": 1.0, "time_step": 1.0 / count}
        grid = {"points": 32, "size": 4e-4, "boundary": "free"}
        job = {"grid": grid, "surface": {"shape": "sphere", "radius": 1e-3}, "material": ELASTIC, "adhesion": STICK}
        job |= {"history": [{"approach": 4e-7}, press, back], "output": {"energy": True}}
        _, found = marched({**job, "numerics": {"tolerance": 1e-6}})
        work, stored = column(found, "work"), column(found, "stored")
        surfaces, lost = np.array([row.added[2:4] for row in found[1:]]).T
        assert_allclose(work[1:], stored[1:] + surfaces + lost, rtol=1e-12)
        assert lost[0] > 0.0
        assert_allclose(lost, lost[0], rtol=1e-12)
        force, way = column(found, "pressure") * 1.6e-7, np.diff(column(found, "approach"))
        steps = (0.5 * (force[1:] + force[:-1]) * way)[1:]
        assert abs(steps.sum()) < 1e-3 * 0.05 * 5.6e-5**2
        sums.append(steps[:count].sum())
    energy = work[1 + count] - work[1]
    assert_allclose((4.0 * sums[1] - sums[0]) / 3.0, energy, rtol=5e-4)


def test_chosen_steps_follow_the_edge() -> None:
    """A rubber sphere is pressed and pulled off in steps that the run chooses: the edge moves by half a process zone at
    most, but where the contact snaps, across which no error is stated. In cells that edge is `front_of` of the points
    that change; steps that are chosen may exceed it by 1.19^(1/1.7), as errors may."""
    rubber = {**ZENER, "branches": [{"modulus": 9e6, "relaxation_time": 1.0}]}
    stages = [{"approach": {"from": -1e-6, "to": 1e-6}, "duration": 4.0}]
    stages.append({"approach": {"from": 1e-6, "to": -2e-6}, "duration": 4.0})
    grid = {"points": 32, "size": 4e-4, "boundary": "free"}
    job = {"grid": grid, "surface": {"shape": "sphere", "radius": 1e-3}, "material": rubber, "history": stages}
    _, found = marched({**job, "adhesion": {"work": 0.05, "range": 6e-7}})
    assert found[-1].time == 8.0
    areas = column(found, "contact_area")
    zone, cell = 4e6 * 6e-7**2 / 0.05, 4e-4 / 32
    radius = np.sqrt(areas * 32**2 / np.pi) * cell
    moved = np.abs(np.diff(radius)) / (0.5 * zone)
    snapped = np.array([row.errors is None for row in found[1:]])
    assert 0.1 < moved[(areas[:-1] > 0.01) & ~snapped].max() < 1.5


def test_a_load_of_zero_has_no_friction_and_shortens_no_step(tmp_path: Path) -> None:
    """Rough surfaces that a load of zero presses touch at a point, whose force is the solver's error. Of that no
    friction is made (1e5 of loads of 1e-16 Pa if it were), and no step follows it: fewer than 200 pass the
    box, and more than 600 if steps followed the differences of such forces."""
    np.save(tmp_path / "road.npy", 1e-6 * np.random.default_rng(0).standard_normal((16, 16)))
    branches = [{"modulus": 1e7, "relaxation_time": 1e-3}, {"modulus": 1e7, "relaxation_time": 0.1}]
    press = {"approach": -2e-6, "duration": 1e-3, "time_step": 2.5e-4}
    job = {
        "grid": {"points": 16, "size": 1e-3},
        "surface": {"shape": "file", "path": str(tmp_path / "road.npy")},
        "material": {"model": "zener", "modulus_inf": 1e6, "branches": branches},
        "adhesion": {"work": 1e-3, "law": "dugdale"},
        "numerics": {"accuracy": 0.1},
        "history": [press, {"pressure": 0.0, "velocity": 0.01, "distance": 1e-3}],
    }
    _, made = marched(job)
    slid = [row.measures for row in made if row.distance > 0.0]
    assert 1 < len(slid) < 200
    assert any(measures.contact_area > 0.0 for measures in slid)
    assert all(measures.friction == 0.0 for measures in slid)


def test_a_fluid_flows_where_the_gap_is_open() -> None:
    """Contacts that stick are closed where their gap is 0, whatever the pressure: the flow of a run is that through the
    map of gaps, to the solver's tolerance; it rises when the sphere is pulled off."""
    grid = {"points": 24, "size": 3e-4, "boundary": "free"}
    history = [{"approach": {"from": 1e-6, "to": -3e-6}, "duration": 1.0, "time_step": 0.25}]
    job = {"grid": grid, "surface": {"shape": "sphere", "radius": 1e-3}, "material": ELASTIC, "adhesion": STICK}
    march, made = marched({**job, "leakage": {"every": 1}, "history": history})
    found = leak(march.field("gap"), (3e-4, 3e-4), periodic=False)
    flows = [row.added[-3] for row in made if row.step]
    assert flows[-1] == pytest.approx(found.flow_x, rel=1e-3)
    assert 0.0 < flows[0] < flows[-1]

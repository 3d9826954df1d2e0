"""What Python code may pass by mistake ends in a sentence, before anything is computed."""

import copy
import pickle
import re
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from mpi4py import MPI

import parcontact as pc
from parcontact.march.steady import SteadySliding

from .test_simulation import JOB

BALL: dict[str, Any] = {
    "grid": {"points": 8, "size": 1e-3},
    "surface": {"shape": "wave", "amplitude": 1e-6, "waves": [1, 0]},
    "material": {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]},
    "history": [
        {"pressure": 1e3, "duration": 1e-3, "time_step": 2.5e-4},
        {"pressure": 1e3, "velocity": 0.1, "distance": 5e-4, "cells_per_step": 1},
    ],
}


def simulation(job: Any = BALL, set: Any = None) -> pc.Simulation:
    return pc.Simulation(job, set, MPI.COMM_SELF)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: simulation(None), "the job must be the path of a file or a mapping, got None"),
        (lambda: simulation(BALL, {5: 1}), "set has a key that is not a text, 5"),
        (lambda: simulation(BALL, 5), "set must be a mapping of keys and values, got 5"),
        (lambda: pc.steady(BALL, "abc"), "velocities must be a number, a list of numbers or a range .* got 'abc'"),
        (lambda: pc.steady(BALL, [None]), r"velocities must be a number.* got \[None\]"),  # type: ignore[list-item]
        (lambda: pc.steady(BALL, 1j), "velocities must be a number.* got 1j"),  # type: ignore[arg-type]
        (lambda: pc.steady(BALL, 1.0, temperatures="20"), "temperatures must be a number, a list of numbers, got '20'"),
        (lambda: pc.steady(BALL, 1.0, set=5), "set must be a mapping"),  # type: ignore[arg-type]
    ],
)
def test_mistakes_of_jobs(call: Callable[[], Any], said: str) -> None:
    with pytest.raises(pc.JobError, match=f"^{said}"):
        call()


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: simulation().save(None), "a path must be a text or a pathlib.Path, got None"),  # type: ignore[arg-type]
        (lambda: pc.Simulation.restore(5), "a path must be a text"),  # type: ignore[arg-type]
        (lambda: pc.open(None), "a path must be a text"),  # type: ignore[arg-type]
        (lambda: pc.Simulation(BALL, comm=5), "comm must be a communicator of mpi4py, got 5"),  # type: ignore[arg-type]
    ],
)
def test_other_mistakes(call: Callable[[], Any], said: str) -> None:
    with pytest.raises(pc.InputError, match=f"^{said}"):
        call()


@pytest.mark.parametrize("name", ["", ".", "..", "there", "there/"])
def test_a_state_is_saved_to_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """No directory is renamed for it, and nothing is left."""
    monkeypatch.chdir(tmp_path)
    Path("there").mkdir()
    with pytest.raises(pc.InputError, match=r"is a directory: give the name of a file in it"):
        simulation().save(name)
    assert list(tmp_path.iterdir()) == [tmp_path / "there"]


@pytest.mark.parametrize("name", ["a\0b.h5", "\ud800.h5"])
@pytest.mark.parametrize("act", [lambda name: simulation().save(name), pc.Simulation.restore, pc.open])
def test_names_that_no_file_has(act: Callable[[str], Any], name: str) -> None:
    with pytest.raises(pc.InputError, match="a path must be a name that the file system can store, got "):
        act(name)


def test_a_state_in_a_missing_directory(tmp_path: Path) -> None:
    """The sentence has the name that was given, not a temporary one."""
    with pytest.raises(pc.RunError, match=r"^cannot create .*missing/state\.h5: No such file or directory$"):
        simulation().save(tmp_path / "missing" / "state.h5")


def test_half_a_surrogate_pair_in_a_key() -> None:
    """The sentence can be printed and written."""
    with pytest.raises(pc.JobError, match="is not a known key") as said:
        simulation(BALL, {"output.\ud800": 1})
    assert str(said.value).encode()


def test_run_again_and_in_a_thread(tmp_path: Path) -> None:
    """A run that was stopped goes on when it is called again; one that has finished says the same again."""
    stopped = simulation(BALL, {"output.directory": str(tmp_path / "out")})
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "stop").touch()
    with ThreadPoolExecutor(1) as threads:
        assert threads.submit(stopped.run).result().step == 0
    ends = [stopped.finished]
    rows = [stopped.run() for _ in range(2)]
    assert [*ends, stopped.finished] == [False, True]
    assert rows[0].step > 0
    assert rows[0].friction == rows[1].friction
    steps = simulation(BALL, {"output.directory": str(tmp_path / "other")})
    next(steps.steps())
    with pytest.raises(pc.InputError, match="must come before the first of steps"):
        steps.run()


SWEPT = {**BALL, "sweep": [{"surface.amplitude": [1e-6, 2e-6]}]}


def test_advice_in_the_words_of_python(tmp_path: Path) -> None:
    """Arguments and keys, where the command line has options."""
    ours = {"output.directory": str(tmp_path / "ours")}
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").touch()
    simulation(BALL, ours).run()
    advice: dict[str, Callable[[], Any]] = {
        'give restart="never" to start from the beginning, or output.directory for another': lambda: simulation(
            BALL, {**ours, "surface.amplitude": 3e-6}
        ).run(),
        "give restart=PATH to continue from an earlier": lambda: simulation(
            BALL, {**ours, "history.0.pressure": 3e4}
        ).run(),
        "it has mine; give another output.directory, or restart=": lambda: simulation(
            BALL, {"output.directory": str(tmp_path / "full")}
        ).run(),
        'leave it out (set={"sweep": None})': lambda: simulation(SWEPT),
        'leave the sweep out (set={"sweep": None})': lambda: simulation(SWEPT, {"surface.amplitude": 3e-6}),
        "no velocities: give velocities [m/s], or": lambda: pc.steady(BALL, comm=MPI.COMM_SELF),
    }
    for words, call in advice.items():
        with pytest.raises(pc.InputError, match=re.escape(words)) as said:
            call()
        assert "--" not in str(said.value)
        assert "--" not in "".join(getattr(said.value, "mistakes", []))


def test_more_points_than_any_machine_holds() -> None:
    """Refused when they are asked for, not when the first map is made."""
    grid = {"points": 2_000_000, "size": 1.0}
    calls: list[Callable[[], Any]] = [
        lambda: simulation({**BALL, "grid": grid}),
        lambda: pc.steady({**BALL, "grid": grid}, 1.0, comm=MPI.COMM_SELF),
        lambda: pc.surface(BALL["surface"], grid),
    ]
    for call in calls:
        with pytest.raises(pc.InputError, match=r"2000000 x 2000000 points need .* use fewer points"):
            call()


@pytest.mark.parametrize("act", [pickle.dumps, copy.copy, copy.deepcopy])
def test_a_simulation_is_saved_not_pickled(act: Callable[[Any], Any]) -> None:
    run = simulation()
    next(run.steps())
    with pytest.raises(TypeError, match=r"cannot be pickled or copied: .* use save\(path\)"):
        act(run)
    assert pickle.loads(pickle.dumps(run.row)).step == 0


@pytest.mark.mpi
def test_a_saved_state_has_the_sums_of_the_budget(comm: MPI.Intracomm, shared_path: Any) -> None:
    """The budget at the end is that of the whole slide, to the last digit, as without a stop; also of a saved one."""
    changes = {"surface.waves": [1, 1], "history.0.pressure": 2e4, "history.1.pressure": 2e4}  # spots of several cells
    whole = pc.Simulation(BALL, changes, comm=comm)
    whole.run()
    run = pc.Simulation(BALL, changes, comm=comm)
    for row in run.steps():
        if row.step == 5:
            break
    for _ in range(2):
        run.save(shared_path / "state.h5")
        run = pc.Simulation.restore(shared_path / "state.h5", comm=comm)
    run.run()
    sums = whole._march.state.errors.sums
    assert run._march.state.errors.sums.tolist() == sums.tolist()
    assert sums[1, 0] == pytest.approx(5e-4, rel=1e-9)  # the way [m], added step by step


# -- warnings are those of Python: of the line of the script, whether a run writes files or not -----------------------


def test_warnings_are_those_of_python() -> None:
    """A slope beyond linear theory: the surface is steep, as the command line says. The stated error of the area in
    steady sliding, 50 % on so few points, is below the accuracy and gives no warning of its own."""
    steep = {**JOB, "surface": {"shape": "wave", "amplitude": 1e-4, "waves": [2, 1]}}
    with pytest.warns(pc.ParcontactWarning, match="slope") as said:
        next(pc.Simulation(steep, comm=MPI.COMM_SELF).steps())
    with pytest.warns(pc.ParcontactWarning, match="slope") as also:
        pc.steady({**steep, "numerics": {"accuracy": 0.6}}, 0.1, 1e6, comm=MPI.COMM_SELF)
    assert {warning.filename for warning in [*said, *also]} == {__file__}


def test_a_line_warns_once_of_each_problem() -> None:
    """Python shows a warning once for each line; calls in a fit differ in the numbers of their warnings alone."""
    steep = {**JOB, "surface": {"shape": "wave", "amplitude": 1e-4, "waves": [2, 1]}}

    def calls(action: Literal["default", "always", "ignore"]) -> list[pc.ParcontactWarning]:
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter(action, pc.ParcontactWarning)
            for amplitude in (1e-4, 1.5e-4, 2e-4):
                next(pc.Simulation(steep, {"surface.amplitude": amplitude}, MPI.COMM_SELF).steps())
        return [one.message for one in said if isinstance(one.message, pc.ParcontactWarning)]

    every = [one for one in calls("always") if one.kind == "steep"]
    slope = 2 * np.pi * np.hypot(2 / 1e-3, 1 / 7.5e-4) / np.sqrt(2)  # rms, of a wave of unit amplitude
    assert [one.numbers["slope"] for one in every] == pytest.approx([slope * a for a in (1e-4, 1.5e-4, 2e-4)])
    assert [one.place for one in every] == ["surface"] * 3
    assert len({"".join(str(one)) for one in every}) == 3
    once = [one.kind for one in calls("default")]
    assert len(once) == len(set(once)) > 0
    assert calls("ignore") == []
    again = pickle.loads(pickle.dumps(every[0]))
    assert (str(again), again.kind, again.numbers) == (str(every[0]), "steep", every[0].numbers)


def test_points_that_fail_warn_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """The sentence is that of `failures`; it has the category of all warnings."""

    def fail(sliding: SteadySliding, velocity: tuple[float, float], pressure: float) -> None:
        raise pc.RunError(f"no solution at {velocity[0]:g} m/s")

    monkeypatch.setattr(SteadySliding, "solve", fail)
    with pytest.warns(pc.ParcontactWarning, match="no solution") as said:
        curve = pc.steady(JOB, [0.1, 0.2], 1e3, comm=MPI.COMM_SELF)
    assert [str(one.message) for one in said] == list(curve.failures) == [f"no solution at 0.{n} m/s" for n in (1, 2)]
    assert np.isnan(curve.friction).all()

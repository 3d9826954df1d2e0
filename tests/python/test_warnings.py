"""Warnings are those of Python: of the line of the script, whether a run writes files or not."""

from pathlib import Path

import pytest
from mpi4py import MPI

import parcontact as pc

from .test_simulation import JOB


def test_warnings_are_those_of_python() -> None:
    """A slope beyond linear theory: the surface is steep, as the command line says."""
    steep = {**JOB, "surface": {"shape": "wave", "amplitude": 1e-4, "waves": [2, 1]}}
    with pytest.warns(UserWarning, match="slope") as said:
        next(pc.Simulation(steep, comm=MPI.COMM_SELF).steps())
    with pytest.warns(UserWarning, match="slope") as also:
        pc.steady({**steep, "numerics": {"accuracy": 0.1}}, 0.1, 1e6, comm=MPI.COMM_SELF)
    assert {warning.filename for warning in [*said, *also]} == {__file__}


def test_warnings_of_a_run_with_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """They are those of a run in memory, of its surface and of its contact, and are in run.log; none is printed."""
    odd = {**JOB, "grid": {**JOB["grid"], "boundary": "free"}, "surface": {"shape": "sphere", "radius": 0.1}}
    told = []
    for files in ({}, {"output.directory": str(tmp_path / "here")}):
        with pytest.warns(UserWarning, match="the box") as said:
            pc.Simulation(odd, files, MPI.COMM_SELF).run()
        told.append([str(warning.message) for warning in said])
        assert {warning.filename for warning in said} == {__file__}
    assert told[0] == told[1]
    assert "reaches the edge of the box" in told[0][-1]
    log = (tmp_path / "here" / "run.log").read_text()
    assert all(f"warning: {text}" in log for text in told[0])
    assert "warning" not in capsys.readouterr().err

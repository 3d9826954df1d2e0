"""Several programs on the cases of one sweep: a job array, or the same command given twice."""

import fcntl
import threading
from pathlib import Path

import pytest
from test_sweeps import cases_in_groups, table

from parcontact.__main__ import main
from parcontact.record import directory, sweep_table


def test_a_case_that_another_program_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is passed over, and has not failed; if it is the only one, the command is refused like a single run's."""
    cases, _ = cases_in_groups(tmp_path, monkeypatch)
    monkeypatch.setattr(directory, "MAX_SECONDS_TO_RELEASE", 0.1)
    where = cases[1].job.output.directory
    where.mkdir(parents=True)
    with (where / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert main(["job.yaml", "--quiet"]) == 0
        in_use = f"the output directory {where} is in use by another run (just started)\n"
        assert capsys.readouterr().err == f"parcontact: case 1 is being run by another program: {in_use}"
        assert [row["state"] for row in table()] == ["done", "-", *["done"] * 4]
        assert main(["job.yaml", "--quiet", "--case", "1"]) == 2
        assert capsys.readouterr().err == f"parcontact: {in_use}"
    assert main(["job.yaml", "--quiet"]) == 0
    assert {row["state"] for row in table()} == {"done"}


def test_tables_are_written_by_one_program_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Jobs of an array end together: the last one to write has read what all others left."""
    cases, _ = cases_in_groups(tmp_path, monkeypatch)
    out = Path("out/job")
    sweep_table.write(out, cases)
    with (out / ".sweep.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        other = threading.Thread(target=sweep_table.write, args=(out, cases))
        other.start()
        other.join(0.2)
        assert other.is_alive()
        fcntl.flock(lock, fcntl.LOCK_UN)
        other.join(20.0)
        assert not other.is_alive()

"""What a run writes where it is asked for, and that nothing is made for it elsewhere."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from counting import NX, NY, PRESS, RUBBER, TRANSFORM, Json, job, row

from parcontact.files import run as runner
from parcontact.files import tables
from parcontact.files.stopping import Options
from parcontact.job.parts import Origin
from parcontact.parallel.slab import Slab


@pytest.fixture
def run(tmp_path: Path) -> Callable[..., Path]:
    """Run a job, into a directory of its own."""

    def go(name: str, **changes: Any) -> Path:
        output = {**changes.pop("output", {}), "directory": str(tmp_path / name)}
        planned = job(history=[PRESS], output=output, **changes).with_origin(Origin(tmp_path / "job.yaml"))
        planned.path.write_text(planned.resolved())
        assert runner.run_job(planned, Slab.alone(NX, NY), Options(quiet=True)) == 0
        return tmp_path / name

    return go


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
        tables.read_columns(run(str(n), material=RUBBER, output=out) / "measures.csv")
        for n, out in enumerate((off, energies, on))
    ]
    assert ["dissipated_0" in columns for columns in found] == [False, False, True]
    assert np.isnan(found[0]["work"]).all()
    assert not np.isnan(found[1]["work"]).any()


def test_counts_are_in_the_log(run: Callable[..., Path]) -> None:
    log = (run("logged") / "run.log").read_text()
    for name in ("allreduce", "fft", TRANSFORM, "map bytes", "operator"):
        assert f" {name} " in log

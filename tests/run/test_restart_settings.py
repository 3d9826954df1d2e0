"""Which settings a run may change when it goes on, and which are refused."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from mpi4py import MPI
from restarting import ELASTIC, FASTER, PRESS, ROUGH, SLIDE, TOUCH, Bench, cut, part_way, rows

from parcontact.errors import InputError
from parcontact.storage import checkpoint

REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"grid": {"points": [20, 16]}}, "grid.points was [20, 14], is [20, 16]"),
    ({"grid": {"size": [2e-3, 7e-4]}}, "grid.size was [0.001, 0.0007], is [0.002, 0.0007]"),
    ({"surface": {"seed": 4}}, "surface.0.seed was 3, is 4"),
    ({"surface": {**ROUGH, "rms_slope": None, "rms_height": 1e-6}}, "surface.0.rms_slope was 0.02, is None"),
    ({"material": {"modulus_inf": 2e6}}, "material.modulus_inf was 1000000.0, is 2000000.0"),
    ({"material": ELASTIC}, "material.model was zener, is elastic"),
    ({"body": {"thickness": 1e-3}}, "body.thickness was None, is 0.001"),
    ({"numerics": {"integrator": "backward-euler"}}, "numerics.integrator was exponential, is backward-euler"),
    ({"numerics": {"kernel": "love"}}, "numerics.kernel was spectral, is love"),
    ({"numerics": {"precision": "mixed"}}, "numerics.precision was double, is mixed"),
    (
        {"history": [{**PRESS, "pressure": 2e5}, SLIDE, FASTER]},
        "step 1 of the 6 already made had pressure 100000.0, has pressure 200000.0",
    ),
    (
        {"history": [PRESS, {**SLIDE, "velocity": 0.3}, FASTER]},
        "step 6 of the 6 already made ended at t = 0.00125 s, ends at 0.00116666",
    ),
    ({"history": [PRESS]}, "step 6 of the 6 already made ended at t = 0.00125 s, ends at 0.0015"),
    ({"history": [TOUCH]}, "6 steps were made, and the job has 1 up to t = 0.00125 s"),
]


@pytest.fixture(scope="module")
def stopped(tmp_path_factory: pytest.TempPathFactory) -> tuple[Bench, Path]:
    """A run that was stopped after its sixth step, and where it is."""
    bench = Bench(MPI.COMM_SELF, tmp_path_factory.mktemp("stopped"))
    return bench, part_way(bench, bench.job("viscoelastic"))


@pytest.mark.parametrize(("changes", "message"), REFUSED)
def test_refused(stopped: tuple[Bench, Path], changes: dict[str, Any], message: str) -> None:
    """Another problem, or another past: both values are shown, and nothing is written."""
    bench, out = stopped
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    with pytest.raises(InputError) as raised:
        bench.run(bench.job("viscoelastic", **changes), out)
    assert message in str(raised.value)
    assert "give --restart never to start afresh" in str(raised.value)
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_other_settings(bench: Bench) -> None:
    """Tolerance, outputs, checkpoints and what is still to come may change; measures go on with the new columns."""
    out = part_way(bench, bench.job("viscoelastic"))
    changes = {
        "title": "another",
        "numerics": {"tolerance": 1e-6},
        "output": {"fields": ["gap"], "every": 4, "branch_dissipation": False},
        "checkpoint": {"every": 100, "keep": 1},
        "history": [PRESS, SLIDE, {**SLIDE, "name": "back", "velocity": -0.2}, TOUCH],
    }
    changed = bench.job("viscoelastic", **changes)
    assert bench.run(changed, out) == 0
    assert bench.run(changed, bench.where / "afresh") == 0
    found, afresh, old = rows(out), rows(bench.where / "afresh"), rows(bench.where / "whole")
    assert [row["step"] for row in found] == [row["step"] for row in afresh]
    assert found[:7] == [{key: row[key] for key in found[0]} for row in old[:7]]
    assert float(found[-1]["friction"]) == pytest.approx(float(afresh[-1]["friction"]), rel=0.05)
    with h5py.File(out / "fields.h5") as file:
        assert file["step"][...].tolist() == [*range(1, 7), 8, 12, len(found) - 1]
        assert np.isnan(file["gap"][6:]).sum() == 0
    assert [path.name for path in (out / "checkpoint").iterdir()] == [f"step-{len(found) - 1}.h5"]
    contents = checkpoint.inspect(out / "checkpoint" / f"step-{len(found) - 1}.h5")
    assert [(link.from_step, "another" in link.job) for link in contents.chain] == [(0, False), (6, True)]


def test_later_energies(bench: Bench) -> None:
    """Energies count from the start: they cannot begin half-way, but they can end there."""
    silent = {"energy": False, "branch_dissipation": False}
    out = part_way(bench, bench.job("viscoelastic", output=silent))
    with pytest.raises(InputError, match=r"does not have energy/.*: output\.energy was off"):
        bench.run(bench.job("viscoelastic"), out)
    other = cut(bench, bench.where / "whole", 6)
    assert bench.run(bench.job("viscoelastic", output=silent), other) == 0


def test_surface_file(bench: Bench) -> None:
    """A file of heights may move, but not change."""
    heights = 1e-6 * np.random.default_rng(0).random((14, 20))
    np.save(bench.where / "heights.npy", heights)
    surface = {"shape": "file", "path": str(bench.where / "heights.npy")}
    out = part_way(bench, bench.job("viscoelastic", surface=[surface]))
    np.save(bench.where / "moved.npy", heights)
    moved = bench.job("viscoelastic", surface=[{**surface, "path": str(bench.where / "moved.npy")}])
    np.save(bench.where / "heights.npy", 2 * heights)
    with pytest.raises(InputError, match=r"surface\.0\.content was .*, is "):
        bench.run(bench.job("viscoelastic", surface=[surface]), out)
    assert bench.run(moved, out) == 0

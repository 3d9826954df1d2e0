"""From which checkpoint a run goes on, and which are kept."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from restarting import Bench, maps, part_way, rows, same

from parcontact.errors import InputError


def damage(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[-9] ^= 4
    path.write_bytes(data)


def newer(path: Path) -> None:
    path.write_bytes(path.read_bytes().replace(b"format 2", b"format 3", 1))


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:5000])


def of_another_job(path: Path) -> None:
    shutil.copy(path.parents[2] / "other" / "checkpoint" / path.name, path)


FAULTS = [
    (damage, "is damaged"),
    (newer, "written by a newer parcontact"),
    (truncate, "is damaged: it has 5000 bytes instead of"),
    (of_another_job, "belongs to another job: surface.0.seed was 4, is 3"),
]


@pytest.mark.parametrize(("fault", "message"), FAULTS)
def test_falls_back(
    bench: Bench, capfd: pytest.CaptureFixture[str], fault: Callable[[Path], None], message: str
) -> None:
    """A checkpoint that will not do is passed over with one message; without a good one nothing is done."""
    data = bench.job("viscoelastic")
    bench.run(bench.job("viscoelastic", surface={"seed": 4}), bench.where / "other")
    out, whole = part_way(bench, data), bench.where / "whole"
    bad = [out / "checkpoint" / f"step-{step}.h5" for step in (5, 6)]
    for path in bad:
        fault(path)
    capfd.readouterr()
    assert bench.run(data, out) == 0
    warnings = [line for line in capfd.readouterr().err.splitlines() if "passed over" in line]
    assert len(warnings) == 2
    assert all(message in line and str(path) in line for line, path in zip(warnings, reversed(bad), strict=True))
    same(whole, out, len(rows(whole)) - 1)
    for path in (out / "checkpoint").glob("step-*.h5"):
        fault(path)
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    with pytest.raises(InputError) as raised:
        bench.run(data, out)
    assert message in str(raised.value)
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_restart_never(bench: Bench) -> None:
    data = bench.job("viscoelastic")
    out = part_way(bench, data)
    (out / "checkpoint" / "step-99.h5").write_bytes(b"")
    assert bench.run(data, out, restart="never") == 0
    same(bench.where / "whole", out, len(rows(out)) - 1)
    assert not (out / "checkpoint" / "step-99.h5").exists()


def test_restart_from_a_path(bench: Bench) -> None:
    """From an earlier checkpoint of the same directory, whose later ones are put aside; or from another directory."""
    data, whole = bench.job("viscoelastic"), bench.where / "whole"
    out = part_way(bench, data)
    total = len(rows(whole)) - 1
    assert bench.run(data, out, restart=str(out / "checkpoint" / "step-3.h5"), until=0.0007) == 0
    assert [row["step"] for row in rows(out)] == ["0", "1", "2", "3", "4", "5"]
    aside = sorted(path.name for path in (out / "checkpoint").glob("*.aside"))
    assert aside == [f"step-{step}.h5.aside" for step in (4, 5, 6)]
    assert bench.run(data, out) == 0
    same(whole, out, total)
    new = bench.where / "new"
    assert bench.run(data, new, restart=str(whole / "checkpoint" / "step-6.h5")) == 0
    assert rows(new) == rows(whole)[7:]
    assert maps(new / f"checkpoint/step-{total}.h5") == maps(whole / f"checkpoint/step-{total}.h5")


def test_keeps_the_newest(bench: Bench) -> None:
    data = bench.job("elastic", checkpoint={"every": 3, "keep": 2})
    out = bench.where / "out"
    assert bench.run(data, out) == 0
    total = len(rows(out)) - 1
    kept = sorted(int(path.stem[5:]) for path in (out / "checkpoint").iterdir())
    assert kept == [max(step for step in range(0, total, 3)), total]

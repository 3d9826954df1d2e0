"""Nothing is replaced or removed in a directory that was not proved to be of the same run."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from .jobs import BAD_INPUT, DONE, STEPS, Main, contents, steps, write_job

# -- which checkpoint is of this run ----------------------------------------------------------------------------------


def other_spelling(out: Path) -> Path:
    return out.parent / "out" / ".." / out.name / "checkpoint" / "step-5.h5"


def symlink(out: Path) -> Path:
    path = out.parent / "link.h5"
    path.symlink_to(out / "checkpoint" / "step-5.h5")
    return path


def copy_elsewhere(out: Path) -> Path:
    return Path(shutil.copy(out / "checkpoint" / "step-5.h5", out.parent / "copy.h5"))


@pytest.mark.parametrize("spelt", [other_spelling, symlink, copy_elsewhere])
def test_checkpoint_of_the_same_run_under_another_name(
    main: Main, tmp_path: Path, spelt: Callable[[Path], Path]
) -> None:
    """It is known by what it is, not by its path: rows, maps and other checkpoints stay."""
    out = tmp_path / "out"
    assert main("job.yaml", "--out", "out")[0] == DONE
    rows, maps = (out / "measures.csv").read_bytes(), (out / "fields.h5").read_bytes()
    code, said = main("job.yaml", "--out", "out", "--until", "0.003", "--restart", str(spelt(out)))
    assert (code, said) == (DONE, "")
    now = (out / "measures.csv").read_bytes()
    assert now.splitlines()[:7] == rows.splitlines()[:7]
    assert steps(out)[-1] < STEPS
    assert {path.name for path in out.glob("checkpoint/*.aside")} == {f"step-{n}.h5.aside" for n in range(6, STEPS + 1)}
    with h5py.File(out / "fields.h5") as file:
        assert not np.isnan(file["t"][:5]).any()
    assert len(maps) == (out / "fields.h5").stat().st_size


def test_checkpoint_of_another_run(main: Main, tmp_path: Path) -> None:
    """It clears nothing where a run is; in a new directory it is a beginning."""
    main("job.yaml", "--out", "one")
    main("job.yaml", "--out", "two")
    before = contents(tmp_path / "two")
    code, said = main("job.yaml", "--out", "two", "--restart", "one/checkpoint/step-5.h5")
    assert code == BAD_INPUT
    assert "one/checkpoint/step-5.h5 is of another run than two, which holds measures.csv, fields.h5" in said
    assert contents(tmp_path / "two") == before
    assert main("job.yaml", "--out", "three", "--restart", "one/checkpoint/step-5.h5")[0] == DONE
    assert steps(tmp_path / "three") == list(range(6, STEPS + 1))


# -- results without what they could be made again from ---------------------------------------------------------------


def test_finished_run_without_its_checkpoints(main: Main, tmp_path: Path) -> None:
    """The same command replaces nothing; with --restart never it does as it is told."""
    out = tmp_path / "out"
    main("job.yaml", "--out", "out")
    shutil.rmtree(out / "checkpoint")
    before = contents(out)
    code, said = main("job.yaml", "--out", "out")
    assert code == BAD_INPUT
    assert "out holds measures.csv, fields.h5 of a run that has finished at t = " in said
    assert "but its checkpoints are missing; give --restart never to start afresh" in said
    assert contents(out) == before
    assert main("job.yaml", "--out", "out", "--restart", "never")[0] == DONE


def test_results_of_unknown_origin(main: Main, tmp_path: Path) -> None:
    """Files that bear our names, without a marker, are somebody's: refused, or put aside when told to."""
    out = tmp_path / "out"
    out.mkdir()
    for name in ("measures.csv", "fields.h5", "job.yaml", "notes.txt"):
        (out / name).write_text(f"my {name}")
    before = contents(out)
    code, said = main("job.yaml", "--out", "out")
    assert code == BAD_INPUT
    assert "out is not empty and not of this program: it holds fields.h5, job.yaml, measures.csv, notes.txt; " in said
    assert contents(out) == before
    assert main("job.yaml", "--out", "out", "--restart", "never")[0] == DONE
    after = contents(out)
    assert after["notes.txt"] == b"my notes.txt"
    for name in ("measures.csv", "fields.h5", "job.yaml"):
        assert after[f"{name}.aside"] == before[name]
        assert after[name] != before[name]


def test_working_directory_as_output(main: Main, tmp_path: Path) -> None:
    """The directory of the job alone will do; one with other files will not, and theirs are as they were."""
    (tmp_path / "alone").mkdir()
    given = write_job(tmp_path / "alone" / "job.yaml").read_bytes()
    assert main("alone/job.yaml", "--out", "alone")[0] == DONE
    assert (tmp_path / "alone" / "job.yaml").read_bytes() == given
    assert main("alone/job.yaml", "--out", "alone")[0] == DONE
    (tmp_path / "shared").mkdir()
    write_job(tmp_path / "shared" / "mine.yaml")
    (tmp_path / "shared" / "job.yaml").write_text("unrelated")
    before = contents(tmp_path / "shared")
    code, said = main("shared/mine.yaml", "--out", "shared")
    assert code == BAD_INPUT
    assert "it holds job.yaml" in said
    assert contents(tmp_path / "shared") == before


def test_copy_that_has_lost_its_marker(main: Main, tmp_path: Path) -> None:
    """A sealed checkpoint proves a directory as well, as after `cp out/* elsewhere`."""
    main("job.yaml", "--out", "out", "--until", "0.003")
    shutil.copytree(tmp_path / "out", tmp_path / "copy", ignore=shutil.ignore_patterns(".parcontact"))
    assert main("job.yaml", "--out", "copy")[0] == DONE
    assert steps(tmp_path / "copy") == list(range(STEPS + 1))


def test_another_job_that_left_no_checkpoint(main: Main, tmp_path: Path) -> None:
    """Rows of a run that was killed early are made again by its own job only."""
    main("job.yaml", "--out", "out")
    out = tmp_path / "out"
    for path in (out / "checkpoint").iterdir():
        path.unlink()
    marker = json.loads((out / ".parcontact").read_text())
    marker["run"] |= {"saved": False, "finished": None}
    (out / ".parcontact").write_text(json.dumps(marker))
    before = contents(out)
    code, said = main("job.yaml", "--out", "out", "--set", "material.modulus_inf=2e6")
    assert code == BAD_INPUT
    assert "of another job: material.modulus_inf was 1000000.0, is 2000000.0" in said
    assert contents(out) == before
    assert main("job.yaml", "--out", "out")[0] == DONE
    assert steps(out) == list(range(STEPS + 1))

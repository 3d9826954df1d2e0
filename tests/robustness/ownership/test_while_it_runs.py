"""What is taken away, locked or asked for while a run writes, and runs that keep no checkpoint."""

import fcntl
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from .jobs import DONE, FAILED, STEPS, Main, contents, steps

# -- while it runs ----------------------------------------------------------------------------------------------------


def test_locked_fields_do_not_disturb_a_run(
    main: Main, at_step: Callable[[int, Callable[[], Any]], None], tmp_path: Path
) -> None:
    """HDF5's lock, taken by another program while it runs."""
    path, locks = tmp_path / "out" / "fields.h5", list[int]()

    def lock() -> None:
        locks.append(os.open(path, os.O_RDONLY))
        fcntl.flock(locks[0], fcntl.LOCK_EX)

    at_step(6, lock)
    try:
        assert main("job.yaml", "--out", "out") == (DONE, "")
    finally:
        os.close(locks[0])
    with h5py.File(path) as file:
        assert not np.isnan(file["t"][...]).any()


def test_xdmf_that_cannot_be_written(
    main: Main, at_step: Callable[[int, Callable[[], Any]], None], tmp_path: Path
) -> None:
    """It is beside the point: a warning, and every checkpoint."""
    out = tmp_path / "out"

    def block() -> None:
        (out / "fields.xdmf").unlink()
        (out / "fields.xdmf").mkdir()

    at_step(3, block)
    code, said = main("job.yaml", "--out", "out")
    assert code == DONE
    assert "warning: cannot write out/fields.xdmf" in said
    assert len(list(out.glob("checkpoint/step-*.h5"))) == STEPS


def test_stop_file_that_cannot_be_removed(
    main: Main, at_step: Callable[[int, Callable[[], Any]], None], tmp_path: Path
) -> None:
    """It stops the run, whose state is saved; the next one would stop at once, so the code is 1."""

    def ask() -> None:
        (tmp_path / "out" / "stop").mkdir()
        time.sleep(0.25)  # longer than between two looks

    at_step(4, ask)
    code, said = main("job.yaml", "--out", "out")
    assert code == FAILED
    assert "out/stop, which cannot be removed: Is a directory; remove it; the newest checkpoint is " in said


# -- no checkpoints ---------------------------------------------------------------------------------------------------


def test_keep_none(main: Main, tmp_path: Path) -> None:
    """A short run leaves no checkpoint; one that stops early leaves one, and goes on from it."""
    out, none = tmp_path / "out", ("--set", "checkpoint={every: 3, keep: 0}")
    assert main("job.yaml", "--out", "out", *none, "--until", "0.003")[0] == DONE
    assert len(list(out.glob("checkpoint/*"))) == 1
    assert main("job.yaml", "--out", "out", *none) == (DONE, "")
    assert list(out.glob("checkpoint/*")) == []
    assert steps(out) == list(range(STEPS + 1))
    before = contents(out)
    assert main("job.yaml", "--out", "out", *none) == (DONE, "")
    assert contents(out) == before

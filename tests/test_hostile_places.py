"""Where the program runs may be hostile: outputs that are full, limits, directories that vanish, settings of others."""

import resource
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import yaml
from conftest import WORLD, Main

pytestmark = pytest.mark.skipif(WORLD.size > 1, reason="for one process")

JOB: dict[str, Any] = {
    "grid": {"points": [32, 24], "size": [1e-3, 7.5e-4]},
    "surface": {"shape": "wave", "amplitude": 1e-6, "waves": [2, 1]},
    "material": {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]},
    "history": [{"pressure": 1e4, "velocity": 0.1, "distance": 1.5625e-4, "cells_per_step": 1}],
    "output": {"fields": ["pressure"]},
}
DONE, FAILED, BAD_INPUT = 0, 1, 2


@pytest.fixture
def here(main: Main, tmp_path: Path) -> Path:
    """A directory with job.yaml, in which we are."""
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(JOB))
    return tmp_path


@contextmanager
def limited(what: int, soft: int) -> Iterator[None]:
    """A resource of this process is limited meanwhile."""
    before = resource.getrlimit(what)
    resource.setrlimit(what, (soft, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(what, before)


@pytest.mark.parametrize("words", [["schema"], ["manual"], ["check", "job.yaml"], ["cite", "out"], ["--version"]])
@pytest.mark.parametrize("stream", ["full", "closed"])
def test_output_that_is_lost_is_no_success(
    here: Path, main: Main, monkeypatch: pytest.MonkeyPatch, words: list[str], stream: str
) -> None:
    assert main("job.yaml", "--quiet", "--out", "out")[0] == DONE
    with monkeypatch.context() as patch, Path("/dev/full").open("w") as full:
        patch.setattr(sys, "stdout", full if stream == "full" else None)
        code, _, said = main(*words)
    reason = "No space left on device" if stream == "full" else "it is closed"
    assert (code, said) == (BAD_INPUT, f"parcontact: cannot write to standard output: {reason}\n")


@pytest.mark.parametrize("fields", ["[pressure]", "[]"])
def test_limit_of_file_sizes(here: Path, main: Main, fields: str) -> None:
    """In fields.h5, else in the checkpoint: a sentence, nothing half-written, and without the limit it goes on."""
    words = ("job.yaml", "--quiet", "--out", "out", "--set", f"output.fields={fields}")
    with limited(resource.RLIMIT_FSIZE, 20_000):
        code, _, said = main(*words)
    assert code == FAILED
    assert "ulimit -f" in said
    assert len(said.splitlines()) == 1
    assert not list((here / "out").rglob("*.part"))
    assert main(*words)[0] == DONE

"""Compiled loops: where they are kept, two processes that keep them at once, who is stated, what of numba is
imported."""

import io
import subprocess
import sys
from pathlib import Path

import numba.core.caching
import pytest
from mpi4py import MPI

from parcontact import compiled


def test_no_place_for_a_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.core.caching.CacheImpl, "_locator_classes", [])
    with pytest.raises(RuntimeError, match="no locator available"):
        numba.njit(cache=True)(sum_to)
    assert compiled.loop(sum_to)(4) == 6


def test_loops_may_multiply_matrices(outside_mpi: dict[str, str]) -> None:
    """What numba wants scipy.linalg for is imported when a loop needs it, and all of it is as without us."""
    program = """
import sys
import numpy as np
from parcontact.compiled import loop
from numba.np import arraymath, linalg
assert "scipy.linalg" not in sys.modules
assert arraymath._HAVE_BLAS
assert arraymath.ensure_blas is linalg.ensure_blas
assert linalg.ensure_blas.__module__ == "numba.np.linalg"
print(loop(lambda a, b: np.dot(a, b))(np.array([[1.0, 2.0]]), np.array([[3.0], [4.0]])))
assert "scipy.linalg.cython_blas" in sys.modules
import scipy.linalg
print(scipy.linalg.det(2.0 * np.eye(2)), np.linalg.norm([3.0, 4.0]))
"""
    done = subprocess.run([sys.executable, "-c", program], env=outside_mpi, capture_output=True, text=True)
    assert done.stdout.split() == ["[[11.]]", "4.0", "5.0"], done.stderr


READER = "import work; print(work.add(2.0))"
LATE = """
import subprocess, sys, time
import numba.core.caching
readers, save = [], numba.core.caching.IndexDataCacheFile._save_data

def save_late(self, name, data):
    words = [sys.executable, "-c", "print(flush=True); import work; print(work.add(2.0))"]
    readers.append(subprocess.Popen(words, stdout=subprocess.PIPE, text=True))
    readers[-1].stdout.readline()
    time.sleep(1.0)  # [s]: it could read what was in the file before
    save(self, name, data)

numba.core.caching.IndexDataCacheFile._save_data = save_late
import work
print(work.add(2.0), *(reader.communicate()[0] for reader in readers))
"""


KILLED = """
import os
import numba.core.caching
numba.core.caching.IndexDataCacheFile._save_data = lambda *_: os._exit(0)
import work
work.add(2.0)
"""


def test_nobody_reads_what_is_being_written(tmp_path: Path, outside_mpi: dict[str, str]) -> None:
    """A process that comes while another one keeps the code of a new source does not get that of the old one; nor does
    it when that one was killed half-way."""
    environment = outside_mpi | {"XDG_CACHE_HOME": str(tmp_path / "cache"), "PYTHONPATH": str(tmp_path)}
    (tmp_path / "cache").mkdir(mode=0o700)
    work = tmp_path / "work.py"

    def said(program: str, added: float) -> list[str]:
        source = f"from parcontact.compiled import loop\n\n@loop\ndef add(x):\n    return x + {added}\n"
        if not work.exists() or work.read_text() != source:
            work.write_text(source)
        words = [sys.executable, "-c", program]
        done = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
        return done.stdout.split()

    assert said(READER, 1.0) == ["3.0"]
    assert said(LATE, 10.25) == ["12.25", "12.25"]
    assert said(KILLED, 100.125) == []
    assert said(READER, 100.125) == ["102.125"]


def sum_to(n: int) -> int:
    total = 0
    for i in range(n):
        total += i
    return total


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("stream", "lines"), [(Terminal, 1), (io.StringIO, 0)])
def test_who_waits_is_stated_that_loops_compile(
    stream: type[io.StringIO], lines: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once for all loops, on a terminal alone."""
    monkeypatch.setattr(sys, "stderr", stream())
    compiled.say_that_it_compiles.cache_clear()
    assert numba.njit(lambda x: x + 1)(1) == numba.njit(lambda x: x + 1)(1) == 2
    assert isinstance(sys.stderr, io.StringIO)
    said = sys.stderr.getvalue()
    assert said.count("\n") == said.count("parcontact: compiling loops") == lines
    assert ("parcontact doctor" in said) == bool(lines)


@pytest.mark.mpi(2)
def test_root_alone_says_that_loops_compile(comm: MPI.Intracomm, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", Terminal())
    compiled.say_that_it_compiles.cache_clear()
    assert numba.njit(lambda x: x + 1)(1) == 2
    assert isinstance(sys.stderr, io.StringIO)
    assert ("compiling" in sys.stderr.getvalue()) == (comm.rank == 0)

"""Compiled loops where nothing can be kept on disk, and what of numba they import."""

import subprocess
import sys

import numba.core.caching
import pytest

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


def sum_to(n: int) -> int:
    total = 0
    for i in range(n):
        total += i
    return total

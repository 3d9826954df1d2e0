"""Compiled loops where nothing can be kept on disk."""

import numba.core.caching
import pytest

from parcontact import compiled


def test_no_place_for_a_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.core.caching.CacheImpl, "_locator_classes", [])
    with pytest.raises(RuntimeError, match="no locator available"):
        numba.njit(cache=True)(sum_to)
    assert compiled.loop(sum_to)(4) == 6


def sum_to(n: int) -> int:
    total = 0
    for i in range(n):
        total += i
    return total

"""Pressures that are not negative, against the same expressions of numpy; tolerances as in `test_kernels`."""

import numpy as np
import pytest

from parcontact.solve import constraint
from parcontact.solve.constraint import NonNegative

from .random_maps import ROUNDING, SHAPES, Maps

pytestmark = pytest.mark.parametrize("dtype", [np.float64, np.float32])


@SHAPES
def test_mark(shape: tuple[int, int], dtype: type[np.floating]) -> None:
    maps = Maps(shape, dtype)
    working = np.ones(shape, dtype=np.bool_)
    wrong, count, gaps, deepest = constraint.mark(maps.p, maps.u, maps.h, 0.25, working)
    p, gap = maps.wide("p"), maps.wide("u") - maps.wide("h") - 0.25
    assert np.array_equal(working, (p > 0) | (gap < 0))
    assert maps.close(wrong, p * np.abs(gap))
    assert count == np.count_nonzero(working)
    assert maps.close(gaps, gap[working])
    assert deepest == -np.inf if gap.size == 0 else abs(deepest + gap.min()) <= 4 * ROUNDING[dtype]


@SHAPES
def test_clip(shape: tuple[int, int], dtype: type[np.floating]) -> None:
    maps = Maps(shape, dtype)
    before, expected = maps.wide("z").copy(), np.maximum(maps.z, 0.0)
    load = constraint.clip(maps.z)
    assert np.array_equal(maps.z, expected)
    assert maps.close(load, np.maximum(before, 0.0))


@SHAPES
def test_choose(shape: tuple[int, int], dtype: type[np.floating]) -> None:
    """Points where x outweighs its gap, and how far x is from a solution."""
    maps = Maps(shape, dtype)
    working = np.ones(shape, dtype=np.bool_)
    positive, negative, wrong, count, deepest = NonNegative().choose(maps.z, maps.u, maps.h, 0.25, 0.5, working)
    x, gap = maps.wide("z"), maps.wide("u") - maps.wide("h") - 0.25
    assert np.array_equal(working, x > 0.5 * gap)
    assert maps.close(positive, np.maximum(x, 0.0))
    assert maps.close(negative, np.maximum(-x, 0.0))
    assert maps.close(wrong, np.abs(x * gap))
    assert count == np.count_nonzero(working)
    assert deepest == -np.inf if gap.size == 0 else abs(deepest + gap.min()) <= 4 * ROUNDING[dtype]


@SHAPES
def test_next_set(shape: tuple[int, int], dtype: type[np.floating]) -> None:
    """Pressed points of the set, and others that penetrate."""
    maps = Maps(shape, dtype)
    found = NonNegative().next_set(maps.z, maps.u, maps.working)
    assert np.array_equal(found, (maps.working & (maps.z > 0.0)) | (~maps.working & (maps.u < 0.0)))


def test_nothing_hides_a_nan(dtype: type[np.floating]) -> None:
    """A NaN in a gap shows even where there is no pressure."""
    for name in ("p", "u", "h"):
        maps = Maps((5, 32), dtype)
        getattr(maps, name)[2, 3] = np.nan
        assert np.isnan(constraint.mark(maps.p, maps.u, maps.h, 0.0, maps.working)[0])
    maps = Maps((5, 32), dtype)
    maps.t[2, 3] = np.nan
    assert np.isnan(constraint.clip(maps.t))
    assert np.isnan(maps.t[2, 3])

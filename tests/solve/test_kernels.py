"""Fused loops against the same expressions of numpy, on random maps with zeros, ranks without rows, and NaN.

Tolerance: sums of a few hundred terms in another order, 1e-13 of the sum of their absolute values; with maps in single
precision the terms themselves are rounded, 1e-6.
"""

import numpy as np
import pytest

from parcontact.contact import constraint, kernels
from parcontact.contact.constraint import CELL, Cells, NonNegative
from parcontact.parallel.slab import Slab
from parcontact.physics import loops

from .random_maps import ROUNDING, SHAPES, Maps

pytestmark = pytest.mark.parametrize("dtype", [np.float64, np.float32])


def test_nothing_hides_a_nan(dtype: type[np.floating]) -> None:
    """Although sums may be reordered; a NaN in a gap shows even where there is no pressure."""
    for name in ("p", "u", "h"):
        maps = Maps((5, 32), dtype)
        getattr(maps, name)[2, 3] = np.nan
        assert np.isnan(kernels.pressure_sums(maps.p, maps.u, maps.h, 0.0)[2])
    maps = Maps((5, 32), dtype)
    maps.t[2, 3] = np.nan
    assert np.isnan(loops.dot(maps.t, maps.t))


# -- pressures that are not negative, against the same expressions of numpy; tolerances as in `test_kernels` ----------


def test_no_load_is_held_at_a_bound(dtype: type[np.floating]) -> None:
    """Any pressure above 0 may change; one of another load is that times a factor."""
    maps = Maps((5, 32), dtype)
    assert NonNegative().mark_working_set(maps.p, maps.u, maps.h, 0.25, maps.working)[3] == 0.0
    before = maps.wide("p").copy()
    NonNegative().rescale_to_load(Slab.alone(32, 5), maps.p, float(before.sum()), 3.0)
    assert maps.close(3.0, maps.wide("p"))
    assert np.allclose(maps.wide("p"), 3.0 / before.sum() * before, rtol=4 * ROUNDING[dtype], atol=0.0)


@SHAPES
def test_mark(shape: tuple[int, int], dtype: type[np.floating]) -> None:
    maps = Maps(shape, dtype)
    working = np.ones(shape, dtype=np.bool_)
    wrong, count, gaps, deepest = constraint.mark_working_set(maps.p, maps.u, maps.h, 0.25, working)
    p, gap = maps.wide("p"), maps.wide("u") - maps.wide("h") - 0.25
    assert np.array_equal(working, (p > 0) | (gap < 0))
    assert maps.close(wrong, p * np.abs(gap))
    assert count == np.count_nonzero(working)
    assert maps.close(gaps, gap[working])
    assert deepest == -np.inf if gap.size == 0 else abs(deepest + gap.min()) <= 4 * ROUNDING[dtype]


@SHAPES
def test_next_set(shape: tuple[int, int], dtype: type[np.floating]) -> None:
    """Pressed points of the set, and others that penetrate."""
    maps = Maps(shape, dtype)
    found = NonNegative().next_set(maps.z, maps.u, maps.working)
    assert np.array_equal(found, (maps.working & (maps.z > 0.0)) | (~maps.working & (maps.u < 0.0)))


@pytest.mark.parametrize(("high", "above"), [(CELL, 0), (CELL, 3), (4, 3)])
@pytest.mark.parametrize("wide", [CELL, 4])
@pytest.mark.parametrize("shape", [(40, 33), (1, 1), (16, 16)])
def test_cells(shape: tuple[int, int], high: int, above: int, wide: int, dtype: type[np.floating]) -> None:
    """Pressures cut off at 0, what that adds to each cell, and cells scaled one by one; the first is cut by a rank."""
    maps = Maps(shape, dtype)
    p, step = np.empty(shape), 0.7
    rows, columns = (shape[0] + above - 1) // high + 1, (shape[1] - 1) // wide + 1
    sums, factors = np.full((rows, 2 * columns), 9.0), np.random.default_rng(2).random((rows, columns))
    load, cut = NonNegative().advance(maps.u, maps.t, step, p, Cells(high, above, wide), sums)
    value = maps.wide("u") - step * maps.wide("t")
    kept = np.maximum(value, 0.0)
    np.testing.assert_allclose(p, kept, rtol=0, atol=10 * ROUNDING[dtype])
    whole = np.zeros((2, rows * high, columns * wide))
    whole[0, above : above + shape[0], : shape[1]] = kept
    whole[1, above : above + shape[0], : shape[1]] = kept - value
    expected = whole.reshape(2, rows, high, columns, wide).sum(axis=(2, 4))
    np.testing.assert_allclose(sums, np.hstack(list(expected)), atol=1e3 * ROUNDING[dtype])
    np.testing.assert_allclose([load, cut], expected.sum(axis=(1, 2)), rtol=1e3 * ROUNDING[dtype])
    before = p.copy()
    constraint.scale_cells(p, Cells(high, above, wide), factors)
    of_points = np.repeat(np.repeat(factors, high, axis=0), wide, axis=1)[above : above + shape[0], : shape[1]]
    np.testing.assert_allclose(p, before * of_points, rtol=1e-15)


def test_nothing_hides_a_nan_constraint(dtype: type[np.floating]) -> None:
    """A NaN in a gap shows even where there is no pressure."""
    for name in ("p", "u", "h"):
        maps = Maps((5, 32), dtype)
        getattr(maps, name)[2, 3] = np.nan
        assert np.isnan(constraint.mark_working_set(maps.p, maps.u, maps.h, 0.0, maps.working)[0])
    maps = Maps((5, 32), dtype)
    maps.t[2, 3] = np.nan
    assert np.isnan(constraint.clip(maps.t))
    assert np.isnan(maps.t[2, 3])

"""Fused loops against the same expressions of numpy, on random maps with zeros, ranks without rows, and NaN.

Tolerance: sums of a few hundred terms in another order, 1e-13 of the sum of their absolute values; with maps in single
precision the terms themselves are rounded, 1e-6.
"""

import numpy as np
import pytest

from parcontact.physics import loops
from parcontact.solve import kernels

from .random_maps import ROUNDING, SHAPES, Maps

pytestmark = pytest.mark.parametrize("dtype", [np.float64, np.float32])


@SHAPES
def test_weigh(shape: tuple[int, int], dtype: type[np.floating]) -> None:
    maps = Maps(shape, dtype)
    load, work, gaps, squares = kernels.weigh(maps.p, maps.u, maps.h, 0.25)
    p, u, h = maps.wide("p"), maps.wide("u"), maps.wide("h")
    assert maps.close(load, p)
    assert maps.close(work, p * u)
    assert maps.close(squares, p * u * u)
    assert maps.close(gaps, np.stack([p * u, -p * h, -0.25 * p]))


@SHAPES
def test_residual(shape: tuple[int, int], dtype: type[np.floating]) -> None:
    maps = Maps(shape, dtype)
    kernels.residual(maps.working, maps.u, maps.h, 0.25, maps.r)
    expected = np.where(maps.working, maps.wide("u") - maps.wide("h") - 0.25, 0.0)
    assert np.allclose(maps.r, expected, rtol=0.0, atol=4 * ROUNDING[dtype])


@SHAPES
def test_products(shape: tuple[int, int], dtype: type[np.floating]) -> None:
    """Of the residual that `residual` makes, to the precision of the maps, and of the change of the displacement."""
    maps = Maps(shape, dtype)
    inside = maps.working
    kernels.residual(maps.working, maps.u, maps.h, 0.3, maps.r)
    sums = kernels.products(maps.working, maps.u, maps.h, 0.3, maps.old, maps.z, maps.t)
    r, u, old, z, t = (maps.wide(name)[inside] for name in ("r", "u", "old", "z", "t"))
    for found, terms in zip(sums, (z, t, u - old, r * z, (u - old) * z, r * t), strict=True):
        assert maps.close(found, terms)


@SHAPES
def test_turn(shape: tuple[int, int], dtype: type[np.floating]) -> None:
    maps = Maps(shape, dtype)
    expected = np.where(maps.working, maps.wide("z") + 0.7 * maps.wide("t") - 0.3, 0.0)
    kernels.turn(maps.working, maps.z, 0.7, 0.3, maps.t)
    assert np.allclose(maps.t, expected, rtol=0.0, atol=8 * ROUNDING[dtype])


@SHAPES
def test_dot_and_total(shape: tuple[int, int], dtype: type[np.floating]) -> None:
    maps = Maps(shape, dtype)
    u, t = maps.wide("u"), maps.wide("t")
    assert maps.close(kernels.total(maps.u), u)
    assert maps.close(loops.dot(maps.u, maps.t), u * t)


def test_sums_are_double_whatever_the_maps_are(dtype: type[np.floating]) -> None:
    """A million equal numbers: to 1e-14, where a running sum in single precision would lose the third digit."""
    p = np.full((1000, 1000), 0.1, dtype=dtype)
    zero = np.zeros_like(p)
    exact = 1e6 * float(p[0, 0])
    for found in (kernels.total(p), kernels.weigh(p, zero, zero, 0.0)[0]):
        assert abs(found / exact - 1.0) < 1e-14


def test_nothing_hides_a_nan(dtype: type[np.floating]) -> None:
    """Although sums may be reordered; a NaN in a gap shows even where there is no pressure."""
    for name in ("p", "u", "h"):
        maps = Maps((5, 32), dtype)
        getattr(maps, name)[2, 3] = np.nan
        assert np.isnan(kernels.weigh(maps.p, maps.u, maps.h, 0.0)[2])
    maps = Maps((5, 32), dtype)
    maps.t[2, 3] = np.nan
    assert np.isnan(loops.dot(maps.t, maps.t))

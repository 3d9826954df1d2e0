"""Fused loops against the same expressions of numpy, on random maps with zeros, ranks without rows, and NaN.

Tolerance: sums of a few hundred terms in another order, 1e-13 of the sum of their absolute values; with maps in single
precision the terms themselves are rounded, 1e-6.
"""

import numpy as np
import pytest
from numpy.typing import NDArray

from parcontact.contact import kernels
from parcontact.contact.problem import Box, scale_to_load, subtract_load
from parcontact.parallel.slab import Slab
from parcontact.physics import loops

from .random_maps import ROUNDING, SHAPES, Maps

pytestmark = pytest.mark.parametrize("dtype", [np.float64, np.float32])
BOXES = pytest.mark.parametrize("box", [Box(), Box(highest=0.8), Box(lowest=0.3), Box(0.3, 0.8)], ids=str)


def within(box: Box, maps: Maps) -> NDArray[np.float64]:
    """Put an admissible pressure into the maps, with points at each bound; return it in double precision."""
    maps.p = np.clip(maps.p, maps.dtype(box.lowest), maps.dtype(box.highest))
    bounds = (maps.p == maps.dtype(bound) for bound in (box.lowest, box.highest))
    p = maps.wide("p")
    for bound, value in zip(bounds, (box.lowest, box.highest), strict=True):
        p[bound] = value
    maps.p = p  # pressures are in double precision
    return p


def test_nothing_hides_a_nan(dtype: type[np.floating]) -> None:
    """Although sums may be reordered; a NaN in a gap shows even where there is no pressure."""
    for name in ("p", "u", "h"):
        maps = Maps((5, 32), dtype)
        getattr(maps, name)[2, 3] = np.nan
        assert np.isnan(kernels.contact_sums(maps.p, maps.u, maps.h, 0.0, 0.0, np.inf)[2])
        assert np.isnan(kernels.mark_working_set(maps.p, maps.u, maps.h, 0.0, 0.0, np.inf, maps.working)[0])
    maps = Maps((5, 32), dtype)
    maps.t[2, 3] = np.nan
    assert np.isnan(loops.dot(maps.t, maps.t))
    p = maps.wide("p").copy()
    assert np.all(np.isnan(kernels.advance(p, maps.t, 1.0, 0.0, np.inf, p)))
    assert np.isnan(p[2, 3])


@SHAPES
@BOXES
def test_contact_sums(shape: tuple[int, int], box: Box, dtype: type[np.floating]) -> None:
    maps = Maps(shape, dtype)
    p, u, gap = within(box, maps), maps.wide("u"), maps.wide("u") - maps.wide("h") - 0.25
    free = np.where(p < box.highest, p - box.lowest, 0.0)
    found = kernels.contact_sums(maps.p, maps.u, maps.h, 0.25, box.lowest, box.highest)
    for sum_, terms in zip(found, (p, p * u, p * gap, p * u**2, free, free * gap), strict=True):
        assert maps.close(sum_, terms)


@SHAPES
@BOXES
def test_mark(shape: tuple[int, int], box: Box, dtype: type[np.floating]) -> None:
    maps = Maps(shape, dtype)
    p, gap = within(box, maps), maps.wide("u") - maps.wide("h") - 0.25
    working = np.ones(shape, dtype=np.bool_)
    sums = kernels.mark_working_set(maps.p, maps.u, maps.h, 0.25, box.lowest, box.highest, working)
    wrong, count, gaps, held, deepest = sums
    stays, below = (p == box.highest) & (gap <= 0.0), gap[p < box.highest]
    assert np.array_equal(working, ((p > box.lowest) | (gap < 0)) & ~stays)
    assert maps.close(wrong, np.where(stays, 0.0, (p - box.lowest) * np.abs(gap)))
    assert (count, held) == (np.count_nonzero(working), np.count_nonzero(stays))
    assert maps.close(gaps, gap[working])
    assert deepest == -np.inf if below.size == 0 else abs(deepest + below.min()) <= 4 * ROUNDING[dtype]


@SHAPES
@BOXES
def test_advance(shape: tuple[int, int], box: Box, dtype: type[np.floating]) -> None:
    maps = Maps(shape, dtype)
    p, before = np.empty(shape), maps.wide("u")
    load, cut = kernels.advance(before, maps.t, 0.7, box.lowest, box.highest, p)
    value = before - 0.7 * maps.wide("t")
    kept = np.clip(value, box.lowest, box.highest)
    np.testing.assert_allclose(p, kept, rtol=0, atol=10 * ROUNDING[dtype])
    assert maps.close(load, kept)
    assert abs(cut - np.abs(kept - value).sum()) <= 1e3 * ROUNDING[dtype]


@SHAPES
@BOXES
def test_resolve(shape: tuple[int, int], box: Box, dtype: type[np.floating]) -> None:
    """The nearest admissible pressure to s + gamma h."""
    maps = Maps(shape, dtype)
    p, reflected, projected = np.empty(shape), np.empty(shape), maps.wide("z") + 0.7 * maps.wide("h")
    total = box.resolve(maps.wide("z"), maps.wide("h"), 0.7, p, reflected)
    box.project(projected)
    np.testing.assert_allclose(p, projected, rtol=0, atol=1e-15)
    np.testing.assert_allclose(reflected, 2.0 * projected - maps.wide("z"), rtol=0, atol=1e-14)
    assert total == pytest.approx(reflected.sum(), abs=1e-12)


@BOXES
@pytest.mark.parametrize("share", [0.01, 0.5, 0.99])
def test_scale_to_load(box: Box, share: float, dtype: type[np.floating]) -> None:
    """From pressures at both bounds and between them to the load, which is a share of the range of one with a highest
    pressure; points at the lowest one stay there unless the others cannot carry the load."""
    maps, slab = Maps((5, 32), dtype), Slab.alone(32, 5)
    p = within(box, maps)
    lowest, before = p == box.lowest, p.copy()
    total = slab.points * (box.lowest + share * (min(box.highest, 0.9) - box.lowest))
    scale_to_load(slab, box, p, float(p.sum()), total)
    assert p.sum() == pytest.approx(total, rel=1e-11)
    assert box.lowest <= p.min() <= p.max() <= box.highest
    if box.highest == np.inf:
        factor = (total - box.lowest * p.size) / (before - box.lowest).sum()
        np.testing.assert_allclose(p - box.lowest, factor * (before - box.lowest), rtol=0, atol=1e-14)
    if share < 0.4:
        assert np.all(p[lowest] == box.lowest)
    p.fill(box.lowest)
    scale_to_load(slab, box, p, float(p.sum()), total)
    np.testing.assert_allclose(p, total / slab.points, rtol=1e-14)


@pytest.mark.parametrize("lowest", [0.0, 0.3])
def test_subtract_load(lowest: float, dtype: type[np.floating]) -> None:
    """All points lose the same, but none falls below the bound: what such points keep is too much in the sum."""
    p = np.array([[1.0, 2.0], [0.25, 0.0]], dtype) + dtype(lowest)
    load = subtract_load(Slab.alone(2, 2), Box(lowest=lowest), p, 1.5, 3.0)
    np.testing.assert_allclose(p, np.array([[0.5, 1.5], [0.0, 0.0]]) + lowest, rtol=1e-6)
    assert load == pytest.approx(2.0 + 4 * lowest, rel=1e-6)

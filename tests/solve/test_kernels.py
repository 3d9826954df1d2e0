"""Fused loops against the same expressions of numpy, on random maps with zeros, ranks without rows, and NaN.

Tolerance: sums of a few hundred terms in another order, 1e-13 of the sum of their absolute values; with maps in single
precision the terms themselves are rounded, 1e-6.
"""

import numpy as np
import pytest

from parcontact.parallel.slab import Slab
from parcontact.physics import loops
from parcontact.solve import constraint, kernels
from parcontact.solve.constraint import NonNegative

from .random_maps import ROUNDING, Maps

pytestmark = pytest.mark.parametrize("dtype", [np.float64, np.float32])


def test_sums_are_double_whatever_the_maps_are(dtype: type[np.floating]) -> None:
    """A million equal numbers: to 1e-14, where a running sum in single precision would lose the third digit."""
    p = np.full((1000, 1000), 0.1, dtype=dtype)
    zero = np.zeros_like(p)
    exact = 1e6 * float(p[0, 0])
    for found in (kernels.sum_of(p), kernels.pressure_sums(p, zero, zero, 0.0)[0]):
        assert abs(found / exact - 1.0) < 1e-14


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
    assert NonNegative().mark(maps.p, maps.u, maps.h, 0.25, maps.working)[3] == 0.0
    before = maps.wide("p").copy()
    NonNegative().rescale_to_load(Slab.alone(32, 5), maps.p, float(before.sum()), 3.0)
    assert maps.close(3.0, maps.wide("p"))
    assert np.allclose(maps.wide("p"), 3.0 / before.sum() * before, rtol=4 * ROUNDING[dtype], atol=0.0)


def test_nothing_hides_a_nan_constraint(dtype: type[np.floating]) -> None:
    """A NaN in a gap shows even where there is no pressure."""
    for name in ("p", "u", "h"):
        maps = Maps((5, 32), dtype)
        getattr(maps, name)[2, 3] = np.nan
        assert np.isnan(constraint.mark(maps.p, maps.u, maps.h, 0.0, maps.working)[0])
    maps = Maps((5, 32), dtype)
    maps.t[2, 3] = np.nan
    assert np.isnan(constraint.clip(maps.t))
    assert np.isnan(maps.t[2, 3])

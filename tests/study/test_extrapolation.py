"""Limits of sequences whose limit is known."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from parcontact.study.extrapolation import extrapolate


@given(
    st.floats(0.5, 4.0),
    st.floats(-10.0, 10.0),
    st.sampled_from([-0.3, 0.2]),
    st.sampled_from([(1.0, 0.5, 0.25), (1.0, 0.6, 0.5), (1.0, 0.5, 0.25, 0.125)]),
)
def test_power_laws(order: float, limit: float, factor: float, sizes: tuple[float, ...]) -> None:
    """`f* + c h^p` is extrapolated to f* whatever the ratios of the sizes; rounding of the differences."""
    found = extrapolate(sizes, [limit + factor * size**order for size in sizes])
    assert_allclose(found.order, order, rtol=1e-6)
    assert_allclose(found.value, limit, atol=1e-6)
    assert found.uncertainty > 0.0


def test_two_powers_stay_within_the_uncertainty() -> None:
    """A second term of the next order moves the limit by less than what it is said to be sure to."""
    sizes = (1.0, 0.5, 0.25, 0.125)
    found = extrapolate(sizes, [3.0 + 0.1 * h**1.5 + 0.05 * h**2.5 for h in sizes])
    assert 0.0 < abs(found.value - 3.0) < found.uncertainty < 0.01


@pytest.mark.parametrize("values", [(1.0, 2.0, 1.5), (1.0, 1.1, 1.5), (1.0, 1.5)])
def test_what_does_not_converge(values: tuple[float, ...]) -> None:
    """No order: the finest value, and the larger of the last two differences as what is not known."""
    found = extrapolate([0.5**k for k in range(len(values))], values)
    assert math.isnan(found.order)
    steps = [abs(b - a) for a, b in pairwise(values)]
    assert (found.value, found.uncertainty) == (values[-1], max(steps[-2:]))


@pytest.mark.parametrize("values", [[2.0, 2.0], [2.0, 2.0, 2.0], [1.0, 2.0, 2.0, 2.0]])
def test_values_that_do_not_differ_tell_nothing_of_their_error(values: list[float]) -> None:
    found = extrapolate([2.0**-k for k in range(len(values))], values)
    assert found.value == 2.0
    assert math.isnan(found.order)
    assert math.isnan(found.uncertainty)

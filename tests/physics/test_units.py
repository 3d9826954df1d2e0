"""Inner units: powers of two near what is typical."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from parcontact.physics.units import Units

VALUES = st.floats(1e-15, 1e15)


@given(height=VALUES, length=VALUES, modulus=VALUES, value=st.floats(1e-100, 1e100))
def test_no_digit_is_lost(height: float, length: float, modulus: float, value: float) -> None:
    units = Units.near(height, length, modulus)
    for unit, typical in ((units.height, height), (units.length, length), (units.modulus, modulus)):
        assert unit / 1.5 < typical < unit * 1.5
    for unit in (units.pressure, units.height, units.length, units.modulus):
        assert value / unit * unit == value


def test_flat_surface() -> None:
    units = Units.near(0.0, 1e-3, 1e6)
    assert units.height == units.length == 2.0**-10


def test_derived_units() -> None:
    """Pressure: modulus times strain."""
    units = Units(2.0**-20, 2.0**-10, 2.0**20)
    assert units.pressure == pytest.approx(2.0**10)

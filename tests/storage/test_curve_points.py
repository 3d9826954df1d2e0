"""Which points of a friction curve are asked for, and which its table lacks."""

import math

from parcontact.storage.curve_points import asked, lacking, of_table

NONE = math.nan  # the temperature of the material
COLUMNS = {"velocity": [0.1, 1.0], "pressure": [1e5, 1e5], "friction": [0.2, 0.3]}


def test_every_speed_under_every_pressure_at_every_temperature() -> None:
    """In the order in which they are solved."""
    speeds, pressures = (0.1, 1.0), (1e5, 2e5)
    assert asked(speeds, pressures, (20.0, -5.0)) == [
        (v, p, t) for t in (20.0, -5.0) for p in pressures for v in speeds
    ]
    assert lacking(asked(speeds, pressures), [(v, p, NONE) for p in pressures for v in speeds]) == []


def test_a_point_that_is_asked_for_again_is_one() -> None:
    assert asked((0.1, 1.0, 0.1), (1e5, 1e5)) == asked((0.1, 1.0), (1e5,))
    assert asked((0.1, 0.1), (1e5,), (20.0, 20.0)) == [(0.1, 1e5, 20.0)]


def test_what_a_table_lacks() -> None:
    """Speeds and pressures to rounding; a temperature that was not asked for is no other one."""
    there = of_table(COLUMNS)
    assert lacking(asked((1.0, 0.5, 0.1), (1e5,)), there) == [1]
    assert lacking([(0.1 * (1 + 5e-7), 1e5, NONE), (0.1 * (1 + 2e-6), 1e5, NONE), (0.1, 1.1e5, NONE)], there) == [1, 2]
    assert lacking(asked((0.1,), (1e5,), (20.0,)), there) == [0]
    heated = of_table({**COLUMNS, "temperature": [20.0, -5.0]})
    assert lacking(asked((0.1, 1.0), (1e5,), (20.0, -5.0)), heated) == [1, 2]
    assert lacking(asked((0.1,), (1e5,)), heated) == [0]

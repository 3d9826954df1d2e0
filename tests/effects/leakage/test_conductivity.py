"""The chart of what leaks: instants at which contact closes stay in it, and narrow constrictions are marked."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from parcontact.effects.leakage import pictures
from parcontact.effects.leakage.over_time import LeakInstant
from parcontact.results.panels import Axis, Panel, draw


def drawn(chart: Panel) -> dict[str, np.ndarray]:
    """Return what each line shows over the horizontal axis, by its label; `limits` are those of this axis."""
    axes = Figure().subplots()
    draw(chart, axes)
    lines = {str(line.get_label()).replace("\n", " "): np.array(line.get_xdata()) for line in axes.get_lines()}
    assert axes.get_yscale() == "log"
    return lines | {"limits": np.array(axes.get_xlim())}


def test_closed_instants_and_narrow_constrictions() -> None:
    """K is known at three of four instants along x; from the third on contact closes. At the second one the gap has
    9 nm."""
    at, flow = np.array([1.0, 2.0, 3.0, 4.0]), np.array([1e-20, 1e-24, 0.0, np.nan])
    narrowest = np.array([1e-6, 9e-9, 0.0, np.nan])
    chart = pictures.conductivity_panel(Axis("time", "s"), at, {"along x": flow}, {"along x": narrowest})
    shown = drawn(chart)
    assert shown["closed"].tolist() == [3.0]
    assert shown["constriction under 10 nm"].tolist() == [2.0]
    assert shown["limits"][0] <= 1.0
    assert shown["limits"][1] >= 3.0


def row(time: float, pressure: float, flow: float) -> LeakInstant:
    return LeakInstant(time, pressure, 0.1, flow, flow, 1, 1, 1e-7, np.nan, np.nan, 1e-7, 1e-7, 0.1, 0.1)


RAMP = [row(float(time), 1e5 * (1.0 + time), 1e-20) for time in range(3)]
HOLDS = [row(1.0, 1e5, 4e-20), row(2.0, 1e5 * (1.0 + 1e-12), 3e-20), row(3.0, 2e5, 2e-20), row(9.0, 2e5, 1e-20)]


@pytest.mark.parametrize(
    ("rows", "over", "name", "expected"),
    [
        (RAMP, "", "pressure", [1e5, 2e5, 3e5]),
        (RAMP, "time", "time", [0.0, 1.0, 2.0]),
        (HOLDS, "", "time", [1.0, 2.0, 3.0, 9.0]),
        (HOLDS, "pressure", "pressure", [1e5, 2e5]),  # the last instant of each
    ],
)
def test_what_k_is_drawn_over(rows: list[LeakInstant], over: str, name: str, expected: list[float]) -> None:
    chart = pictures.panel_of(rows, over)
    assert chart.x.name == name
    assert chart.series[0].x == pytest.approx(expected, rel=1e-9)
    assert len(chart.series[0].y) == len(expected)
    assert chart.series[0].y[-1] == rows[-1].flow_x


def test_the_flux_of_gaps_whose_cube_is_0() -> None:
    """Uniform flow through a gap of 1e-120 m: the cube of the gap underflows."""
    pressure = np.tile(np.linspace(1.0, 0.0, 5), (4, 1))
    inside = pictures.flux(np.full((4, 5), 1e-120), pressure, (1.0, 1.0))[:, 1:-1]
    np.testing.assert_array_equal(inside, np.ones((4, 3)))

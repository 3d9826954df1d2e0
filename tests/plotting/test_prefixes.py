"""Units with prefixes, as words and on axes."""

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.figure import Figure

from parcontact import printed
from parcontact.results import style


@pytest.mark.parametrize(("largest", "label"), [(3.2e-5, "µm"), (999.9, "m"), (1e3, "km"), (2e-12, "nm"), (0.0, "m")])
def test_prefixes(largest: float, label: str) -> None:
    found, size = printed.prefixed("m", largest)
    assert found == label
    assert not largest or 1.0 <= largest / size < 1e3 or label == "nm"


@pytest.mark.parametrize("value", [float("inf"), float("-inf"), float("nan")])
def test_no_prefix_without_a_size(value: float) -> None:
    """A table that somebody edited may have such cells."""
    assert printed.quantity(value, "m") == f"{value:g} m"


@pytest.mark.parametrize(
    ("value", "unit", "stated"),
    [
        (1041.67, "Pa", "1.04 kPa"),
        (999.96, "m", "1 km"),
        (2.5e-8, "m²", "0.025 mm²"),
        (3e-10, "m²", "300 µm²"),
        (0.05, "J/m²", "50 mJ/m²"),
        (0.3, "", "0.3"),
        (0.0, "s", "0 s"),
        (119.4, "s", "119 s"),
        (119.6, "s", "1.99 min"),  # 120 s in three digits
        (5400.0, "s", "90 min"),
        (86400.0, "s", "24 h"),
        (30 * 86400.0, "s", "30 days"),
        (-3.15576e8, "s", "-10 years"),
        (3.2e7, "s", "370 days"),
        (600.0, "N", "600 N"),
    ],
)
def test_numbers_with_prefixes(value: float, unit: str, stated: str) -> None:
    assert printed.quantity(value, unit) == stated


@pytest.mark.parametrize(
    ("end", "unit", "size"),
    [(60.0, "s", 1.0), (3600.0, "min", 60.0), (2.0e5, "days", 86400.0), (3.2e8, "years", 3.15576e7)],
)
def test_axes_of_long_times(end: float, unit: str, size: float) -> None:
    """Ticks are at whole or round numbers of the unit, not of seconds."""
    figure = Figure()
    axes = figure.subplots()
    axes.plot([0.0, end], [0.0, 1.0])
    style.label(axes.xaxis, "time", "s")
    figure.draw_without_rendering()
    assert axes.get_xlabel() == f"time [{unit}]"
    shown = [float(tick.get_text().replace("−", "-")) for tick in axes.get_xticklabels()]
    np.testing.assert_allclose(axes.get_xticks(), np.array(shown) * size, rtol=1e-9, atol=1e-9 * end)
    assert all(len(tick.get_text()) <= 4 for tick in axes.get_xticklabels())


@pytest.mark.parametrize("width", [2.2, 3.0, 6.0])
def test_marks_of_long_times_do_not_touch(width: float) -> None:
    """In panels of a half and of the whole width, from a millisecond to ten years."""
    figure = Figure(figsize=(width, 2.0), layout="constrained")
    axes = figure.subplots()
    axes.set(xscale="log", xlim=(1e-3, 3.2e8))
    assert style.label_log_times(axes.xaxis, "time")
    figure.draw_without_rendering()
    boxes = [text.get_window_extent() for text in axes.get_xticklabels()]
    assert len(boxes) >= 3
    assert all(one.x1 < other.x0 for one, other in pairwise(boxes))


@pytest.mark.parametrize(("low", "high"), [(1.6, 40.0), (2e-4, 8e-3), (11.0, 90.0), (0.11, 9.0), (1.0, 100.0)])
def test_logarithmic_axes_have_several_labels(low: float, high: float) -> None:
    """A single power of ten on an axis does not tell its values."""
    axes = Figure().add_subplot()
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    style.thin_log_ticks(axes.xaxis)
    inside = [place for place in axes.xaxis.get_majorticklocs() if low <= place <= high]
    assert 2 <= len(inside) <= 7
    assert all(axes.xaxis.get_major_formatter()(place) for place in inside)

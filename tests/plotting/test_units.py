"""Units with prefixes, as words and on axes."""

import pytest
from matplotlib.figure import Figure

from parcontact.plotting import units


@pytest.mark.parametrize(("largest", "label"), [(3.2e-5, "µm"), (999.9, "m"), (1e3, "km"), (2e-12, "nm"), (0.0, "m")])
def test_prefixes(largest: float, label: str) -> None:
    found, size = units.prefixed("m", largest)
    assert found == label
    assert not largest or 1.0 <= largest / size < 1e3 or label == "nm"


@pytest.mark.parametrize(
    ("value", "unit", "told"),
    [
        (1041.67, "Pa", "1.04 kPa"),
        (999.96, "m", "1 km"),
        (2.5e-8, "m²", "0.025 mm²"),
        (3e-10, "m²", "300 µm²"),
        (0.05, "J/m²", "50 mJ/m²"),
        (0.3, "", "0.3"),
        (0.0, "s", "0 s"),
    ],
)
def test_numbers_with_prefixes(value: float, unit: str, told: str) -> None:
    assert units.text(value, unit) == told


@pytest.mark.parametrize(
    ("high", "name", "ticks"), [(2e4, "load [kPa]", ["0", "10", "20"]), (0.2, "load [mPa]", ["0", "100", "200"])]
)
def test_axes_have_prefixes(high: float, name: str, ticks: list[str]) -> None:
    figure = Figure()
    axes = figure.subplots()
    axes.plot([0.0, 0.5 * high, high])
    axes.set(ylim=(0.0, high), yticks=[0.0, 0.5 * high, high])
    units.label(axes.yaxis, "load", "Pa")
    figure.draw_without_rendering()
    assert axes.get_ylabel() == name
    assert [text.get_text() for text in axes.get_yticklabels()] == ticks

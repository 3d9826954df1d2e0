"""Pictures of a study: everything is on the page, nothing overlaps, numbers stand for settings."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from drawing import outside, touching
from matplotlib.figure import Figure

from parcontact.plotting import study

QUANTITIES = ("mu_max", "mu_dyn", "area_corrected")


def points(fall: float) -> list[study.Point]:
    """Nine settings of each integrator, each eight times as dear as the one before, with `fall` of its error."""
    return [
        study.Point(8.0**k, 1e-2 * 8.0**k, fall**k * worse, integrator, f"{64 * 2**k}, 0.25, 0.0005, double", best)
        for k in range(9)
        for integrator, worse, best in (("exponential", 0.3, True), ("backward-euler", 0.6, False))
    ]


@pytest.mark.parametrize("fall", [0.5, 0.05, 1.0])
def test_what_accuracy_costs(tmp_path: Path, drawn: list[Figure], fall: float) -> None:
    """Errors over two, over ten, and over no decades: notes are numbers at the points and named below the panels."""
    study.plot(tmp_path, [], dict.fromkeys(QUANTITIES, points(fall)), dict.fromkeys(QUANTITIES, 0.0))
    (figure,) = drawn
    assert not touching(figure)
    assert not outside(figure)
    numbers = {text.get_text() for axes in figure.axes for text in axes.texts}
    assert numbers == {str(k + 1) for k in range({0.5: 9, 0.05: 6, 1.0: 1}[fall])}
    key = [text.get_text() for text in figure.legends[-1].get_texts()]
    assert key[0] == "1: 64, 0.25, 0.0005, double"
    assert len(key) == len(numbers)


@pytest.mark.parametrize("unknown", [math.nan, math.inf])
def test_quantities_without_an_error_are_left_out(tmp_path: Path, drawn: list[Figure], unknown: float) -> None:
    """As friction of a body that does not slide, and what only one case is known of."""
    nothing = [study.Point(1.0, 1.0, unknown, "exponential", "64, auto, 0.005, double", False)]
    assert study.plot(tmp_path, [], {"mu_max": nothing}, {})[0].stat().st_size > 0
    study.plot(tmp_path, [], {"mu_max": nothing, "area_corrected": points(0.5)}, {})
    assert [axes.get_ylabel() for axes in drawn[1].axes] == ["contact area, corrected:\nerror [%]", ""]


def test_cases_that_are_alike(tmp_path: Path, drawn: list[Figure]) -> None:
    """One error, and one case: their axes have a range all the same, without a warning."""
    alike = [replace(one, error=0.02) for one in points(1.0)]
    study.plot(tmp_path, [], {"mu_max": alike, "mu_dyn": alike[:1]}, {})
    for axes in drawn[0].axes:
        low, high = axes.get_ylim()
        assert (low * high, high / low) == (pytest.approx(4.0), pytest.approx(10.0))


def test_how_errors_fall(tmp_path: Path, drawn: list[Figure]) -> None:
    """One panel below the other, with one key above them; what is not known of the reference is grey."""
    curves = [
        study.Curve(name, integrator, ladder, [1.0, 0.5, 0.25], [0.1, 0.02, 1e-5])
        for name in QUANTITIES
        for integrator in study.INTEGRATORS
        for ladder in ("mesh and time together", "mesh alone", "time alone")
    ]
    study.plot(tmp_path, curves, {}, dict.fromkeys(QUANTITIES, 1e-4))
    figure = drawn[0]
    assert not touching(figure)
    assert not outside(figure)
    assert len(figure.axes) == 3
    assert len(figure.legends[0].get_texts()) == 6
    assert all(len(axes.patches) == 1 for axes in figure.axes)

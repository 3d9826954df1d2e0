"""Pictures of a study: everything is on the page, nothing overlaps."""

import math
from pathlib import Path

import numpy as np
import pytest
from drawing import outside, touching
from matplotlib.figure import Figure

from parcontact.plotting import study_pictures

QUANTITIES = ("mu_max", "mu_end", "area_corrected")


def points(fall: float) -> list[study_pictures.StudyPoint]:
    """Nine settings of each integrator, each eight times as dear as the one before, with `fall` of its error."""
    return [
        study_pictures.StudyPoint(8.0**k, 1e-2 * 8.0**k, fall**k * worse, integrator, best)
        for k in range(9)
        for integrator, worse, best in (("exponential", 0.3, True), ("backward-euler", 0.6, False))
    ]


@pytest.mark.parametrize("fall", [0.5, 0.05, 1.0])
def test_what_accuracy_costs(tmp_path: Path, drawn: list[Figure], fall: float) -> None:
    """Errors over two, over ten, and over no decades: the points of both integrators, a line through the best."""
    study_pictures.plot_study(tmp_path, [], dict.fromkeys(QUANTITIES, points(fall)), dict.fromkeys(QUANTITIES, 0.0))
    (figure,) = drawn
    assert not touching(figure)
    assert not outside(figure)
    for axes in figure.axes[::2]:  # over the work
        every, line = axes.get_lines()[:-1], axes.get_lines()[-1]
        assert [len(np.asarray(one.get_xdata())) for one in every] == [9, 9]
        assert np.array_equal(np.asarray(line.get_xdata()), np.asarray(every[0].get_xdata()))


@pytest.mark.parametrize("unknown", [math.nan, math.inf])
def test_quantities_without_an_error_are_left_out(tmp_path: Path, drawn: list[Figure], unknown: float) -> None:
    """As friction of a body that does not slide, and what only one case is known of."""
    nothing = [study_pictures.StudyPoint(1.0, 1.0, unknown, "exponential", False)]
    assert study_pictures.plot_study(tmp_path, [], {"mu_max": nothing}, {})[0].stat().st_size > 0
    study_pictures.plot_study(tmp_path, [], {"mu_max": nothing, "area_corrected": points(0.5)}, {})
    assert [axes.get_ylabel() for axes in drawn[1].axes] == ["contact area, corrected:\nerror [%]", ""]


def test_how_errors_fall(tmp_path: Path, drawn: list[Figure]) -> None:
    """One panel below the other, with one key above them; what is not known of the reference is grey."""
    curves = [
        study_pictures.StudyCurve(name, integrator, ladder, [1.0, 0.5, 0.25], [0.1, 0.02, 1e-5])
        for name in QUANTITIES
        for integrator in study_pictures.INTEGRATORS
        for ladder in ("mesh and time together", "mesh alone", "time alone")
    ]
    study_pictures.plot_study(tmp_path, curves, {}, dict.fromkeys(QUANTITIES, 1e-4))
    figure = drawn[0]
    assert not touching(figure)
    assert not outside(figure)
    assert len(figure.axes) == 3
    assert len(figure.legends[0].get_texts()) == 9
    assert all(len(axes.patches) == 1 for axes in figure.axes)

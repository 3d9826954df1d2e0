"""Pictures of a study: everything is on the page, nothing overlaps."""

from pathlib import Path

from drawing import entries, outside, touching
from matplotlib.figure import Figure

from parcontact.door import study

QUANTITIES = ("mu_max", "mu_dyn", "contact_area_corrected")


def test_how_errors_fall(tmp_path: Path, drawn: list[Figure]) -> None:
    """Over refinement and over time, one quantity below the other; what is not known of the reference is grey."""
    curves = [
        study.StudyCurve(name, integrator, ladder, [1.0, 0.5, 0.25], [0.1, 0.02, 1e-5], [0.5, 3.0, 20.0])
        for name in QUANTITIES
        for integrator in study.COLORS
        for ladder in ("mesh and time together", "mesh alone", "time alone")
    ]
    study.plot_study(tmp_path, curves, dict.fromkeys(QUANTITIES, 1e-4))
    figure = drawn[0]
    assert not touching(figure)
    assert not outside(figure)
    assert len(figure.axes) == 6
    assert len(entries(figure)) == 9
    assert all(len(axes.patches) == 1 for axes in figure.axes)


def test_nothing_is_drawn_where_nothing_is_refined(tmp_path: Path) -> None:
    assert study.plot_study(tmp_path, [], {}) is None
    assert not list(tmp_path.iterdir())

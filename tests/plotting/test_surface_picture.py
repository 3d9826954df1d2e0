"""The picture of a rigid surface."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from parcontact.physics.roughness import surface_statistics
from parcontact.results import inputs
from parcontact.results.panels import draw


def test_a_map_has_the_proportions_of_its_box() -> None:
    """6 mm x 4 mm are drawn 1.5 times as wide as high, in a panel of any shape."""
    heights, size = np.random.default_rng(1).standard_normal((20, 60)), (6e-3, 4e-3)
    figure = Figure(figsize=(5.0, 5.0))
    axes = figure.subplots()
    sketch = inputs.Sketch(heights, size, surface_statistics(heights, size))
    draw(inputs.panels_of(sketch)["map of the heights"], axes)
    figure.draw_without_rendering()
    box = axes.get_window_extent()
    assert box.width / box.height == pytest.approx(1.5, rel=1e-6)


@pytest.mark.parametrize("shape", [(2, 20), (20, 1), (1, 1)])
def test_a_map_of_few_rows_has_all_panels(shape: tuple[int, int]) -> None:
    """Two rows or columns have no waves of their own: no spectrum is drawn along them."""
    heights, size = np.random.default_rng(1).standard_normal(shape), (6e-3, 4e-3)
    sketch = inputs.Sketch(heights, size, surface_statistics(heights, size))
    for panel in inputs.panels_of(sketch).values():
        figure = Figure()
        draw(panel, figure.subplots())
        figure.draw_without_rendering()

"""Pictures of bands: bars of all bands add up to the friction of the curve; lines of area and temperature."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from parcontact.results import band_charts, style
from parcontact.results.panels import draw
from plotting.many import write_curve

HEAD = "velocity,pressure,temperature,band,long_wavelength,short_wavelength,friction,contact_area,flash_temperature"


def table(directory: Path, heat: str = "5.0") -> None:
    """Two bands at three speeds and two pressures."""
    rows = [
        f"{speed},{pressure},,{band},{1e-2 / 10**band},{1e-3 / 10**band},{0.1 * (band + 1)},{0.5 / (band + 1)},{heat}\n"
        for pressure in (1e5, 2e5)
        for speed in (1.0, 0.01, 0.1)
        for band in (0, 1)
    ]
    (directory / "bands.csv").write_text(HEAD + "\n" + "".join(rows))


def test_bars_add_up(tmp_path: Path) -> None:
    """Of the first pressure, sorted by speed: 0.1 at the bottom and 0.2 above, with one width in the logarithm."""
    table(tmp_path)
    (bars, area, heat) = band_charts.panels_of_bands(tmp_path)
    axes = Figure().add_subplot()
    draw(bars, axes)
    boxes = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    assert len(boxes) == 6
    assert [box.get_height() for box in boxes] == pytest.approx([0.1] * 3 + [0.2] * 3)
    assert [box.get_y() for box in boxes] == pytest.approx([0.0] * 3 + [0.1] * 3)
    middles = [np.sqrt(box.get_x() * (box.get_x() + box.get_width())) for box in boxes[:3]]
    assert middles == pytest.approx([0.01, 0.1, 1.0])
    assert axes.get_ylim()[1] > 0.3
    assert area.series[0].x.tolist() == pytest.approx([10.0, 100.0])
    assert area.series[0].y.tolist() == pytest.approx([0.5, 0.25])
    assert heat.series[0].y.tolist() == [5.0, 5.0]


@pytest.mark.parametrize(("temperature", "bars"), [(0.0, 1), (20.0, 0)])
def test_theory_is_drawn_at_its_temperature(tmp_path: Path, temperature: float, bars: int) -> None:
    """Theory for one temperature has the colour of that temperature, and is drawn over bars at this temperature only,
    which are those of the first."""
    write_curve(tmp_path, bands=2, temperatures=(0.0, 20.0))
    for name in ("steady_theory.csv", "bands_theory.csv"):
        head, *rows = (tmp_path / name).read_text().splitlines()
        place = head.split(",").index("temperature")
        kept = [row for row in rows if float(row.split(",")[place]) == temperature]
        (tmp_path / name).write_text("".join(f"{row}\n" for row in [head, *kept]))
    panels = {panel.key: panel for panel in band_charts.panels_of_curve(tmp_path)}
    for key in ("steady friction", "steady area"):
        cold, warm, entry, *theory = panels[key].series
        assert entry.name == "theory"
        assert [line.look["color"] for line in theory] == [(cold, warm)[temperature > 0.0].look["color"]]
    assert sum(line.name == "theory" for line in panels["bands"].series) == bars
    assert sum(line.name == band_charts.ALONE for line in panels["bands area"].series) == bars


def test_no_heat_no_temperatures(tmp_path: Path) -> None:
    table(tmp_path, heat="")
    assert [chart.key for chart in band_charts.panels_of_bands(tmp_path)] == ["bands", "bands area"]
    (tmp_path / "bands.csv").unlink()
    assert band_charts.panels_of_bands(tmp_path) == []


@pytest.mark.parametrize("bars", [False, True])
def test_no_legend_lies_on_bars(bars: bool) -> None:
    """Bars fill their panel up to its top, lines seldom do."""
    axes = Figure().add_subplot()
    axes.plot([0.0, 1.0], [0.0, 1.0], label="theory")
    if bars:
        axes.bar([0.0, 1.0], [1.0, 1.0])
    (below,) = style.place_legends([[axes]])
    legend = axes.get_legend()
    assert legend is not None
    top = legend.get_window_extent().y1
    assert (below > 0.0) == bars
    assert (top < axes.bbox.y0) == bars

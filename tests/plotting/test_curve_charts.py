"""Pictures of friction curves: a title with the load, bars of errors, the corrected area, one key for all panels."""

from pathlib import Path

import numpy as np
import pytest
from drawing import ELASTIC, SPHERE, WAVE, touching
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from parcontact import job
from parcontact.results import band_charts, plots

HEAD = (
    "velocity,pressure,friction,contact_area,contact_area_corrected,error_friction,error_area,temperature,shift_factor"
)


def curve(
    directory: Path, scene: str = WAVE, pressures: tuple[float, ...] = (1e3,), degrees: tuple[float, ...] = (20.0,)
) -> Path:
    """A directory with three speeds at each pressure and temperature, whose areas are 0.2, corrected 0.15 ± 10 %."""
    rows = [
        f"{v},{p},0.1,0.2,0.15,{error},0.1,{t},1.0\n"
        for t in degrees
        for p in pressures
        for v, error in ((0.01, 0.05), (0.1, 2.0), (1.0, "nan"))
    ]
    (directory / "steady.csv").write_text(HEAD + "\n" + "".join(rows))
    text = f"title: A road\n{scene}{ELASTIC}steady: {{velocities: [1.0], pressures: [1.0]}}\n"
    (directory / "job.yaml").write_text(text)
    (directory / "steady.resolved.yaml").write_text(job.load(directory / "job.yaml").resolved())
    return directory / "steady.csv"


@pytest.mark.parametrize(
    ("scene", "pressures", "title"),
    [
        (WAVE, (1e3,), "A road: 1 kPa"),
        (WAVE, (1e3, 1e3 * (1 + 1e-9)), "A road: 1 kPa"),
        (WAVE, (1e3, 2e3), "A road"),
        (SPHERE, (1e3,), "A road: 4 mN"),
    ],
)
def test_the_title_has_the_load_of_all_points(
    tmp_path: Path, drawn: list[Figure], scene: str, pressures: tuple[float, ...], title: str
) -> None:
    """As a force where the scene is free: on 2 mm x 2 mm. In steady.png and in what `plot` draws."""
    table = curve(tmp_path, scene, pressures)
    plots.draw_steady(table)
    plots.plot([tmp_path])
    assert [figure.get_suptitle() for figure in drawn] == [title, title]
    assert not [pair for figure in drawn for pair in touching(figure)]


def test_errors_and_the_corrected_area(tmp_path: Path, drawn: list[Figure]) -> None:
    """Bars of known errors: of more than all of a value they end above 0; where none is known there is none."""
    plots.draw_steady(curve(tmp_path))
    friction, area = drawn[0].axes
    (line,) = area.get_lines()[:1]
    assert line.get_ydata() == pytest.approx([0.15, 0.15, 0.15])
    for axes, expected in ((friction, [(0.095, 0.105), (0.001, 0.3), (0.1, 0.1)]), (area, [(0.135, 0.165)] * 3)):
        (bars,) = (one for one in axes.collections if isinstance(one, LineCollection))
        ends = [(low, high) for (_, low), (_, high) in bars.get_segments()]
        assert np.allclose(ends, expected)
    assert area.get_ylim()[1] > 0.165  # bars are not cut off, but those of more than all of a value
    assert friction.get_ylim()[1] > 0.2


def test_temperatures_and_loads_have_looks_of_their_own(tmp_path: Path) -> None:
    """Nine loads have colours and two temperatures have marks, not eighteen lines eighteen shades."""
    loads, degrees = [1e4 * (k + 1) for k in range(9)], [0.0, 40.0]
    rows = [f"{v},{p},{t},0.1,0.2\n" for t in degrees for p in loads for v in (0.1, 1.0)]
    (tmp_path / "steady.csv").write_text("velocity,pressure,temperature,friction,contact_area\n" + "".join(rows))
    friction, _ = band_charts.panels_of_curve(tmp_path)
    looks = [(line.look["color"], line.look["marker"]) for line in friction.series]
    assert len(set(looks)) == 18
    assert [len(set(one)) for one in zip(*looks, strict=True)] == [9, 2]
    for line in friction.series:
        assert line.look["marker"] == ("o" if line.name.startswith("0 °C") else "s")


def test_a_table_without_errors(tmp_path: Path) -> None:
    """Older tables have none, and no corrected area: the counted one is drawn."""
    (tmp_path / "steady.csv").write_text("velocity,pressure,friction,contact_area\n1.0,1e3,0.1,0.2\n")
    friction, area = band_charts.panels_of_curve(tmp_path)
    assert area.series[0].y.tolist() == [0.2]
    assert friction.series[0].error is None

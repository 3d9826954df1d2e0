"""`parcontact plot`: a picture with the panels that a job has."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

from parcontact.errors import InputError
from parcontact.record import plots

STATIC = """\
grid: {points: 32, size: 2.0e-3}
surface: {shape: wave, amplitude: 1.0e-6, waves: [1, 1]}
material: {model: elastic, shear_modulus: 1.0e6}
history: [{pressure: 1.0e3}, {pressure: 2.0e3}]
output: {fields: [pressure, gap]}
"""
SLIDING = """\
grid: {points: 32, size: 2.0e-3}
surface: {shape: wave, amplitude: 1.0e-6, waves: [1, 1]}
material: {model: zener, modulus_inf: 1.0e6, branches: [{modulus: 1.0e6, relaxation_time: 1.0e-3}]}
history: [{pressure: 1.0e3, velocity: 0.1, distance: 1.0e-3, cells_per_step: 1}]
output: {energy: true}
"""


@pytest.mark.parametrize(("text", "panels"), [(STATIC, 3), (SLIDING, 3)], ids=["static", "sliding"])
def test_picture_of_a_run(
    run_parcontact: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, panels: int
) -> None:
    (tmp_path / "job.yaml").write_text(text)
    assert run_parcontact(["job.yaml", "--quiet"], ranks=0).returncode == 0
    drawn: list[Figure] = []

    def save(figure: Figure, *args: Any, **options: Any) -> None:
        drawn.append(figure)
        draw(figure, *args, **options)

    draw = Figure.savefig
    monkeypatch.setattr(Figure, "savefig", save)
    picture = plots.plot(tmp_path / "out/job")
    assert picture.read_bytes().startswith(b"\x89PNG")
    named = [axes for axes in drawn[0].axes if axes.get_xlabel()]
    assert len(named) == panels
    assert all(axes.get_ylabel() or axes.get_title() for axes in named)


def test_directory_without_a_run(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no measures\.csv"):
        plots.plot(tmp_path)

"""Which maps a run saves: by `output.every` and nothing else."""

from pathlib import Path

import h5py
import pytest
from conftest import Main

JOB = """\
grid: {{points: 16, size: 1.0e-3}}
surface: {{shape: wave, amplitude: 1.0e-6, waves: [1, 0]}}
material: {{model: zener, modulus_inf: 1.0e+6, branches: [{{modulus: 1.0e+6, relaxation_time: 1.0e-3}}]}}
output: {{fields: [gap], every: 3}}
history: [{{pressure: 1.0e+4, duration: 1.0e-3{steps}}}]
"""


@pytest.mark.parametrize("steps", ["", ", time_step: 1.0e-4"])
def test_every_third_step_and_the_last(main: Main, tmp_path: Path, steps: str) -> None:
    """Also where steps are chosen, whose number is not known before; not the state before the first step."""
    (tmp_path / "job.yaml").write_text(JOB.format(steps=steps))
    assert main("job.yaml", "--quiet")[0] == 0
    last = len((tmp_path / "out" / "job" / "measures.csv").read_text().splitlines()) - 2
    with h5py.File(tmp_path / "out" / "job" / "fields.h5") as file:
        assert file["step"][:].tolist() == sorted({*range(3, last + 1, 3), last})

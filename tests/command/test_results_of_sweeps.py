"""A sweep of friction curves through the verbs that come after it, and a table of somebody else next to a run."""

from pathlib import Path

import pytest
from conftest import WORLD, Main

pytestmark = pytest.mark.skipif(WORLD.size > 1, reason="for one process")

JOB = """\
grid: {points: 16, size: 1.0e-3}
surface: {shape: rough, hurst: 0.8, rms_slope: 0.05, long_wavelength: 5.0e-4, short_wavelength: 2.5e-4, seed: 1}
material: {model: zener, modulus_inf: 1.0e6, branches: [{modulus: 1.0e6, relaxation_time: 1.0e-3}]}
numerics: {accuracy: 0.3}
"""
CURVE = f"{JOB}steady: {{velocities: [0.01, 0.1], pressures: [1.0e4]}}\n"
RUN = f"{JOB}history: [{{pressure: 1.0e4, duration: 1.0e-3, time_step: 5.0e-4}}]\n"


def test_theory_and_report_of_a_sweep_of_curves(main: Main, tmp_path: Path) -> None:
    """Both work, and the report says nothing of this machine's directories."""
    Path("job.yaml").write_text(f"{CURVE}sweep: {{surface.0.rms_slope: [0.05, 0.1]}}\n")
    assert main("job.yaml", "--quiet", "--out", "here")[0] == 0
    assert main("theory", "job.yaml", "--out", "theory")[0] == 0
    assert main("report", "here")[0] == 0
    assert str(tmp_path) not in Path("here/report.html").read_text()


def test_a_foreign_table_of_theory(main: Main) -> None:
    """One sentence: it lacks the columns of the theory."""
    Path("job.yaml").write_text(RUN)
    assert main("job.yaml", "--quiet", "--out", "here")[0] == 0
    Path("here/theory.csv").write_text("a,b\n1,2\n")
    for verb in ("plot", "info", "report"):
        code, shown, said = main(verb, "here")
        assert code == 2
        assert "theory.csv has no column time" in shown + said
        assert "Traceback" not in said

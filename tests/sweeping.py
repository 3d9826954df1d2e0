"""A sweep of six cases, and the tables that it writes."""

from pathlib import Path

from csv_rows import Rows, rows

JOB = """\
grid: {points: 34, size: 1.0e-3}
surface: {shape: rough, hurst: 0.9, long_wavelength: 2.5e-4, short_wavelength: 2.4e-4, rms_slope: 0.01, seed: 1}
material: {model: zener, modulus_inf: 0.275e+6, branches: [{modulus: 2.475e+6, relaxation_time: 1.0e-3}]}
history:
  - {pressure: 1.0e+5, duration: 1.0e-3, time_step: 5.0e-4}
  - {pressure: 1.0e+5, velocity: 0.1, distance: 5.0e-4, cells_per_step: 1}
sweep:
  - {history.1.velocity: [0.01, 0.1]}
  - {surface.seed: [1, 2, 3]}
"""


def table(name: str = "sweep.csv", directory: Path = Path("out/job")) -> Rows:
    return rows(directory / name)

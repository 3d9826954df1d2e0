"""A rubber whose truth is known, measured with noise: what the tests of fits start from.

Moduli are summed here from their definition, in complex arithmetic, without the program's own functions.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MODULUS_INF = 1.0e6  # Pa
MODULI = 1e6 * np.array([300.0, 350.0, 220.0, 80.0, 24.0, 7.0, 2.4, 1.0, 0.5, 0.3, 0.2, 0.15])  # Pa
TIMES = 5e-9 * 10.0 ** np.arange(12)  # s at the reference
C1, C2, REFERENCE = 8.86, 101.6, 20.0
TEMPERATURES = (-20.0, 0.0, 20.0, 40.0, 60.0)  # deg C
FREQUENCIES = np.geomspace(0.1, 100.0, 25)  # Hz


def log_factor(temperature: float) -> float:
    """log10 of a_T."""
    return -C1 * (temperature - REFERENCE) / (C2 + temperature - REFERENCE)


def complex_modulus(omega: Array, temperature: float = REFERENCE) -> NDArray[np.complex128]:
    """G* [Pa] at angular frequencies [rad/s]."""
    iwt = 1j * np.asarray(omega)[:, None] * TIMES * 10.0 ** log_factor(temperature)
    return np.asarray(MODULUS_INF + (MODULI * iwt / (1.0 + iwt)).sum(axis=1))


def relaxation(t: Array) -> Array:
    """G(t) [Pa] at the reference."""
    return np.asarray(MODULUS_INF + (MODULI * np.exp(-np.asarray(t)[:, None] / TIMES)).sum(axis=1))


def write_sweeps(path: Path, noise: float = 0.0, temperatures: tuple[float, ...] = TEMPERATURES, seed: int = 1) -> Path:
    """Young's moduli of frequency sweeps at some temperatures, as pyvisco's files have them."""
    dice = np.random.default_rng(seed)
    lines = ["f_set,E_stor,E_loss,T", "Hz,MPa,MPa,°C"]
    for temperature in temperatures:
        for f, g in zip(FREQUENCIES, complex_modulus(2 * np.pi * FREQUENCIES, temperature), strict=True):
            storage, loss = 3e-6 * np.array([g.real, g.imag]) * (1.0 + noise * dice.standard_normal(2))
            lines.append(f"{f:.8g},{storage:.8g},{loss:.8g},{temperature:g}")
    path.write_text("\n".join(lines) + "\n")
    return path

"""A road and a rubber as a laboratory would deliver them, made up, so that the truth is known: python jobs/road/make.py

It writes into measured/ in its own directory, which is part of the project: road.npy, 1.8 x 1.8 mm of a larger road in
um, tilted, 2 % of its points missing, its edges fitting nowhere; spectrum.csv, the spectrum of its finer waves down to
1 um; compound.csv, Young's moduli at five temperatures with 2 % noise. In truth/: the whole road of 2 x 2 mm, periodic,
in m; compound.yaml with the relaxation function and the shift that the table was made from.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

HERE = Path(__file__).parent
LENGTH, POINTS = 2.0e-3, 256  # of the whole road [m]
SEEN = 232  # points of it along a side that are measured
LONGEST, SHORTEST, HURST, SLOPE = 2.5e-4, 6.25e-5, 0.8, 0.08
FINEST = 1.0e-6  # of the spectrum [m]
MISSING, TILT = 0.02, (0.03, -0.01)
MODULUS_INF, MODULI = 1.0e6, 1e6 * np.array([300, 350, 220, 80, 24, 7, 2.4, 1.0, 0.5, 0.3, 0.2, 0.15])  # [Pa]
TIMES = 5e-9 * 10.0 ** np.arange(12)  # [s], at the reference
C1, C2, REFERENCE = 8.86, 101.6, 20.0
TEMPERATURES, FREQUENCIES = (-20.0, 0.0, 20.0, 40.0, 60.0), np.geomspace(0.1, 100.0, 25)  # [deg C], [Hz]
NOISE = 0.02


def road() -> NDArray[np.float64]:
    """The whole road [m], self-affine between two wavelengths."""
    dice = np.random.default_rng(4)
    q = 2 * np.pi * np.fft.fftfreq(POINTS, LENGTH / POINTS)
    radius = np.hypot(q, q[:, None])
    inside = (radius > 0.999 * 2 * np.pi / LONGEST) & (radius < 1.001 * 2 * np.pi / SHORTEST)
    amplitude = np.where(inside, np.maximum(radius, q[1]) ** (-1.0 - HURST), 0.0)
    waves = amplitude * np.exp(1j * np.angle(np.fft.fft2(dice.standard_normal((POINTS, POINTS)))))
    slope = np.sqrt(np.sum(np.abs(waves / POINTS**2) ** 2 * radius**2))
    return np.asarray(np.fft.ifft2(waves * SLOPE / slope).real)


def measured(heights: NDArray[np.float64]) -> NDArray[np.float64]:
    """What an instrument says of a part of it [um]."""
    part = heights[:SEEN, :SEEN].copy()
    y, x = np.mgrid[0:SEEN, 0:SEEN] * (LENGTH / POINTS)
    part += TILT[0] * x + TILT[1] * y
    part[np.random.default_rng(5).random(part.shape) < MISSING] = np.nan
    return 1e6 * part


def spectrum() -> str:
    """The isotropic spectrum of waves too short for the map, which goes on as that of the map."""
    ends = 2 * np.pi / np.array([LONGEST, SHORTEST])
    power = 2.0 - 2.0 * HURST
    constant = SLOPE**2 * power / (2 * np.pi * (ends[1] ** power - ends[0] ** power))
    q = np.geomspace(ends[1], 2 * np.pi / FINEST, 20)
    rows = [f"{k:.8g},{constant * k ** (-2 - 2 * HURST):.8g}" for k in q]
    return "\n".join(["q[1/m],C2D[m^4]", *rows]) + "\n"


def table() -> str:
    """Moduli in tension, at every temperature and frequency."""
    dice = np.random.default_rng(6)
    lines = ["f[Hz],E'[MPa],E''[MPa],T[C]"]
    for temperature in TEMPERATURES:
        times = TIMES * 10.0 ** (-C1 * (temperature - REFERENCE) / (C2 + temperature - REFERENCE))
        phase = 2j * np.pi * FREQUENCIES[:, None] * times
        for f, g in zip(FREQUENCIES, MODULUS_INF + (MODULI * phase / (1 + phase)).sum(axis=1), strict=True):
            storage, loss = 3e-6 * np.array([g.real, g.imag]) * (1 + NOISE * dice.standard_normal(2))
            lines.append(f"{f:.6g},{storage:.6g},{loss:.6g},{temperature:g}")
    return "\n".join(lines) + "\n"


def compound() -> str:
    """The truth as a material that a job can include."""
    pairs = zip(MODULI.tolist(), TIMES.tolist(), strict=True)
    branches = [f"  - {{modulus: {modulus!r}, relaxation_time: {time!r}}}" for modulus, time in pairs]
    shift = f"shift: {{law: wlf, C1: {C1}, C2: {C2}, reference: {REFERENCE}}}"
    return "\n".join(["model: zener", f"modulus_inf: {MODULUS_INF!r}", shift, "branches:", *branches]) + "\n"


def main() -> None:
    for name in ("measured", "truth"):
        (HERE / name).mkdir(exist_ok=True)
    heights = road()
    np.save(HERE / "truth" / "road.npy", heights)
    np.save(HERE / "measured" / "road.npy", measured(heights).astype(np.float32))
    (HERE / "measured" / "compound.csv").write_text(table())
    (HERE / "measured" / "spectrum.csv").write_text(spectrum())
    (HERE / "truth" / "compound.yaml").write_text(compound())


if __name__ == "__main__":
    main()

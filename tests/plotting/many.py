"""Pictures with many of everything: each function draws one kind of picture into a directory, from tables with made-up
numbers, from a small run, or from `run` in the directory, which `write_run` has made."""

import csv
import shutil
from collections.abc import Callable, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from drawing import SPHERE, STRIP, WAVE, ZENER, asked, ran

from parcontact import job
from parcontact.__main__ import main
from parcontact.door import study
from parcontact.results import page, plots, report_sections
from parcontact.rubber import compound

BANDS, VELOCITIES, TEMPERATURES, PRESSURES = 12, np.logspace(-3, 1, 9), (0.0, 20.0, 40.0), (1e5, 4e5)
BRANCHES, CASES, RUNS, INSTANTS = 40, 24, 3, 24  # branches of the fit: no picture of a curve shows them
TITLE = "Ninety letters for a tread compound with silica on dry asphalt of a country road, wheel locked"
LISTED = ", ".join(f"{{modulus: {1e6 * 1.1**k:.6g}, relaxation_time: {10.0 ** (-0.3 * k):.6g}}}" for k in range(4))
SHIFTED = "model: zener, modulus_inf: 1.0e6, shift: {law: wlf, C1: 8.86, C2: 101.6, reference: 20}"
MATERIAL = f"material: {{{SHIFTED}, branches: [{LISTED}]}}\n"
STEADY = "steady: {velocities: [1.0], pressures: [1.0e5]}\n"
ROUGH = (
    "surface: {{shape: rough, hurst: 0.8, rms_slope: {slope}, seed: 1, long_wavelength: 1.0e-3, "
    "short_wavelength: {short}}}\n"
)
STICK = """
interface: {coefficient: 0.5, stick: true}
output: {fields: [pressure, gap, height, traction], energy: true}
"""


def _save(path: Path, head: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([head, *rows])


def _read(path: Path) -> list[list[str]]:
    with path.open(newline="") as file:
        return list(csv.reader(file))


def _save_job(directory: Path, text: str, name: str = "steady.resolved.yaml") -> None:
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "job.yaml").write_text(f"title: {TITLE}\n{text}")
    (directory / name).write_text(job.load(directory / "job.yaml").resolved())


def write_curve(
    directory: Path,
    pressures: Sequence[float] = PRESSURES[:1],
    bands: int = 0,
    share: float = 1.0,
    temperatures: Sequence[float] = TEMPERATURES,
) -> Path:
    """Write a friction curve with errors, heat and theory, and its bands."""
    head = [
        *("velocity", "pressure", "friction", "contact_area", "contact_area_corrected", "error_friction", "error_area"),
        *("temperature", "shift_factor", "flash_temperature", "seconds", "operator_calls"),
    ]
    rows, parts = list[tuple[float, ...]](), list[tuple[float, ...]]()
    for t, p, v in product(temperatures, pressures, VELOCITIES):
        factor = 10.0 ** (-0.05 * (t - 20.0))
        mu = share * 0.8 * np.exp(-0.1 * np.log(factor * v / 0.01) ** 2)
        area = 2e-8 * p / share / (1.0 + factor * v) ** 0.3
        rows.append((v, p, mu, 1.2 * area, area, 0.08, 0.06, t, factor, 12.0 * mu * np.sqrt(v), 1.0, 10))
        for band in range(bands):
            long, short = (1e-2 * 10.0 ** (-0.5 * end) for end in (band, band + 1))
            weight = mu * 0.6 ** abs(band - 3 - np.log10(v))
            open_share = (0.8 - 0.05 * np.log10(v) * share) ** band
            parts.append((v, p * (1 + 1e-15 * band), t, band, long, short, weight, open_share, (3.0 + band) * v**0.2))
    _save(directory / "steady.csv", head, rows)
    _save(directory / "steady_theory.csv", head, [(*row[:2], 0.7 * row[2], *row[3:]) for row in rows])
    if bands:
        names = ("velocity", "pressure", "temperature", "band", "long_wavelength", "short_wavelength", "friction")
        for name in ("bands.csv", "bands_theory.csv"):
            _save(directory / name, (*names, "contact_area", "flash_temperature"), parts)
    _save_job(directory, WAVE + MATERIAL + STEADY)
    return directory


def draw_curve(path: Path) -> None:
    plots.draw_steady(write_curve(path / "curve") / "steady.csv")


def draw_curve_of_pressures(path: Path) -> None:
    """Draw three temperatures at two pressures."""
    plots.plot([write_curve(path / "curve", PRESSURES)])


def draw_bands(path: Path) -> None:
    plots.draw_steady(write_curve(path / "one", bands=BANDS, temperatures=(20.0,)) / "steady.csv")


def draw_bands_of_temperatures(path: Path) -> None:
    plots.plot([write_curve(path / "several", PRESSURES, BANDS)])


def _name(number: int) -> str:
    return f"{TITLE} {number}".replace(" ", "_")


def write_curves(path: Path) -> list[Path]:
    return [write_curve(path / _name(k), bands=BANDS - k, share=1.0 - 0.2 * k) for k in range(RUNS)]


def compare_bands(path: Path) -> None:
    assert asked(*write_curves(path), "--compare", "--out", path / "bands.png") == 0


def compare_two_bands(path: Path) -> None:
    """Compare two compounds at one temperature."""
    found = [
        write_curve(path / name, bands=6, share=share, temperatures=(20.0,))
        for name, share in (("soft", 1.0), ("hard", 0.7))
    ]
    assert asked(*found, "--compare", "--out", path / "two.png") == 0


def compare_cases(path: Path) -> None:
    """Compare all cases of a sweep."""
    rows = [(k, 0.1 * (k + 1), "done") for k in range(CASES)]
    _save(path / "sweep.csv", ("case", "material.modulus_inf", "state"), rows)
    found = [write_curve(path / "cases" / f"{k:03d}", temperatures=(20.0,), share=1.0 - 0.03 * k) for k in range(CASES)]
    assert asked(*found, "--compare", "--out", path / "cases.png") == 0


def write_run(path: Path) -> Path:
    """Run nine stages with energies, leakage and heat, with numbers of a longer run."""
    stages = ", ".join(
        f"{{name: {'a stage with a long name ' * (k % 2)}no. {k}, pressure: {k + 1}.0e3, velocity: {0.1 * (k + 1):g}, "
        "distance: 1.0e-4, cells_per_step: 1}"
        for k in range(9)
    )
    saved = "leakage: {}\noutput: {fields: [pressure, gap, height], energy: true}\n"
    out = ran(path, f"title: {TITLE}\n{WAVE}{ZENER}history: [{stages}]\n{saved}")
    head, *rows = _read(out / "measures.csv")
    more = ("flash_temperature", "max_temperature", "surface_energy", "snap_loss", "slip_loss")
    for k, row in enumerate(rows):
        row += [str(value) for value in (2.0 * k, 5.0 * k, 1e-9 * k, 2e-9 * k, 3e-9 * k)]
    _save(out / "measures.csv", (*head, *more), rows)
    theory = [(1e-4 * k, 1e-4 * k, 1e3, 0.01, 0.5) for k in range(10)]
    _save(out / "theory.csv", ("time", "distance", "pressure", "friction", "contact_area"), theory)
    return out


def _copy_run(run: Path, path: Path, share: float) -> Path:
    """Copy a run with its friction multiplied by `share`."""
    shutil.copytree(run, path)
    head, *rows = _read(path / "measures.csv")
    at = head.index("friction")
    _save(path / "measures.csv", head, [[*row[:at], str(share * float(row[at])), *row[at + 1 :]] for row in rows])
    return path


def draw_run(path: Path) -> None:
    plots.plot([path / "run"])


def draw_run_over_velocity(path: Path) -> None:
    assert asked(path / "run", "--over", "velocity", "--log", "x,y") == 0


def compare_runs(path: Path) -> None:
    found = [_copy_run(path / "run", path / _name(k), 1.0 - 0.2 * k) for k in range(RUNS)]
    assert asked(*found, "--compare", "--out", path / "runs.png") == 0


def draw_sphere(path: Path) -> None:
    """Draw the pressures and maps of a sphere pressed and lifted in five stages."""
    stages = ", ".join(
        f"{{name: stage number {k} of a test, force: {0.1 * k + 0.1:g}, duration: 1.0e-2, time_step: 5.0e-3}}"
        for k in range(5)
    )
    saved = "output: {fields: [pressure, displacement], energy: true}\n"
    plots.plot([ran(path, f"title: {TITLE}\n{SPHERE}{ZENER}history: [{stages}]\n{saved}")])


def draw_stick(path: Path) -> None:
    """Draw maps of traction and slip."""
    shear = "history: [{force: 1.0e-3}, {force: 1.0e-3, velocity: 1.0e-7, duration: 2, time_step: 0.25}]\n"
    plots.plot([ran(path, f"title: {TITLE}\n{SPHERE}{ZENER}{shear}{STICK}")])


def draw_strip(path: Path) -> None:
    """Draw pressures and tractions of a narrow map as lines."""
    slide = "{name: a slow slide, pressure: 1.0e3, velocity: 0.1, distance: 1.2e-7, cells_per_step: 0.001}"
    plots.plot([ran(path, f"title: {TITLE}\n{STRIP}{ZENER}history: [{{pressure: 1.0e3}}, {slide}]\n{STICK}")])


def draw_long_map(path: Path) -> None:
    """Draw maps of a box that is sixteen times as long as wide."""
    scene = WAVE.replace("points: 32, size: 2.0e-3", "points: [256, 16], size: [3.2e-2, 2.0e-3]")
    history = "history: [{pressure: 1.0e3, duration: 1.0e-2, time_step: 5.0e-3}]\n"
    plots.plot([ran(path, f"title: {TITLE}\n{scene}{ZENER}{history}output: {{fields: [pressure, gap, height]}}\n")])


def draw_movie(path: Path) -> None:
    assert asked(path / "run", "--movie", "pressure", "--out", path / "run.gif") == 0


def draw_leakage(path: Path) -> None:
    """Draw the flow at all instants of a rough seal."""
    rough = ROUGH.format(slope=0.1, short="2.5e-4")
    loads = ", ".join(f"{{pressure: {10.0 * 1.25**k:.4g}}}" for k in range(INSTANTS))
    scene = f"title: {TITLE}\ngrid: {{points: 32, size: 2.0e-3}}\n{rough}"
    material = "material: {model: elastic, shear_modulus: 1.0e6}\noutput: {fields: [pressure, gap]}\n"
    assert main(["leak", str(ran(path, f"{scene}{material}history: [{loads}]\n"))]) == 0


def draw_surface(path: Path) -> None:
    rough = ROUGH.format(slope=0.5, short="1.0e-4")
    text = f"title: {TITLE}\ngrid: {{points: [192, 64], size: [3.0e-3, 1.0e-3]}}\n{rough}{MATERIAL}{STEADY}"
    (path / "job.yaml").write_text(text)
    assert main(["surface", str(path / "job.yaml"), "--out", str(path / "surface.png")]) == 0


def write_sweep(directory: Path) -> Path:
    """Write a sweep of 24 cases: compounds and sizes at three velocities, two seeds each, with theory."""
    head = ("case", "history.0.velocity", "material.include", "grid.size", "surface.0.seed", "state")
    results = ("mu_max", "mu_dyn", "contact_area_corrected", "mu_max_error", "mu_dyn_error")
    theory = ("theory_mu_max", "theory_mu_dyn", "theory_contact_area")
    compounds = [f"a_compound_with_a_long_name_{number}" for number in range(4)]
    rows = [
        (k, v, name, size, seed, "done", mu, 0.8 * mu, 0.1 / mu, 0.02, 0.02, 0.7 * mu, 0.5 * mu, 0.05 / mu)
        for k, (v, name, size, seed) in enumerate(product((0.1, 1.0, 10.0), compounds, (1e-3, 2e-3), (1, 2)))
        for mu in [0.3 + 0.1 * v**0.2 * (1 + compounds.index(name)) + 0.02 * seed + 50 * size]
    ]
    _save(directory / "sweep.csv", (*head, *results, *theory), rows)
    return directory


def draw_sweep(path: Path) -> None:
    plots.plot([write_sweep(path / "sweep")])


def draw_sweep_of_numbers(path: Path) -> None:
    """Draw 24 lines, one for each value of a second key."""
    head = ("case", "history.0.velocity", "history.0.pressure", "state", "mu_max", "contact_area_corrected")
    rows = [
        (k, v, p, "done", 0.5 * v**0.1 / (1 + 1e-6 * p), 1e-7 * p / v**0.1)
        for k, (p, v) in enumerate(product(np.linspace(1e5, 2.4e6, CASES).tolist(), (0.1, 1.0, 10.0)))
    ]
    _save(path / "sweep.csv", head, rows)
    plots.plot([path])


def draw_study(path: Path) -> None:
    """Draw the errors of all integrators along all ladders."""
    curves = [
        study.StudyCurve(
            *(name, integrator, ladder, [1.0, 0.5, 0.25, 0.125]),
            *(np.geomspace(0.1, 1e-4 * (k + 1), 4).tolist(), [0.3 * 8**n for n in range(4)]),
        )
        for name in study.NAMES
        for k, (integrator, ladder) in enumerate(product(study.COLORS, study.MARKS))
    ]
    study.plot_study(path, curves, dict.fromkeys(study.NAMES, 1e-4))


def draw_compound(path: Path) -> None:
    """Draw a fit of sweeps at 30 temperatures."""
    frequency, lines = np.geomspace(0.1, 100.0, 25), ["f_set,E_stor,E_loss,T", "Hz,MPa,MPa,°C"]
    times, moduli = np.geomspace(1e-9, 1e2, BRANCHES), 30.0 * np.geomspace(1.0, 0.05, BRANCHES)
    for t in np.linspace(-30.0, 70.0, 30):
        iwt = 2j * np.pi * frequency[:, None] * times * 10.0 ** (-8.86 * (t - 20.0) / (101.6 + t - 20.0))
        for f, g in zip(frequency, 1.0 + (moduli * iwt / (1.0 + iwt)).sum(axis=1), strict=True):
            lines.append(f"{f:.8g},{3 * g.real:.8g},{3 * g.imag:.8g},{t:.4g}")
    (path / "rubber.csv").write_text("\n".join(lines) + "\n")
    found = compound.fitted(path / "rubber.csv", 0.5, 20.0, "wlf", 0.01)
    from parcontact.results import inputs

    inputs.draw_compound(found, path / "compound.png", (1.0, 1e6))


def report_curves(path: Path) -> None:
    """Draw the pictures of a report that compares three curves in bands."""
    assert list(page.compare_directories(write_curves(path)))


def report_run(path: Path) -> None:
    """Draw the pictures of the results of a run."""
    report_sections.describe_run(path / "run")


def report_sweep(path: Path) -> None:
    assert main(["report", str(write_sweep(path / "sweep")), "--out", str(path / "sweep.html")]) == 0


KINDS: tuple[Callable[[Path], None], ...] = (
    *(draw_curve, draw_curve_of_pressures, draw_bands, draw_bands_of_temperatures, compare_bands, compare_two_bands),
    *(compare_cases, draw_run, draw_run_over_velocity, compare_runs, draw_sphere, draw_stick, draw_strip),
    *(draw_long_map, draw_movie, draw_leakage, draw_surface, draw_sweep, draw_sweep_of_numbers, draw_study),
    *(draw_compound, report_curves, report_run, report_sweep),
)

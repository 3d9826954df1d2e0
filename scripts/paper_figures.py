#!/usr/bin/env python3
"""Draw the paper's figures, 8 cm wide, from the results of its jobs.

    scripts/paper_figures.py                   all figures whose jobs have run (out/<job>), into jobs/paper/pictures
    scripts/paper_figures.py 8 9 --from out --to pictures

Run it with the Python of .venv. Figures without results are left out, with a message.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from parcontact.effects.branches import relaxation_of
from parcontact.files import tables
from parcontact.job import Job, load, load_cases
from parcontact.physics.prony import complex_modulus
from parcontact.results import info, results, slide, style
from parcontact.theory import hertz

JOBS = Path(__file__).resolve().parents[1] / "jobs" / "paper"
DPI = 300
RC = {**style.RC, "font.size": 7, "axes.titlesize": 7, "legend.fontsize": 6.5, "lines.linewidth": 1.1}
RC |= {"lines.markersize": 3, "axes.linewidth": 0.6, "xtick.major.width": 0.6, "ytick.major.width": 0.6}
CREEP_TIME, RADIUS = 1e-2, 1e-2  # creep time of the sphere's rubber [s], radius of the sphere [m]
INSTANTS = (0.2, 0.4, 1.0, 2.0, 4.0)  # instants of fig03 [creep times]
QUANTITIES = (("mu_max", "$\\mu_{max}$"), ("mu_dyn", "$\\mu_{dyn}$"), ("contact_area", "area"))  # columns, names
WIDTH, HEIGHT = 3.15, 2.1  # width of a picture (8 cm), height of a panel [inch]
TITLE = 5.2  # size of the title of a legend [points]
LOOKS: tuple[tuple[dict[str, Any], str, str, bool], ...] = (  # of sweeps: points, theory, its error; with names
    ({"fmt": "o-"}, "--", "-", True),
    ({"fmt": "D", "mfc": "none"}, ":", ":", False),  # on a finer grid
)


class MissingError(Exception):
    """The results for a figure are missing."""


def require_file(path: Path) -> Path:
    if not path.is_file():
        raise MissingError(f"{path} is missing")
    return path


def columns(directory: Path, name: str = "measures.csv") -> dict[str, np.ndarray]:
    return {key: np.array(values) for key, values in tables.read_columns(require_file(directory / name)).items()}


def panels(count: int, height: float = HEIGHT) -> tuple[Figure, Sequence[Axes]]:
    figure = Figure(figsize=(WIDTH, 0.15 + height * count), layout="constrained")
    return figure, figure.subplots(count, 1, squeeze=False)[:, 0]


def explain(axes: Axes, directory: Path, **look: Any) -> None:
    """Draw the legend of a panel, with the settings of the theory if they are known and the same for all cases of a
    sweep."""
    axes.legend(**look, title=info.describe_settings(directory) or None, title_fontsize=TITLE)


def moduli(job: Job) -> tuple[float, float]:
    """Return the moduli of the first instant and in the end [Pa]."""
    series = relaxation_of(job.material)
    return series.modulus_inf + float(series.moduli.sum()), series.modulus_inf


def over_distance(axes: Axes, directory: Path, name: str, label: str, number: int = 0, start: float = 0.0) -> None:
    """Draw simulation and theory of one case over the distance slid since an instant [s], on a logarithmic axis in
    um."""
    for table, dashes, of in (("measures.csv", "-", "simulation"), ("theory.csv", "--", "theory")):
        found = columns(directory, table)
        distance = found["distance"] - found["distance"][found["time"] <= start * (1 + 1e-9)][-1]
        slid = distance > 0
        axes.semilogx(1e6 * distance[slid], found[name][slid], dashes, color=style.COLORS[number], label=f"{of}{label}")


def means(rows: Sequence[dict[str, Any]], key: str, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the values of a key, with means and standard deviations over the finished cases of each."""
    at = sorted({row[key] for row in rows})
    groups = [np.array([row[name] for row in rows if row[key] == value and row[name] == row[name]]) for value in at]
    there = [k for k, group in enumerate(groups) if group.size]
    spread = [groups[k].std(ddof=1) if groups[k].size > 1 else 0.0 for k in there]
    return np.array(at)[there], np.array([groups[k].mean() for k in there]), np.array(spread)


def rows_of(directory: Path) -> list[dict[str, Any]]:
    """Return the rows of the table of a sweep; contact areas of simulations are corrected at edges."""
    rows = results.read_cases(require_file(directory / "sweep.csv"))
    for row in rows:
        case = directory / "cases" / f"{int(row['case']):03d}"
        if row["state"] == "done":
            found = tables.read_columns(case / "measures.csv")
            found["contact_area"] = found[slide.CORRECTED]
            measured = slide.measure_slide(load(case / "job.resolved.yaml").history, found)
            row["contact_area"] = measured.contact_area if measured else np.nan
    return rows


def over_key(out: Path, name: str, key: str, label: str, scale: float = 1.0) -> Figure:
    """Draw friction, area and the error of the theory over the key of a sweep; bars are standard deviations over seeds.
    Results with shorter waves, in the directory NAME_finer, have open markers and dotted theory."""
    found = [rows_of(out / name)]
    if (out / f"{name}_finer" / "sweep.csv").is_file():
        found.append(rows_of(out / f"{name}_finer"))
    figure, (top, middle, bottom) = panels(3, 1.75)
    for rows, (marks, dashes, line, stated) in zip(found, LOOKS, strict=False):
        for number, (axes, (column, short)) in enumerate(zip((top, top, middle), QUANTITIES, strict=True)):
            look = {"color": style.COLORS[number]}
            (x, y, spread), (tx, theory, _) = (means(rows, key, each) for each in (column, f"theory_{column}"))
            names = [f"{short}, simulation", f"{short}, theory", short] if stated else [None] * 3
            axes.errorbar(scale * x, y, spread if stated else None, label=names[0], capsize=2, **marks, **look)
            axes.plot(scale * tx, theory, dashes, label=names[1], **look)
            if x.size == tx.size:
                kind = {"mfc": marks.get("mfc"), "label": names[2]}
                bottom.plot(scale * x, 100 * (theory - y) / y, "os^"[number] + line, **look, **kind)
    top.set(ylabel="friction coefficient", ylim=(0, 1.7 * top.get_ylim()[1]))
    middle.set(ylabel="contact area ratio", yscale="log")
    bottom.axhline(0, color=style.GREY, lw=0.6)
    bottom.set(ylabel="theory − simulation [%]", xlabel=label)
    bottom.set_ylim(top=0.4 * abs(bottom.get_ylim()[0]))
    if len(found) > 1:
        bottom.plot([], [], "D:", color=style.GREY, mfc="none", label="waves of the paper")
    for axes in (top, middle, bottom):
        axes.set_xscale("log")
    explain(top, out / name, loc="upper center", ncols=2)
    middle.legend()
    bottom.legend(loc="upper right", ncols=2)
    return figure


def fig02(out: Path) -> Figure:
    figure, (axes,) = panels(1)
    for number, case in enumerate(load_cases(JOBS / "fig02_sphere_friction.yaml")):
        found = columns(out / "fig02_sphere_friction" / "cases" / f"{case.number:03d}")
        a = float(hertz.contact_radius(case.job.history[0].load.end, RADIUS, moduli(case.job)[0]))
        speed = case.job.history[0].speed
        look = style.line(number)
        x, y = found["time"] / CREEP_TIME, found["friction"] * RADIUS / a
        axes.plot(x, y, **look, label=f"V* = {speed * CREEP_TIME / a:.3g}")
        if (steady := out / "fig04_friction_velocity" / "steady.csv").is_file():
            curve = columns(steady.parent, steady.name)
            level = np.interp(np.log(speed), np.log(curve["velocity"]), curve["friction"]) * RADIUS / a
            axes.plot(x[-1] * 1.02, level, ">", color=look["color"], clip_on=False)
    axes.set(xlabel="time $t/\\tau_0$", ylabel="friction $\\mu R/a^*$", ylim=(0, None), xlim=(0, 4))
    axes.legend()
    return figure


def fig03(out: Path) -> Figure:
    directory = require_file(out / "fig03_sphere_pressure" / "fields.h5").parent
    job = load(JOBS / "fig03_sphere_pressure.yaml")
    glassy, rubbery = moduli(job)
    force = job.history[0].load.end
    a, a_end = (float(hertz.contact_radius(force, RADIUS, modulus)) for modulus in (glassy, rubbery))
    mean = force / (np.pi * a**2)
    figure, (axes,) = panels(1, 2.4)
    r = np.linspace(-1.05 * a_end, 1.05 * a_end, 801)
    for modulus, label in ((glassy, "Hertz, $G_0$ and $G_\\infty$"), (rubbery, "")):
        p = hertz.pressure(np.abs(r), force, RADIUS, modulus)
        axes.plot(r / a, p / mean, ":", color=style.GREY, lw=0.9, label=label or None)
    centre, speed = job.surface[0].center[0], job.history[0].speed
    with h5py.File(directory / "fields.h5") as fields:
        times, x, pressure = fields["t"][:], fields["x"][:], fields["pressure"]
        middle = pressure.shape[1] // 2
        for number, instant in enumerate(INSTANTS):
            at = int(np.nanargmin(np.abs(times / CREEP_TIME - instant) - 1e-9 * np.arange(times.size)))
            where = (x - centre - speed * times[at]) / a
            label = f"t = {times[at] / CREEP_TIME:.2g} τ₀"
            axes.plot(where, pressure[at, middle] / mean, **style.line(number), label=label)
    axes.set(xlabel="position $(x - Vt)/a^*$", ylabel="pressure $p/p_0$", xlim=(-2.6, 2.6), ylim=(0, 2.2))
    axes.legend(loc="upper center", ncols=2)
    return figure


def ring_means(heights: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Return Phi of Eq. 12 [m^4] and wave numbers [rad/m], averaged over rings of the width of one wave number of the
    box."""
    n = heights.shape[0]
    power = size**2 * np.abs(np.fft.fft2(heights) / n**2) ** 2
    number = np.fft.fftfreq(n, 1 / n)
    present = power.ravel() > 1e-12 * power.max()
    ring = np.rint(np.hypot(number[:, None], number)).astype(int).ravel()[present]
    mean = np.bincount(ring, power.ravel()[present]) / np.maximum(np.bincount(ring), 1)
    return 2 * np.pi / size * np.arange(mean.size), mean


def fig05(out: Path) -> Figure:
    directory = require_file(out / "fig05_surface" / "fields.h5").parent
    job = load(directory / "job.resolved.yaml")
    part, size = job.surface[0], job.grid.lx
    with h5py.File(directory / "fields.h5") as fields:
        heights = fields["height"][-1]
    figure = Figure(figsize=(WIDTH, 4.6), layout="constrained")
    top, bottom = figure.subplots(2, 1, height_ratios=(1.25, 1))
    shown = top.imshow(1e6 * heights, extent=(0, 1e3 * size, 0, 1e3 * size), origin="lower", cmap=style.SEQUENCE)
    top.set(xlabel="x [mm]", ylabel="y [mm]")
    top.grid(visible=False)
    figure.colorbar(shown, ax=top, label="height [µm]", shrink=0.9)
    k, found = ring_means(heights, size)
    k_long, k_short = 2 * np.pi / part.long_wavelength, 2 * np.pi / part.short_wavelength
    exponent = 2 - 2 * part.hurst
    constant = part.rms_slope**2 * 2 * np.pi * exponent / (k_long**4 * ((k_short / k_long) ** exponent - 1))
    inside = (k >= 0.999 * k_long) & (k < 1.001 * k_short)
    bottom.loglog(k[inside], found[inside], ".", color=style.BLUE, label="simulated, means over rings")
    asked = constant * (k[inside] / k_long) ** (-2 * (1 + part.hurst))
    bottom.loglog(k[inside], asked, "--", color=style.RED, label=f"asked, C = {constant:.3g} m⁴")
    bottom.set(xlabel="wave number k [rad/m]", ylabel="Φ [m⁴]")
    bottom.xaxis.set_minor_formatter(NullFormatter())
    bottom.legend(loc="lower left")
    return figure


def fig07(out: Path) -> Figure:
    job = load(JOBS / "fig08_velocity_step.yaml")
    part = job.surface[0]
    omega = np.logspace(-3, 9, 400)
    modulus = complex_modulus(omega, *relaxation_of(job.material))
    figure, (top, bottom) = panels(2, 1.7)
    lines = (("G′", modulus.real), ("G″", modulus.imag), ("|G*|", np.abs(modulus)))
    for number, (label, values) in enumerate(lines):
        top.loglog(omega, 1e-6 * values, **style.line(number), label=label)
    bottom.semilogx(omega, modulus.imag / modulus.real, color=style.COLORS[3])
    speeds = (job.initial.velocity[0], job.history[-1].speed)
    low = 2 * np.pi / part.long_wavelength * speeds[0]
    high = 2 * np.pi / part.short_wavelength * speeds[1]
    for axes in (top, bottom):
        axes.axvspan(low, high, color="0.9", zorder=0)
        axes.set(xlim=(omega[0], omega[-1]))
    bottom.text(np.sqrt(low * high), 0.05, "waves of fig. 8 at V₀ and V₁", ha="center", fontsize=6.5)
    top.set(ylabel="shear modulus [MPa]")
    bottom.set(xlabel="frequency ω [rad/s]", ylabel="tan δ", ylim=(0, None))
    top.legend(loc="upper left")
    return figure


def fig08(out: Path) -> Figure:
    directory = out / "fig08_velocity_step"
    figure, (top, bottom) = panels(2)
    for axes, name, label in (
        (top, "friction", "friction coefficient"),
        (bottom, "contact_area", "contact area ratio"),
    ):
        over_distance(axes, directory, name, "")
        axes.axvline(500, color=style.GREY, lw=0.7, ls=":")
        axes.set(ylabel=label, ylim=(0, None), xlim=(1e-2, 1e3))
    bottom.set(xlabel="distance slid [µm]")
    explain(top, directory)
    return figure


def fig09(out: Path) -> Figure:
    """Draw friction; add the steady states of the periodic box for one surface, if they exist."""
    figure = over_key(out, "fig09_velocities", "history.1.velocity", "velocity $V_1$ [m/s]")
    if (table := out / "fig09_steady" / "cases" / "000" / "steady.csv").is_file():
        found = columns(table.parent, table.name)
        for axes, name in zip(figure.axes, ("friction", "contact_area"), strict=False):
            axes.plot(found["velocity"], found[name], "kx", label="steady in the box")
        explain(figure.axes[0], out / "fig09_velocities", loc="upper center", ncols=2)
        figure.axes[1].legend(loc="upper right")
    return figure


def fig10(out: Path) -> Figure:
    return over_key(out, "fig10_pressures", "history.1.pressure", "nominal pressure [MPa]", 1e-6)


def fig11(out: Path) -> Figure:
    cases = load_cases(JOBS / "fig11_tyre.yaml")
    figure, (rest, friction, area) = panels(3, 1.75)
    for number, case in enumerate(cases):
        directory = out / "fig11_tyre" / "cases" / f"{case.number:03d}"
        start, speed = case.job.history[0].seconds, case.job.history[-1].speed
        for table, dashes, of in (("measures.csv", "-", "simulation"), ("theory.csv", "--", "theory")):
            found = columns(directory, table)
            resting = (found["time"] <= start) & (found["time"] > 0)
            if number == 0:
                rest.semilogx(1e3 * found["time"][resting], found["contact_area"][resting], dashes, color="k", label=of)
        over_distance(friction, directory, "friction", f", {speed:g} m/s", number, start)
        over_distance(area, directory, "contact_area", f", {speed:g} m/s", number, start)
    rest.set(xlabel="time at rest [ms]", ylabel="contact area ratio", ylim=(0, None))
    friction.set(ylabel="friction coefficient", ylim=(0, 1.8 * friction.get_ylim()[1]), xlim=(0.1, 500))
    area.set(ylabel="contact area ratio", xlabel="distance slid [µm]", ylim=(0, None), xlim=(0.1, 500))
    rest.legend()
    explain(friction, out / "fig11_tyre", loc="upper center", ncols=2)
    return figure


def box(out: Path) -> Figure:
    figure = over_key(out, "box_size", "grid.size", "longest waves per side of the box", 1 / 2.5e-4)
    for axes in figure.axes:
        axes.set_xticks([2, 4, 8], ["2", "4", "8"])
        axes.minorticks_off()
    figure.axes[1].set(yscale="linear", ylim=(0, None))
    return figure


FIGURES = {"2": fig02, "3": fig03, "5": fig05, "7": fig07, "8": fig08, "9": fig09, "10": fig10, "11": fig11, "box": box}


def draw(name: str, out: Path, to: Path) -> Path:
    with rc_context(RC):
        figure = FIGURES[name](out)
        to.mkdir(parents=True, exist_ok=True)
        path = to / (f"fig{int(name):02d}.png" if name.isdecimal() else f"{name}.png")
        figure.savefig(path, dpi=DPI)
    return path


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("figures", nargs="*", metavar="FIGURE", help=", ".join(FIGURES))
    parser.add_argument("--from", dest="out", type=Path, default=Path("out"), metavar="DIR")
    parser.add_argument("--to", type=Path, default=JOBS / "pictures", metavar="DIR")
    options = parser.parse_args(argv)
    left = 0
    if unknown := [name for name in options.figures if name not in FIGURES]:
        parser.error(f"there is no figure {unknown[0]}; choose from {', '.join(FIGURES)}")
    for name in options.figures or FIGURES:
        try:
            print(f"picture: {draw(name, options.out, options.to)}")
        except MissingError as missing:
            left += 1
            print(f"figure {name}: {missing}; run its job first", file=sys.stderr)
    return 1 if left else 0


if __name__ == "__main__":
    sys.exit(main())

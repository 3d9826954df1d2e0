"""Files of fitted materials, and pictures of studies.

Files of a fitted material: a material file that jobs include, and a picture.

The picture shows moduli at the reference temperature with the fit, residuals, branches and shift factors.

Picture of a study: errors over the refinement of mesh and time step (as Fig. 6 of the paper), and over time.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter, NullLocator, ScalarFormatter

from ..errors import InputError
from ..files import files, hdf5
from ..parallel.slab import Array
from ..rubber.compound import TITLE, Compound
from ..rubber.series import log_factors, reduce_sets
from . import style

COLORS = (style.BLUE, style.RED)  # colours of storage and loss moduli
POINTS = 400  # number of points of a line


def refuse_foreign(target: Path) -> None:
    """Raise InputError for an existing file that was not written by a fit."""
    if target.suffix not in (".yaml", ".yml"):
        raise InputError(f"--out must end in .yaml, got {str(target)!r}")
    try:
        if target.exists() and not target.read_text(errors="replace").startswith(TITLE):
            raise InputError(f"{target} exists and was not written by parcontact fit; choose another --out")
    except OSError as error:
        raise InputError(f"{target} cannot be read: {error}") from error


def write_compound(compound: Compound, target: Path, job_band: tuple[float, float] | None) -> Iterator[str]:
    """Write both files, and yield messages; `job_band` [Hz] are the frequencies of a job. Raises InputError."""
    text, picture = compound.text(), target.with_suffix(".png")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        files.replace_file(target, text)
        draw_compound(compound, picture, job_band)
    except OSError as error:
        wrong = files.without_mark(Path(error.filename or target))
        raise InputError(f"{wrong} cannot be written: {hdf5.reason(error)}") from error
    yield from (line.removeprefix("# ") for line in text.splitlines() if line.startswith("#"))
    yield f"material file: {target}, picture: {picture}"
    yield from (f"warning: {text}" for text in compound.doubts())
    if job_band:
        low, high = compound.material()["band"]
        for ratio, side in ((low / job_band[0], "below"), (job_band[1] / high, "above")):
            if ratio > 1.0:
                beyond = f"{math.log10(ratio):.1f} decades {side} the measured band"
                yield f"warning: the job's frequencies reach {beyond}"


def draw_compound(compound: Compound, path: Path, job_band: tuple[float, float] | None = None) -> None:
    """Write the picture, a png, with the frequencies of a job shaded; raises OSError."""
    with style.drawing({"axes.grid": True, "grid.alpha": 0.3, "lines.markersize": 4, "legend.frameon": False}):
        figure = Figure(figsize=(8, 6), layout="constrained")
        panels = figure.subplot_mosaic([["moduli", "spectrum"], ["misfit", "shift"]], width_ratios=(2, 1))
        _draw_moduli(panels["moduli"], panels["misfit"], compound)
        if job_band:
            for name in ("moduli", "misfit"):
                panels[name].axvspan(*job_band, color="#999999", alpha=0.25, lw=0, label="frequencies of the job")
        panels["moduli"].legend(fontsize="small")
        panels["spectrum"].loglog(compound.series.times, compound.series.moduli, "o", color="black")
        panels["spectrum"].set(xlabel="relaxation time [s]", ylabel="shear modulus of the branch [Pa]")
        _draw_shift(panels["shift"], compound)
        style.save_figure(figure, path, dpi=150)


def _reduced(compound: Compound) -> Iterator[tuple[Array, list[Array]]]:
    """Yield for each set the frequencies [rad/s] or times [s], and the moduli [Pa], at the reference temperature."""
    kind = compound.measured.kind
    for each in compound.measured.sets:
        shift, temperature = compound.shift, each.temperature
        logs = None if shift is None or temperature is None else log_factors(shift, [temperature])
        data = reduce_sets([each], kind, logs)
        yield data.at, np.split(data.moduli, 2) if kind == "frequency" else [data.moduli]


def _draw_moduli(top: Axes, bottom: Axes, compound: Compound) -> None:
    """Draw the measured moduli (Young's or shear), the fit, and their relative difference."""
    measured, sets = compound.measured, list(_reduced(compound))
    letter, kind, size = ("E", "Young's", 2.0 * (1.0 + compound.poisson)) if measured.tension else ("G", "shear", 1.0)
    frequency = measured.kind == "frequency"
    names = (f"{letter}'", f"{letter}''") if frequency else (f"{letter}(t)",)
    if measured.kind == "creep":
        names = ("1/D(t)" if measured.tension else "1/J(t)",)
    from_tangent = {"stor": (f" = {names[-1]} / tan δ", ""), "loss": ("", f" = {names[0]} tan δ")}
    notes = from_tangent.get(measured.derived, ("", ""))
    every = np.concatenate([at for at, _ in sets])
    line, unit = np.geomspace(every.min(), every.max(), POINTS), 2 * np.pi if frequency else 1.0

    def fitted(at: Array, k: int) -> Array:
        return np.asarray(compound.series.response(measured.kind, at)).reshape(len(names), -1)[k]

    for k, name in enumerate(names):
        for number, (at, moduli) in enumerate(sets):
            look = {"ms": 3, "mfc": "none", "color": COLORS[k]}
            label = None if number else f"{name}{notes[k]} measured"
            top.loglog(at / unit, size * moduli[k], "os"[k], label=label, **look)
            bottom.semilogx(at / unit, 100 * (fitted(at, k) / moduli[k] - 1.0), "os"[k], **look)
        top.plot(line / unit, size * fitted(line, k), color=COLORS[k], label=f"{name} fitted")
    top.set_ylabel(f"{kind} modulus [Pa]")
    bottom.sharex(top)
    bottom.axhline(0.0, color="black", lw=0.8)
    reference = f" at {compound.shift.reference:g} °C" if compound.shift is not None else ""
    along = f"frequency{reference} [Hz]" if frequency else f"time{reference} [s]"
    bottom.set(xlabel=along, ylabel="fitted over measured - 1 [%]")


def _draw_shift(axes: Axes, compound: Compound) -> None:
    temperatures = compound.measured.temperatures
    if compound.shift is None or not temperatures:
        axes.set_axis_off()
        return
    for at, look in ((np.linspace(min(temperatures), max(temperatures), POINTS), "-"), (temperatures, "o")):
        axes.plot(at, [compound.shift.log_factor(float(t)) for t in at], look, color="black")
    axes.set(xlabel="temperature [°C]", ylabel="log10 of the shift factor")


NAMES = {"mu_max": "largest friction", "mu_dyn": "dynamic friction", "contact_area_corrected": "contact area"}
MARKS = {"mesh and time together": "o-", "mesh with auto steps": "D-", "mesh alone": "s--", "time alone": "^:"}
INTEGRATORS = {"exponential": style.BLUE, "exponential-linear": style.GREEN, "backward-euler": style.RED}
WIDE = 100.0  # ratio of the longest to the shortest time above which only powers of ten are labelled
BAND = 5.0  # ratio of the edges of the grey band
LEAST = 1e-7  # smallest error on the axis; smaller ones are drawn there


@dataclass(frozen=True)
class StudyCurve:
    """Errors of one quantity along one ladder of sizes (over the size of the box), and times of all steps [s]."""

    quantity: str
    integrator: str
    ladder: str
    sizes: Sequence[float]
    errors: Sequence[float]
    seconds: Sequence[float]

    def draw(self, axes: Axes, x: Sequence[float]) -> None:
        label, color = f"{self.ladder}, {self.integrator}", INTEGRATORS[self.integrator]
        axes.plot(x, _per_cent(self.errors), MARKS[self.ladder], color=color, label=label)


def plot_study(directory: Path, curves: Sequence[StudyCurve], doubts: Mapping[str, float]) -> Path | None:
    """Draw `convergence.png` and return its path; None if nothing is refined.

    `doubts` are the relative uncertainties of the references; errors below them are in grey bands.
    """
    drawn = [curve for curve in curves if any(0.0 < error < math.inf for error in curve.errors)]
    if not drawn:
        return None
    with style.drawing():
        return style.save_figure(_convergence(drawn, doubts), directory / "convergence.png")


def _convergence(curves: Sequence[StudyCurve], doubts: Mapping[str, float]) -> Figure:
    own: dict[str, list[StudyCurve]] = {}
    for curve in curves:
        own.setdefault(curve.quantity, []).append(curve)
    panels = [
        partial(draw, name=name, curves=found, doubt=doubts[name])
        for name, found in own.items()
        for draw in (_draw_ladders, _draw_times)
    ]
    return style.figure_of("", [panels])


def _draw_ladders(axes: Axes, name: str, curves: Sequence[StudyCurve], doubt: float) -> None:
    """Draw errors of a quantity over the refinement of mesh or step with respect to the coarsest."""
    for curve in curves:
        curve.draw(axes, [max(curve.sizes) / size for size in curve.sizes])
    axes.set(xscale="log", xlabel="refinement, coarsest = 1", ylabel=f"{NAMES[name]}:\nerror [%]")
    _scale_errors(axes, curves, doubt)
    low, high = axes.get_xlim()
    axes.xaxis.set_major_locator(FixedLocator([2.0**k for k in range(-1, 12) if low <= 2.0**k <= high]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(ScalarFormatter())


def _draw_times(axes: Axes, name: str, curves: Sequence[StudyCurve], doubt: float) -> None:
    """Draw errors of a quantity over the time of all steps, on an axis of at least a decade."""
    for curve in curves:
        curve.draw(axes, curve.seconds)
    axes.set(xscale="log", xlabel="time of all steps [s]", ylabel=f"{NAMES[name]}:\nerror [%]")
    _scale_errors(axes, curves, doubt)
    low, high = axes.get_xlim()
    middle, half = math.sqrt(low * high), max(math.sqrt(high / low), math.sqrt(10.0))
    axes.set_xlim(middle / half, middle * half)  # a decade at least: there are ticks in it
    few = half**2 < WIDE
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,), numticks=5))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


def _scale_errors(axes: Axes, curves: Sequence[StudyCurve], doubt: float) -> None:
    """Set a logarithmic axis of errors [%], of at least a decade, with few ticks; grey up to the uncertainty `doubt` of
    the reference."""
    errors = [error for curve in curves for error in curve.errors if math.isfinite(error)]
    low, high = _per_cent(errors).min(), _per_cent(errors).max()
    middle, half = math.sqrt(low * high), max((high / low) ** 0.62, math.sqrt(10.0))
    axes.set_ylim(middle / half, middle * half)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if half < 10.0 else (1.0,), numticks=5))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    if 0.0 < doubt < math.inf:
        low, high = axes.get_ylim()
        low = min(max(low, 100 * doubt / BAND), 100 * doubt)
        axes.axhspan(low, 100 * doubt, color="0.92", zorder=0)
        axes.set_ylim(low, max(high, 200 * doubt))


def _per_cent(errors: Sequence[float]) -> Array:
    return 100 * np.maximum(errors, LEAST)

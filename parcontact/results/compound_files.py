"""Files of a fitted material: a material file that jobs include, and a picture.

The picture shows moduli at the reference temperature with the fit, residuals, branches and shift factors.
"""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..errors import InputError
from ..parallel.slab import Array
from ..rubber.compound import TITLE, Compound
from ..rubber.series import reduce_sets
from ..rubber.superposition import log_factors
from ..storage import files, hdf5
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

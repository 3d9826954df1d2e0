"""The files of a fitted compound: a material file that jobs include, and a picture.

The picture has the moduli moved to the reference temperature beside the fit, what the fit misses, branches and shift.
"""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..errors import InputError, RunError
from ..parallel.slab import Array
from ..physics.prony import complex_modulus, relaxation
from ..rubber.compound import TITLE, Compound
from ..rubber.tables import Set
from ..storage import files
from . import style

COLORS = (style.BLUE, style.RED)  # of storage and loss
POINTS = 400  # of a line


def refuse_foreign(target: Path) -> None:
    """Raise InputError for a file that is there and was not written by a fit: it is never replaced."""
    if target.suffix not in (".yaml", ".yml"):
        raise InputError(f"--out must end in .yaml, got {str(target)!r}")
    try:
        if target.exists() and not target.read_text(errors="replace").startswith(TITLE):
            raise InputError(f"{target} is there and was not written by parcontact fit; choose another --out")
    except OSError as error:
        raise InputError(f"{target} cannot be read: {error}") from error


def write(compound: Compound, target: Path, job_band: tuple[float, float] | None) -> Iterator[str]:
    """Write both files and say so, line by line; `job_band` [Hz] are the frequencies of a job. Raises RunError."""
    text, picture = compound.text(), target.with_suffix(".png")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        files.write(target, text)
        draw(compound, picture, job_band)
    except OSError as error:
        raise RunError(f"{target} cannot be written: {error}") from error
    yield from (line.removeprefix("# ") for line in text.splitlines() if line.startswith("#"))
    if compound.shift is not None:
        yield f"shift: {compound.shift}"
    yield f"material file: {target}, picture: {picture}"
    yield from (f"warning: {text}" for text in compound.doubts())
    if job_band:
        low, high = compound.material()["band"]
        for ratio, side in ((low / job_band[0], "below"), (job_band[1] / high, "above")):
            if ratio > 1.0:
                beyond = f"{math.log10(ratio):.1f} decades {side} the measured band"
                yield f"warning: the job's frequencies reach {beyond}"


def draw(compound: Compound, path: Path, job_band: tuple[float, float] | None = None) -> None:
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
        style.save(figure, path, dpi=150)


def _reduced(compound: Compound) -> Iterator[tuple[Set, Array]]:
    """Yield the sets, and where they lie at the reference: frequencies [Hz], or times [s]."""
    for each in compound.measured.sets:
        shift, log = compound.shift, 0.0
        if shift is not None and each.temperature is not None:  # else measured at the reference
            log = shift.log_factor(each.temperature)
        frequency = compound.measured.kind == "frequency"
        yield each, each.at * 10.0**log / (2 * np.pi) if frequency else each.at / 10.0**log


def _fit(compound: Compound, at: Array) -> list[Array]:
    """Return fitted moduli [Pa]: storage and loss at frequencies [Hz], or of relaxation at times [s]."""
    series = compound.series.modulus_inf, compound.series.moduli, compound.series.times
    if compound.measured.kind == "time":
        return [np.asarray(relaxation(at, *series))]
    found = np.asarray(complex_modulus(2 * np.pi * at, *series))
    return [found.real, found.imag]


def _draw_moduli(top: Axes, bottom: Axes, compound: Compound) -> None:
    """Draw the moduli as the table has them, Young's or of shear, the fit, and below by how much they differ."""
    measured, sets = compound.measured, list(_reduced(compound))
    letter, kind, size = ("E", "Young's", 2.0 * (1.0 + compound.poisson)) if measured.tension else ("G", "shear", 1.0)
    frequency = measured.kind == "frequency"
    names = (f"{letter}'", f"{letter}''") if frequency else (f"{letter}(t)",)
    from_tangent = {"stor": (f" = {names[-1]} / tan δ", ""), "loss": ("", f" = {names[0]} tan δ")}
    notes = from_tangent.get(measured.derived, ("", ""))
    every = np.concatenate([at for _, at in sets])
    line = np.geomspace(every.min(), every.max(), POINTS)
    for k, (name, fitted) in enumerate(zip(names, _fit(compound, line), strict=True)):
        for number, (each, at) in enumerate(sets):
            values, look = (each.storage, each.loss)[k], {"ms": 3, "mfc": "none", "color": COLORS[k]}
            label = None if number else f"{name}{notes[k]} measured"
            top.loglog(at, size * values, "os"[k], label=label, **look)
            bottom.semilogx(at, 100 * (_fit(compound, at)[k] / values - 1.0), "os"[k], **look)
        top.plot(line, size * fitted, color=COLORS[k], label=f"{name} fitted")
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

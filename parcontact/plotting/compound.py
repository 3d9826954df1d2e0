"""A picture of a fitted compound: moduli moved to the reference temperature, the fit, what it misses, the shift."""

from collections.abc import Iterator
from typing import BinaryIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..physics.prony import complex_modulus, relaxation
from ..rubber.compound import Compound
from ..rubber.tables import Set
from . import style

STORAGE, LOSS, BAND = style.BLUE, style.RED, "#999999"
POINTS = 400  # of a line


def draw(compound: Compound, file: BinaryIO, job_band: tuple[float, float] | None = None) -> None:
    """Write a png; `job_band` [Hz] are the frequencies that a job excites."""
    with style.drawing({}):
        figure = Figure(figsize=(8, 6), layout="constrained")
        top, bottom = figure.subplots(2, 2, width_ratios=(2, 1))
        _moduli(top[0], compound)
        _misfit(bottom[0], compound)
        bottom[0].sharex(top[0])
        if job_band:
            for axes, label in ((top[0], "frequencies of the job"), (bottom[0], None)):
                axes.axvspan(*job_band, color=BAND, alpha=0.25, lw=0, label=label)
        top[0].legend(frameon=False, fontsize="small")
        _spectrum(top[1], compound)
        _shift(bottom[1], compound)
        for axes in (*top, *bottom):
            axes.grid(alpha=0.3)
        style.save(figure, file, dpi=150)


def _reduced(compound: Compound) -> Iterator[tuple[Set, np.ndarray]]:
    """The sets, and where they lie at the reference: frequencies [Hz], or times [s]."""
    for each in compound.measured.sets:
        shift, log = compound.shift, 0.0
        if shift is not None and each.temperature is not None:  # else measured at the reference
            log = shift.log_factor(each.temperature)
        frequency = compound.measured.kind == "frequency"
        yield each, each.at * 10.0**log / (2 * np.pi) if frequency else each.at / 10.0**log


def _fit(compound: Compound, at: np.ndarray) -> list[np.ndarray]:
    """Fitted moduli [Pa]: storage and loss at frequencies [Hz], or of relaxation at times [s]."""
    series = compound.series
    if compound.measured.kind == "time":
        return [np.asarray(relaxation(at, series.modulus_inf, series.moduli, series.times))]
    found = np.asarray(complex_modulus(2 * np.pi * at, series.modulus_inf, series.moduli, series.times))
    return [found.real, found.imag]


def _moduli(axes: Axes, compound: Compound) -> None:
    """The moduli as the table has them, Young's or of shear, and the fit beside them."""
    measured = compound.measured
    letter, kind = ("E", "Young's") if measured.tension else ("G", "shear")
    size = 2.0 * (1.0 + compound.poisson) if measured.tension else 1.0
    all_at = np.concatenate([at for _, at in _reduced(compound)])
    line = np.geomspace(all_at.min(), all_at.max(), POINTS)
    names = (f"{letter}'", f"{letter}''") if measured.kind == "frequency" else (f"{letter}(t)",)
    from_tangent = {"stor": (f" = {names[-1]} / tan δ", ""), "loss": ("", f" = {names[0]} tan δ")}
    notes = from_tangent.get(measured.derived, ("", ""))
    for k, (name, color, fitted) in enumerate(zip(names, (STORAGE, LOSS), _fit(compound, line), strict=False)):
        for number, (each, at) in enumerate(_reduced(compound)):
            label = f"{name}{notes[k]} measured" if number == 0 else None
            axes.plot(at, size * (each.storage, each.loss)[k], "os"[k], ms=3, mfc="none", color=color, label=label)
        axes.plot(line, size * fitted, color=color, label=f"{name} fitted")
    axes.set(xscale="log", yscale="log", ylabel=f"{kind} modulus [Pa]")


def _misfit(axes: Axes, compound: Compound) -> None:
    for each, at in _reduced(compound):
        for k, (fitted, color) in enumerate(zip(_fit(compound, at), (STORAGE, LOSS), strict=False)):
            axes.plot(at, 100 * (fitted / (each.storage, each.loss)[k] - 1.0), "os"[k], ms=3, mfc="none", color=color)
    axes.axhline(0.0, color="black", lw=0.8)
    reference = f" at {compound.shift.reference:g} °C" if compound.shift is not None else ""
    what = "frequency{} [Hz]" if compound.measured.kind == "frequency" else "time{} [s]"
    axes.set(xscale="log", xlabel=what.format(reference), ylabel="fitted over measured - 1 [%]")


def _spectrum(axes: Axes, compound: Compound) -> None:
    axes.plot(compound.series.times, compound.series.moduli, "o", ms=4, color="black")
    axes.set(xscale="log", yscale="log", xlabel="relaxation time [s]", ylabel="shear modulus of the branch [Pa]")


def _shift(axes: Axes, compound: Compound) -> None:
    temperatures = [each.temperature for each in compound.measured.sets if each.temperature is not None]
    if compound.shift is None or not temperatures:
        axes.set_axis_off()
        return
    line = np.linspace(min(temperatures), max(temperatures), POINTS)
    axes.plot(line, [compound.shift.log_factor(float(t)) for t in line], color="black")
    axes.plot(temperatures, [compound.shift.log_factor(t) for t in temperatures], "o", ms=4, color="black")
    axes.set(xlabel="temperature [°C]", ylabel="log10 of the shift factor")

"""Files of fitted materials, which are sections that jobs include, and their pictures.

A picture shows the moduli at the reference temperature with the fit, residuals, branches and shift factors.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files import files
from ..parallel.slab import Array
from ..rubber.compound import TITLE, Compound
from ..rubber.series import log_factors, reduce_sets
from . import style
from .panels import Axis, Line, Panel, Shade, picture

COLORS = (style.BLUE, style.RED)  # colours of storage and loss moduli
SOLID, DOTS = {"color": "k"}, {"color": "k", "marker": "o", "linestyle": "none", "mfc": "none"}
POINTS = 400  # number of points of a line


def refuse_foreign(target: Path) -> None:
    """Raise InputError for an existing file that `parcontact fit` did not write."""
    if target.suffix not in (".yaml", ".yml"):
        raise InputError(f"--out must end in .yaml, got {str(target)!r}")
    try:
        if target.exists() and not target.read_text(errors="replace").startswith(TITLE):
            raise InputError(f"{target} exists and was not written by parcontact fit; choose another --out")
    except OSError as error:
        raise InputError(f"{target} cannot be read: {error}") from error


def write_compound(compound: Compound, target: Path, job_band: tuple[float, float] | None) -> Iterator[str]:
    """Write the file of a material and its picture, and yield messages: the comments of the file, both paths, and
    warnings about the fit. `job_band` is the range of frequencies [Hz] that a job excites; a warning says if it reaches
    beyond the measured frequencies. Raises InputError."""
    text, picture = compound.text(), target.with_suffix(".png")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        files.replace_file(target, text)
        draw_compound(compound, picture, job_band)
    except OSError as error:
        wrong = files.without_mark(Path(error.filename or target))
        raise InputError(f"{wrong} cannot be written: {files.reason(error)}") from error
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
    """Write the picture of a fitted material as png, with the range `job_band` [Hz] of a job shaded. Raises OSError."""
    shades = [Shade("frequencies of the job", *job_band)] if job_band else []
    panels = [replace(panel, shades=shades) for panel in _moduli(compound)]
    branches = Line("", compound.series.times, compound.series.moduli, DOTS)
    axes = Axis("relaxation time", "s"), Axis("shear modulus\nof the branch", "Pa")
    panels.append(Panel("branches", *axes, [branches], log_x=True, log_y=True))
    with style.drawing():
        style.save_figure(picture("", [[*panels, *_shift(compound)]]), path)


def _reduced(compound: Compound) -> Iterator[tuple[Array, list[Array]]]:
    """Yield for each set the frequencies [rad/s] or times [s], and the moduli [Pa], at the reference temperature."""
    kind = compound.measured.kind
    for each in compound.measured.sets:
        shift, temperature = compound.shift, each.temperature
        logs = None if shift is None or temperature is None else log_factors(shift, [temperature])
        data = reduce_sets([each], kind, logs)
        yield data.at, np.split(data.moduli, 2) if kind == "frequency" else [data.moduli]


def _moduli(compound: Compound) -> list[Panel]:
    """Return the panels of measured moduli (Young's or shear) with the fit, and of their relative difference."""
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

    top, bottom = list[Line](), [Line("", every / unit, np.zeros(every.size), {"color": "k", "linewidth": 0.8})]
    for k, name in enumerate(names):
        at, values = np.concatenate([at for at, _ in sets]), np.concatenate([each[k] for _, each in sets])
        look = DOTS | {"color": COLORS[k], "marker": "os"[k], "markersize": 3}
        top.append(Line(f"{name}{notes[k]} measured", at / unit, size * values, look))
        top.append(Line(f"{name} fitted", line / unit, size * fitted(line, k), {"color": COLORS[k]}))
        bottom.append(Line("", at / unit, 100 * (fitted(at, k) / values - 1.0), look))
    reference = f" at {compound.shift.reference:g} °C" if compound.shift is not None else ""
    x = Axis(f"frequency{reference}", "Hz") if frequency else Axis(f"time{reference}", "s")
    modulus, misfit = Axis(f"{kind} modulus", "Pa"), Axis("fitted over\nmeasured - 1 [%]")
    return [Panel("moduli", x, modulus, top, log_x=True, log_y=True), Panel("misfit", x, misfit, bottom, log_x=True)]


def _shift(compound: Compound) -> Iterator[Panel]:
    """Yield the panel of the shift over temperature, if it is known."""
    temperatures, shift = compound.measured.temperatures, compound.shift
    if shift is None or not temperatures:
        return
    drawn = (np.linspace(min(temperatures), max(temperatures), POINTS), SOLID), (np.array(temperatures), DOTS)
    lines = [Line("", at, np.array([shift.log_factor(float(t)) for t in at]), look) for at, look in drawn]
    yield Panel("shift", Axis("temperature", "°C"), Axis("log10 of the shift factor"), lines, bottom=False)

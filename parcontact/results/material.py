"""The section on the material: moduli, branches, temperature shift, and the excited frequencies."""

import math
from collections.abc import Iterator
from contextlib import suppress
from functools import partial

import numpy as np
from matplotlib.axes import Axes

from ..bands.choice import cut_bands, on_one_grid_of_all
from ..effects.relaxation import relaxation_of
from ..errors import InputError
from ..job import Dma, Job, Zener
from ..job.checks.frequencies import excited_band
from ..physics.prony import complex_modulus
from ..scene.measured_range import excited_bands
from . import prefixes, style
from .page_parts import ReportSection, ReportTable, draw_panel

DECADES = 1.5  # range of a picture beyond the relaxation times [decades]
POINTS = 400  # number of points of a line
CAPTION = "moduli and loss tangent over frequency, at the temperature of the job"


def material_section(job: Job) -> ReportSection:
    """Return the section on the material of a job at its temperature."""
    if job.bands is not None:
        with suppress(InputError):  # its files no longer exist
            job = on_one_grid_of_all(job, cut_bands(job))
    series = relaxation_of(job.material)
    instant = series.modulus_inf + float(np.sum(series.moduli))
    rows = [
        ("long-term shear modulus", prefixes.quantity(series.modulus_inf, "Pa", 4)),
        ("instantaneous shear modulus", prefixes.quantity(instant, "Pa", 4)),
        ("Poisson's ratio", f"{job.material.poisson:g}"),
        ("relaxing branches", str(series.moduli.size)),
        *_describe_temperature(job),
    ]
    if job.included:
        rows.append(("included from", job.included))
    tables = [ReportTable(("property", "value"), rows)]
    if not series.moduli.size:
        return ReportSection("Material", tables=tables)
    branches = zip(series.relaxation_times, series.moduli, strict=True)
    listed = [
        (prefixes.quantity(float(tau), "s"), prefixes.quantity(float(modulus), "Pa")) for tau, modulus in branches
    ]
    tables.append(ReportTable(("relaxation time", "modulus"), listed, "G(t) = G_inf + sum of modulus exp(-t/time)"))
    if (excited := _list_bands(job)).rows:
        tables.append(excited)
    return ReportSection("Material", tables=tables, pictures=[draw_panel(partial(_draw_moduli, job=job), CAPTION)])


def _describe_temperature(job: Job) -> Iterator[tuple[str, str]]:
    found = job.material.fitted
    if isinstance(given := job.material.given, Dma):
        yield "fitted to", str(given.path)
    if not isinstance(found, Zener):
        return
    if found.shift is not None:
        reference = found.shift.made.reference
        temperature = reference if found.temperature is None else found.temperature
        yield "temperature", f"{temperature:g} °C (reference {reference:g} °C)"
        yield "shift factor a_T", f"{found.time_factor:.4g}"
        if found.shift.vertical is not None:
            yield "vertical shift factor b_T", f"{found.modulus_factor:.4g}"
    if found.band is not None:
        yield "measured frequencies, reduced to the reference", _write_band(found.band)
    if found.temperatures is not None:
        yield "measured temperatures", f"{found.temperatures[0]:g} to {found.temperatures[1]:g} °C"


def _list_bands(job: Job) -> ReportTable:
    """Return a table of the frequencies that sliding excites at each temperature."""
    found = excited_bands(job, (job.steady.temperatures if job.steady else None) or ())
    degrees = ("–" if one.temperature is None else f"{one.temperature:g} °C" for one in found)
    ranges = ((f"{one.factor:.3g}", _write_band(one.band), _write_band(one.reduced)) for one in found)
    rows = [(degree, *others) for degree, others in zip(degrees, ranges, strict=True)]
    caption = "frequencies of the passing waves of the surface, at all velocities of the job"
    return ReportTable(("temperature", "a_T", "excited by the job", "reduced to the reference"), rows, caption)


def _write_band(band: tuple[float, float]) -> str:
    return f"{prefixes.quantity(band[0], 'Hz')} to {prefixes.quantity(band[1], 'Hz')}"


def _draw_moduli(axes: Axes, job: Job) -> None:
    """Draw storage and loss modulus over frequency, and the loss tangent."""
    series = relaxation_of(job.material)
    ends = np.log10(1.0 / (2 * math.pi * series.relaxation_times))
    frequency = np.logspace(ends.min() - DECADES, ends.max() + DECADES, POINTS)
    omega = 2 * math.pi * frequency
    value = np.asarray(complex_modulus(omega, series.modulus_inf, series.moduli, series.relaxation_times))
    axes.loglog(frequency, value.real, label="G' storage", **style.line(0))
    axes.loglog(frequency, value.imag, label="G'' loss", **style.line(1))
    axes.set(xlabel="frequency [Hz]", ylabel="shear modulus [Pa]")
    if band := excited_band(job):
        axes.axvspan(*band, color=style.GREY, alpha=0.2, lw=0, label="excited by the job")
    loss_axes = axes.twinx()
    loss_axes.semilogx(frequency, value.imag / value.real, label="tan δ", **style.line(2))
    loss_axes.set_ylabel("tan δ")
    loss_axes.set_ylim(bottom=0.0)
    loss_axes.grid(False)

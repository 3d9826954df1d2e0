"""Warnings about a scene, from its heights and its rubber before a run, and from its contacts during the run.

Warnings that follow from a job alone are in `job/meaning.py`. All ranks give the same warnings, since every warning
depends on sums over all ranks. The rubber of a job may not have been measured at the frequencies and temperatures of
the job.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np

from ..effects.branches import time_factor_of
from ..errors import Doubt, InputError, JobError, Kind, RunError
from ..job import Grid, Job, OnOneMesh, Output, Zener, advice, limits, meaning
from ..job.advice import more_points
from ..job.history import Timeline
from ..job.limits import MOST_STEPS
from ..job.meaning import excited_band
from ..parallel import regrid
from ..parallel.slab import Array, Slab
from ..physics.convolution import wavenumbers
from ..physics.records import Measures
from ..printed import rounded_up
from ..rubber.shift import doubt_kelvin
from .scene import Setup, set_up
from .time_error import RunProperties, StepObservation, properties_of, resolves

SEAM = 2.0  # accuracy: least jump across the edge, over the largest increment inside, for a warning
FEW_CELLS = 0.15  # accuracy: least excess of the counted area, as a share of it, for a warning
FEW_POINTS = 2**22  # tuning: largest number of points whose heights are computed for a check; this takes seconds
MOST_INSTANTS = 10**6  # tuning: most saved instants in one file, which reserves space for all of them
STRICT = "an error with numerics.strict"
BINS = 12  # accuracy: bins of wavenumbers in an octave
LEAST = 1e-6  # accuracy: share of the mean square slope below which a bin has no waves
RESOLVED = 1e-6  # accuracy: largest rounding of heights over an approach
FULL_CONTACT_ROUNDING = 1e-14  # rounding: relative rounding of a sum of lengths


def refuse_impossible(job: Job, timeline: Timeline) -> None:
    """Raise InputError for a run with too many points for the memory, or with too many instants."""
    count = timeline.count
    endless = f"the history would have {count:.3g} steps; it has at most {MOST_STEPS:.0e}" if count > MOST_STEPS else ""
    refuse_memory(job)
    for text in (_beyond_file(count, job.output), endless):
        if text:
            raise InputError(text)


def _beyond_file(count: int, output: Output) -> str:
    """Return a message if a run of `count` steps saves more than MOST_INSTANTS instants of fields, or ''."""
    saved = -(-count // output.every)
    if not output.fields or saved <= MOST_INSTANTS:
        return ""
    least = -(-count // MOST_INSTANTS)
    return (
        f"output.every: {saved:.4g} instants of fields would be saved, but a file holds at most {MOST_INSTANTS}; use "
        f"every: {least} or more"
    )


def refuse_memory(job: Job) -> None:
    """Raise InputError for a grid that cannot fit into the memory of the machines."""
    for doubt in limits.doubt_memory(job.grid):
        raise InputError(str(doubt))


def is_quickly_made(job: Job) -> bool:
    """Return True if warnings depend on the heights of a job, and if the grid is so small that the heights can be
    computed for these warnings alone."""
    return job.depends_on_heights and job.grid.nx * job.grid.ny <= FEW_POINTS


def describe_waves(job: Job) -> list[str]:
    """Return sentences of effects on the waves of a job's surface. The surface is computed on one grid and one rank.
    The list is empty for a flat surface, and for a grid with too many points."""
    if job.grid.nx * job.grid.ny > FEW_POINTS:
        return []
    setup = set_up(job, Slab.alone(*job.grid.points))
    q = np.hypot(*wavenumbers(setup.fft, setup.size)).ravel() / setup.units.length
    heights = setup.surface.heights((0.0, 0.0), setup.slab.empty()) * setup.units.height
    slopes = (setup.fft.multiplicity * np.abs(setup.fft.forward(heights) / setup.slab.points) ** 2).ravel() * q**2
    bins = np.rint(BINS * np.log2(np.maximum(q / q[q > 0.0].min(), 1.0))).astype(np.int64)
    sums, weighted = (np.bincount(bins, weights) for weights in (slopes, slopes * q))
    kept = sums > LEAST * sums.sum()
    if not kept.any():
        return []
    middle = weighted[kept] / sums[kept]
    return [text for describe in job.asked("describe_waves") for text in describe(job, middle, sums[kept])]


def find_doubts(setup: Setup, temperatures: Sequence[float] = ()) -> list[Doubt]:
    """Return warnings about a job at temperatures [deg C] and about its heights; collective. Raises InputError if there
    are warnings about heights and `numerics.strict` is set."""
    return [*setup.job.doubts, *doubt_band(setup.job, temperatures), *check_heights(setup)]


def check_heights(setup: Setup) -> list[Doubt]:
    """Return warnings about the heights of a scene; collective. Raises InputError if there are any and
    `numerics.strict` is set."""
    found = list(_check_heights(setup))
    if found and setup.choices.numerics.strict:
        place = f"{setup.job.origin.strict}: " if setup.job.origin.strict else ""
        raise InputError("\n".join(f"{place}{doubt} ({STRICT})" for doubt in found))
    return found


def _check_heights(setup: Setup) -> Iterator[Doubt]:
    known = {doubt.kind for doubt in setup.job.doubts}
    if setup.roughness and "steep" not in known:
        yield from meaning.doubt_slope(setup.roughness.rms_slope, setup.job.surface)
    yield from setup.remarks.doubts
    seams: list[Doubt] = []
    if any(isinstance(shape, OnOneMesh) for shape in setup.job.surface) and setup.grid.boundary == "periodic":
        seams = list(_seams(setup, setup.surface.heights((0.0, 0.0), setup.slab.empty())))
        yield from seams
    if setup.roughness and not setup.surface.shapes:
        for doubt_heights in setup.job.asked("doubt_heights"):
            yield from doubt_heights(setup.job, setup.heights.span)
    if setup.shortest is not None and not (seams or setup.job.origin.mesh):  # a seam has further waves
        asked, spiky = setup.choices.numerics.asked, any(doubt.kind == "outliers" for doubt in setup.remarks.doubts)
        yield from advice.doubt_measured_waves(setup.grid, setup.shortest, asked, setup.job.directions, spiky)


# -- full contact -----------------------------------------------------------------------------------------------------


def has_full_contact(setup: Setup) -> bool:
    """Return True if the approach has an upper limit. This is so if the body is periodic, its mean level is fixed, and
    no hardness bounds the pressure."""
    return not setup.half_space.moves_in_the_mean and setup.choices.hardness is None


def beyond_full_contact(setup: Setup, approach: float, mean: float) -> str:
    """Return a sentence if an approach [m] is beyond full contact, else ''. `mean` is the mean height [m] above the
    datum of the surface."""
    closed = -mean - setup.surface.datum
    rounding = FULL_CONTACT_ROUNDING * (abs(approach) + abs(setup.surface.datum) + setup.height)
    if approach - closed <= rounding:
        return ""
    return (
        f"an approach of {approach:.6g} m is beyond full contact, which a periodic body reaches at "
        f"{closed if abs(closed) > rounding else 0.0:.6g} m; approach no further, or prescribe a pressure instead"
    )


def below_rounding(setup: Setup, approach: float) -> str:
    """Return a sentence if an approach [m] is smaller than the rounding of the heights and is not 0, else ''."""
    heights = setup.heights.span + abs(setup.surface.datum)
    least = float(np.finfo(np.float64).eps) / RESOLVED * heights
    if not 0.0 < abs(approach) < least:
        return ""
    return (
        f"an approach of {approach:.3g} m is lost in the rounding of heights that span {heights:.3g} m; give 0 or at "
        f"least {rounded_up(least)} m, check the unit of the heights, or prescribe a pressure"
    )


def refuse_approaches(setup: Setup) -> None:
    """Raise JobError for stages whose approach is beyond full contact, or smaller than the rounding of the heights."""
    mistakes, bounded = [], has_full_contact(setup)
    for index, stage in enumerate(setup.job.history):
        if stage.control != "approach":
            continue
        ends = stage.load.lowest, stage.load.highest
        text = below_rounding(setup, max(ends, key=abs))
        text = text or (beyond_full_contact(setup, max(ends), setup.heights.mean) if bounded else "")
        if text:
            place = next(iter(setup.job.origin.approaches[index:]), "")
            mistakes.append(f"{place}: history.{index}: {text}" if place else f"history.{index}: {text}")
    if mistakes:
        raise JobError(mistakes)


# -- the edge of a periodic box ---------------------------------------------------------------------------------------


WARN_TILT = Kind(
    "tilt",
    "the heights at the two ends along {axis} of the periodic box differ by {jump:.3g} m (rms), {times!t} the "
    "largest step between neighbours inside. Such a step adds friction; the surface is tilted by {tilt:.3g}: "
    "subtract its mean plane",
)
WARN_SEAM = Kind(
    "seam",
    "the heights at the two ends along {axis} of the periodic box differ by {jump:.3g} m (rms), {times!t} the "
    "largest step between neighbours inside. Such a step adds friction; cut the map where its ends fit, or let "
    "heights fade to their mean towards the edges",
)


def _seams(setup: Setup, heights: Array) -> Iterator[Doubt]:
    """Yield warnings if opposite edges of a periodic box do not fit together."""
    unit, grid = setup.units.height, setup.grid
    for name, (jump, inside, rise), length in (
        ("x", _along_x(setup.slab, heights), grid.lx),
        ("y", _along_y(setup.slab, heights), grid.ly),
    ):
        if jump <= SEAM * inside:
            continue
        kind = WARN_TILT if math.sqrt(max(jump**2 - rise**2, 0.0)) <= SEAM * inside else WARN_SEAM
        times, tilt = jump / inside if inside else math.inf, abs(rise) / length * unit
        yield kind("surface", {"axis": name, "jump": jump * unit, "times": times, "tilt": tilt})


def _along_x(slab: Slab, heights: Array) -> tuple[float, float, float]:
    """Return the rms jump across the edge, the largest rms increment inside, and the mean rise across the box."""
    if slab.nx < 3:
        return 0.0, 0.0, 0.0
    steps = np.roll(heights, -1, axis=1) - heights
    squares = slab.sum(*(steps**2).sum(axis=0).tolist(), -float(steps[:, -1].sum()))
    *columns, rise = squares
    rms = np.sqrt(np.array(columns) / slab.ny)
    return float(rms[-1]), float(rms[:-1].max()), rise / slab.ny


def _along_y(slab: Slab, heights: Array) -> tuple[float, float, float]:
    """Return, for steps from row to row, the rms jump, the largest rms increment and the mean rise."""
    before = regrid.before_first(slab, heights, True)
    if slab.ny < 3:
        return 0.0, 0.0, 0.0
    steps = np.diff(np.concatenate([np.atleast_2d(before), heights]), axis=0) if len(heights) else heights
    rms = np.sqrt((steps**2).mean(axis=1))
    first = slab.rows.start == 0 and len(heights) > 0
    at_edge = float(rms[0]) if first else 0.0
    inside = float(rms[1 if first else 0 :].max(initial=0.0))
    rise, jump, most = slab.reduce([-float(steps[0].mean()) if first else 0.0], [at_edge, inside])
    return jump, most, rise


# -- contacts ---------------------------------------------------------------------------------------------------------


@dataclass
class ContactWatch:
    """Checks the contact of each step, and gives each kind of warning once.

    If `strict` is True, warnings are errors. `finer` is the advice on a finer mesh in a warning about few cells.
    `further` are the checks of effects: functions of the measures and a place. `mesh` states the points of the grid.
    """

    strict: bool
    timeline: Timeline
    finer: str
    seen: set[str] = field(default_factory=set)
    further: Sequence[Callable[[Measures, str], Iterator[Doubt]]] = ()
    mesh: RunProperties = field(default_factory=lambda: RunProperties(1))

    @classmethod
    def of(cls, job: Job, timeline: Timeline) -> "ContactWatch":
        """Return the checks of contacts for a job."""
        further = [partial(asked, job) for asked in job.asked("doubt_contact")]
        mesh = properties_of(job, None)
        return cls(job.numerics.strict, timeline, finer_cells(job.grid), further=further, mesh=mesh)

    def check_step(self, step: int, measures: Measures) -> list[Doubt]:
        """Return the new warnings about the contact of a step. Raises RunError if there are any and `numerics.strict`
        is set."""
        ends_a_stage = 0 < step <= self.timeline.count and self.timeline.span(step).last == step
        return self.check_point(measures, f"step {step}", ends_a_stage)

    def check_point(self, measures: Measures, where: str, final: bool = True) -> list[Doubt]:
        """Return the new warnings about a contact at the place `where`. Only a `final` contact, at the end of a stage
        or of a solve, is checked for too few cells. Raises RunError if there are warnings and `numerics.strict` is
        set."""
        found = [WARN_EDGE("", {"where": where})] if measures.at_edge else []
        found += doubt_cells(measures, self.mesh, where, self.finer) if final else ()
        found += [doubt for ask in self.further for doubt in ask(measures, where)]
        new = [doubt for doubt in found if doubt.kind not in self.seen]
        self.seen |= {doubt.kind for doubt in new}
        if new and self.strict:
            raise RunError("; ".join(f"{doubt} ({STRICT})" for doubt in new))
        return new


def finer_cells(grid: Grid) -> str:
    """Return the advice to use smaller cells on a grid."""
    return f"{more_points(grid)}, a smaller grid.size"


WARN_EDGE = Kind(
    "edge",
    "{where}: the contact reaches the edge of the box and is cut off there, so its results are wrong; use a "
    "larger grid.size, a smaller load or a shorter distance",
)


WARN_BELOW_A_CELL = Kind(
    "below a cell",
    "{where}: spots of contact may be smaller than a cell, so that their area and friction are not known and no "
    "error is stated; use {finer} or a larger load",
)
WARN_CELLS = Kind(
    "cells",
    "{where}: spots of contact are only a few cells wide: contact_area is about {excess!p} too large (limit: "
    "{most!p}); use {finer} or a larger load",
)


def doubt_cells(measures: Measures, mesh: RunProperties, where: str, finer: str) -> Iterator[Doubt]:
    """Yield a warning if spots of contact are only a few cells wide, or smaller than a cell. `finer` is the advice on a
    finer mesh."""
    area, corrected = measures.contact_area, measures.contact_area_corrected
    if not resolves(mesh, StepObservation(0.0, 0.0, area, corrected, spared=measures.spared)):
        yield WARN_BELOW_A_CELL("", {"where": where, "finer": finer})
        return
    excess = 1.0 - measures.contact_area_corrected / area if area > 0.0 else 0.0
    if excess > FEW_CELLS:
        yield WARN_CELLS("", {"where": where, "excess": excess, "most": FEW_CELLS, "finer": finer})


# -- measured frequencies and temperatures ----------------------------------------------------------------------------

NEAR = 0.5  # accuracy: decades beyond the measured band without a warning


class ExcitedBand(NamedTuple):
    """The range of frequencies [Hz] that a job excites at a temperature [deg C], and the shift factor a_T at this
    temperature.

    The temperature is None if the moduli do not depend on the temperature.
    """

    temperature: float | None
    factor: float
    band: tuple[float, float]

    @property
    def reduced(self) -> tuple[float, float]:
        """The range of frequencies [Hz] reduced to the reference temperature, at which the moduli are the same: the
        frequencies times a_T."""
        return self.band[0] * self.factor, self.band[1] * self.factor


def excited_bands(job: Job, temperatures: Sequence[float] = ()) -> list[ExcitedBand]:
    """Return the range of frequencies that a job excites, for each temperature of a friction curve, or for the
    temperature of the material if there is no curve. The list is empty if the surface does not move."""
    if (band := excited_band(job)) is None:
        return []
    body = _body(job)
    if body is None or body.shift is None:
        return [ExcitedBand(None, 1.0, band)]
    reference = body.shift.made.reference
    degrees = temperatures or (reference if body.temperature is None else body.temperature,)
    return [ExcitedBand(value, time_factor_of(job.at_temperature(value).material), band) for value in degrees]


WARN_TEMPERATURES = Kind(
    "temperatures", "{degrees} C is outside of the measured {low:g} to {high:g} C: the shift is an extrapolation there"
)
WARN_FREQUENCIES = Kind(
    "frequencies",
    "the job excites {low:.3g} to {high:.3g} Hz, reduced to the reference temperature, {decades:.1f} decades "
    "{side} the measured {first:.3g} to {last:.3g} Hz: moduli are an extrapolation there",
)


def doubt_band(job: Job, temperatures: Sequence[float] = ()) -> Iterator[Doubt]:
    """Yield warnings about frequencies and temperatures at which the material was not measured. `temperatures` [deg C]
    are the temperatures of a friction curve. Without a curve, the temperature of the material is used."""
    if (body := _body(job)) is None:
        return
    if job.steady is None or tuple(temperatures) != job.steady.temperatures:  # given apart from the job
        yield from doubt_kelvin("temperatures", temperatures)
    degrees = [value for value in temperatures or (body.temperature,) if value is not None]
    if body.temperatures is not None:
        low, high = body.temperatures
        if beyond := [value for value in degrees if not low <= value <= high]:
            degrees_text = ", ".join(f"{value:g}" for value in beyond)
            yield WARN_TEMPERATURES("material", {"degrees": degrees_text, "low": low, "high": high})
    found = excited_bands(job, temperatures)
    if body.band is None or not found:
        return
    low, high = min(one.reduced[0] for one in found), max(one.reduced[1] for one in found)
    for decades, side in ((math.log10(body.band[0] / low), "below"), (math.log10(high / body.band[1]), "above")):
        if decades > NEAR:
            measured = {"decades": decades, "side": side, "first": body.band[0], "last": body.band[1]}
            yield WARN_FREQUENCIES("material", {"low": low, "high": high, **measured})


def _body(job: Job) -> Zener | None:
    """Return the material as springs and branches; None if it is elastic."""
    return job.material.fitted if isinstance(job.material.fitted, Zener) else None

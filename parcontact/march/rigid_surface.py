"""The rigid surface of a job, a sum of shapes, waves, roughness and maps from files, and sentences about the maps."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import reduce
from operator import add
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .. import job as jobs
from ..errors import Doubt, Kind
from ..job import Grid, Job, meaning
from ..parallel.fft import FFT, Spectrum
from ..parallel.root import on_root
from ..parallel.slab import Array, Slab, allocate
from ..physics import surface
from ..physics.loops import lowest, shape_of
from ..physics.roughness import Roughness, shortest_wave
from ..physics.surface import Conical, FlatEnded, Pyramidal, Round, Shape, Surface, single_wave
from ..printed import per_cent, quantity

if TYPE_CHECKING:
    from ..job.map_files import Map
    from ..job.measured_maps import Prepared

ROUNDING = 1e-8  # accuracy: relative, by which the shortest wavelength of a table is reduced so that it is included
FLAT = 1e-14  # accuracy: range of heights over their magnitude, up to which a surface is flat


class Remarks(NamedTuple):
    """Remarks on measured maps: sentences on how they were prepared (on root), and warnings (on every rank)."""

    notes: list[str]
    doubts: list[Doubt]


def make_surface(job: Job, fft: FFT) -> tuple[Surface, Remarks]:
    """Return the rigid surface of a job, and remarks on its measured maps; collective. Raises InputError."""
    grid, remarks = job.grid, Remarks([], [])
    spectral = [part for part in job.surface if isinstance(part, jobs.Spectral)]
    waves = reduce(add, (_waves(part, grid, fft, remarks) for part in spectral)) if spectral else None
    shapes = [_indenter(part, grid) for part in job.surface if isinstance(part, jobs.Indenter)]
    surface = Surface(fft.slab, fft, grid.size, waves, shapes, grid.cyclic)
    surface.level()
    if surface.waves is not None:
        surface.waves = lowest(surface.waves, fft, highest_waves(job))
        fft.slab.tally.hold(surface.waves)
    return surface, remarks


def outline_surface(job: Job, fft: FFT) -> Surface:
    """Return the surface of a job for planning. Its map of waves is allocated but not computed."""
    waves = None
    if any(isinstance(part, jobs.Spectral) for part in job.surface):
        waves = allocate(shape_of(highest_waves(job), (fft.mx, fft.my), fft.columns), fft.complex, fft.slab.tally)
    return Surface(fft.slab, fft, job.grid.size, waves)


def _indenter(part: jobs.Indenter, grid: Grid) -> Shape:
    centre = part.center or (grid.lx / 2, grid.ly / 2)
    if isinstance(part, jobs.Cone | jobs.Pyramid):
        return (Conical if isinstance(part, jobs.Cone) else Pyramidal)(part.slope, centre)
    if isinstance(part, jobs.Punch):
        return FlatEnded(part.radius, part.edge, centre)
    along = (1.0, 1.0)
    if isinstance(part, jobs.Cylinder):
        along = (1.0, 0.0) if part.axis == "y" else (0.0, 1.0)
    return Round(part.radius, centre, along, part.profile == "exact")


def shortest_measured(job: Job, surface: Surface) -> float | None:
    """Return the shortest wave [m] of a measured surface, from its spectrum on the grid; collective.

    Return None if the job itself states the waves of the surface, or if the surface has no slopes. A map that is not
    periodic is multiplied by a window, as a jump or a crease at its edges has waves of any length. The window raises
    the highest number of waves in the box by up to 1. The result is therefore computed from this number less 1/2.
    """
    if surface.waves is None or not any(isinstance(part, meaning.READ) for part in job.surface):
        return None
    spectrum = surface.waves
    maps = [part for part in job.surface if isinstance(part, jobs.Topography)]
    windows = 2 if any(part.periodic == "mirror" for part in maps) else 1  # next to each other
    windowed = not all(job.grid.cyclic) or bool(maps)
    if windowed:
        heights = replace(surface, shapes=()).heights((0.0, 0.0), surface.slab.empty())
        rows, columns = (
            np.sin(np.pi * windows * (np.arange(n) + 0.5) / n) ** 2 if n > 1 else np.ones(1)
            for n in (surface.slab.ny, surface.slab.nx)
        )
        heights *= rows[surface.slab.rows, None] * columns
        spectrum = surface.fft.forward(heights)
    found = shortest_wave(spectrum, surface.fft, job.grid.size)
    waves = max(job.grid.size) / found - (0.5 * windows if windowed else 0.0)
    return max(job.grid.size) / waves if waves >= 1.0 else None


def shortest_of(job: Job) -> float | None:
    """Return the shortest wave [m] of the measured surface of a job on its grid (`shortest_measured`), computed on this
    rank alone."""
    slab = Slab.alone(*job.grid.points)
    return shortest_measured(job, make_surface(job, FFT(slab, measured=False))[0])


def highest_waves(job: Job) -> tuple[int, int]:
    """Return how many waves fit into the box along x and y, at most, in those parts of the surface that are sums of
    waves."""
    grid, found = job.grid, [(0, 0)]
    for part in job.surface:
        if isinstance(part, jobs.Wave):
            found.append((abs(part.waves[0]), abs(part.waves[1])))
        elif isinstance(part, jobs.Rough):
            found.append((int(grid.lx / part.short_wavelength), int(grid.ly / part.short_wavelength)))
        elif isinstance(part, jobs.Spectral):
            found.append((grid.nx // 2, grid.ny // 2))
    return max(x for x, _ in found), max(y for _, y in found)


def _waves(part: jobs.Spectral, grid: Grid, fft: FFT, remarks: Remarks) -> Spectrum:
    """Return the spectrum of one part of a surface, adding to its `remarks`; collective."""
    if isinstance(part, jobs.Wave):
        return single_wave(fft, part.amplitude, part.waves, part.phase)
    if isinstance(part, jobs.RoughSpectrum):
        return _measured_spectrum(part, grid, fft, remarks.notes)
    if isinstance(part, jobs.Topography):
        return _measured_map(part, grid, fft, remarks)
    if isinstance(part, jobs.HeightFile):
        return _transform(surface.read_heights(part.path, part.dataset, fft.slab, part.scale), fft)
    if isinstance(part, jobs.HeightArray):
        return _transform(fft.slab.from_root(part.heights.values), fft)
    limits = part.long_wavelength, part.rolloff_wavelength, part.short_wavelength
    amplitude, lay = (part.rms_slope, part.rms_height, part.psd_constant), part.anisotropy
    stretch = (lay.ratio, math.radians(lay.angle)) if lay else (1.0, 0.0)
    random = part.amplitudes == "random"
    return Roughness(part.hurst, *limits, part.seed, random, *amplitude, stretch).spectrum(fft, grid.size)


def _measured_map(part: jobs.Topography, grid: Grid, fft: FFT, remarks: Remarks) -> Spectrum:
    """Return the transform of a map, or of a surface with the spectrum of a line scan, adding to its `remarks`;
    collective."""
    from ..job import map_files, measured_maps

    heights: list[Array] = []

    def make() -> tuple[list[Doubt], tuple[measured_maps.MeasuredSpectrum, tuple[float, float]] | None]:
        found = map_files.read_map(part)
        if found.is_line:
            remarks.notes.append(describe_scan(part, found, grid.is_line))
            return [], measured_maps.of_scan(part, found, grid.is_line)
        prepared = measured_maps.prepare(part, grid, found)
        heights.append(prepared.heights)
        remarks.notes.extend(describe_treatment(prepared))
        return [*doubt_sizes(prepared), *doubt_outliers(prepared)], None

    doubts, line = on_root(fft.slab.comm, make)
    if line is not None:
        return _random_surface(*line, grid, fft, remarks.notes)
    remarks.doubts.extend(doubts)
    return _transform(fft.slab.from_root(heights[0] if heights else None), fft)


def _measured_spectrum(part: jobs.RoughSpectrum, grid: Grid, fft: FFT, notes: list[str]) -> Spectrum:
    from ..job import measured_maps

    found, (long, short) = on_root(fft.slab.comm, lambda: measured_maps.read_spectrum(part, grid.is_line))
    if fft.slab.root:
        notes.append(f"spectrum: waves from {long:.4g} to {short:.4g} m of {part.spectrum.name}")
    return _random_surface(found, (long, short), grid, fft, notes, part.seed, part.amplitudes == "random")


def _random_surface(
    found: Callable[[Array], Array],
    ends: tuple[float, float],
    grid: Grid,
    fft: FFT,
    notes: list[str],
    seed: int = 0,
    random: bool = True,
) -> Spectrum:
    """Return the transform of a random surface with a measured spectrum between its longest and shortest wavelengths
    [m], and add to the notes on root; collective."""
    (long, short), cell = ends, grid.longest_cell
    if fft.slab.root:
        if short < 2 * cell:
            notes.append(f"spectrum: the grid has no waves shorter than two cells, {2 * cell:.4g} m")
        if long > grid.longest_side * (1.0 + ROUNDING):
            notes.append(f"spectrum: the box has no waves longer than {grid.longest_side:.4g} m")
    limits = long, long, short * (1.0 - ROUNDING)  # the last point of a table is among its waves
    return Roughness(1.0, *limits, seed, random, psd_constant=1.0, measured=found).spectrum(fft, grid.size)


def _transform(heights: Array, fft: FFT) -> Spectrum:
    """Return the transform of heights. Their mean is added in Fourier space, to keep digits; collective."""
    mean = fft.slab.sum(float(heights.sum()))[0] / fft.slab.points
    spectrum = fft.forward(heights - mean)
    if fft.columns.start == 0 < fft.columns.stop:
        spectrum[0, 0] += mean * fft.slab.points
    return spectrum


class HeightRange(NamedTuple):
    """Heights [m] of a surface. `span` is the difference between the highest and the lowest point (Sz), or 0 for a
    surface that is flat up to rounding. `highest` is the highest point and `mean` the mean height, both relative to the
    datum of the surface."""

    span: float
    highest: float
    mean: float


def heights_of(surface: Surface) -> HeightRange:
    """Return the range of heights of a surface; collective."""
    heights = surface.heights((0.0, 0.0), surface.slab.empty())
    extremes = [float(heights.max(initial=-np.inf)), float((-heights).max(initial=-np.inf))]
    total, top, bottom = surface.slab.reduce([float(heights.sum(dtype=np.float64))], extremes)
    span = top + bottom if top + bottom > FLAT * max(abs(top), abs(bottom), abs(surface.datum)) else 0.0
    return HeightRange(span, top, total / surface.slab.points)


# -- sentences about measured maps -------------------------------------------------------------------------------------

LARGEST, SMALLEST = 1.0, 5e-11  # m: largest side of a map, and least distance of its points, without a warning
FLATTEST = 1e-5  # physics: least range of heights over the shorter side without a warning, that of a polished wafer
OBLONG = 1.5  # largest ratio of the sides of a pixel without a warning; most instruments have squares


def describe_treatment(prepared: "Prepared") -> list[str]:
    """Return sentences on how a measured map was prepared."""
    part, cut, done, size = prepared.part, prepared.cut, prepared.treated, prepared.size
    (ny, nx), (lx, ly), odd = cut.shape, (quantity(length, "m", 4) for length in size), int(done.outliers.sum())
    lines = [f"road: {nx} x {ny} points of the map, {lx} x {ly}, are used"]
    if done.missing:
        lines.append(f"road: {done.missing} missing points ({per_cent(done.missing / cut.size)}) were filled")
    if odd and part.outliers == "clip":
        lines.append(f"road: outliers set to the median of their neighbours: {odd}")
    if part.short_wavelength:
        lines.append(
            f"road: waves shorter than {quantity(part.short_wavelength, 'm', 4)} were removed (ideal low-pass)"
        )
    return lines


def describe_scan(part: jobs.Topography, scan: "Map", line: bool) -> str:
    """Return a sentence on the random surface, or profile if `line` is True, that is made from a line scan."""
    length, made = quantity(scan.size[0], "m", 4), "profile" if line else "isotropic one"
    return (
        f"road: {part.path.name} is a line scan of {scan.heights.size} points over {length}; the surface is a random "
        f"{made} with its spectrum (C1D)"
    )


WARN_LARGE_MAP = Kind("large map", "{file}: the map is {lx:.4g} x {ly:.4g} m; are lengths in m?")
WARN_NEAR_POINTS = Kind(
    "near points", "{file}: the spacing of points is {dx!m}, less than the size of atoms; is the unit right?"
)
WARN_FLAT_MAP = Kind(
    "flat map",
    "{file}: the map is {lx!m} x {ly!m}, and its heights differ by {span!M} only; do heights and lengths have the "
    "right units?",
)
WARN_OBLONG_POINTS = Kind(
    "oblong points",
    "{file}: the spacing of points is {dx!m} along x and {dy!m} along y; is the order of x and y right?",
)


def doubt_sizes(prepared: "Prepared") -> Iterator[Doubt]:
    """Yield warnings about the size, the spacing and the heights of a map, if its units may be confused."""
    found, name = prepared.whole, prepared.part.path.name
    (ny, nx), (lx, ly) = found.heights.shape, found.size
    dx, dy = lx / nx, ly / ny
    span = float(np.nanmax(found.heights) - np.nanmin(found.heights))
    if max(lx, ly) > LARGEST:
        yield WARN_LARGE_MAP("surface", {"file": name, "lx": lx, "ly": ly})
    if max(dx, dy) < SMALLEST:
        yield WARN_NEAR_POINTS("surface", {"file": name, "dx": dx})
    if 0.0 < span < FLATTEST * min(lx, ly):
        yield WARN_FLAT_MAP("surface", {"file": name, "lx": lx, "ly": ly, "span": span})
    if max(dx, dy) > OBLONG * min(dx, dy):
        yield WARN_OBLONG_POINTS("surface", {"file": name, "dx": dx, "dy": dy})


WARN_OUTLIERS = Kind(
    "outliers",
    "{count} points of the map differ from their neighbours by more than {deviations:g} times the median "
    "deviation{repeated}. Its rms slope is {slope:.3g} with them and {without:.3g} without, and they carry load; "
    "if they are no part of the surface, give outliers: clip{nodata}",
)


def doubt_outliers(prepared: "Prepared") -> Iterator[Doubt]:
    """Yield a warning if a map has outliers and they are not clipped."""
    from ..job import measured_maps
    from ..physics.roughness import surface_statistics

    odd, cut = prepared.treated.outliers, prepared.cut
    if not odd.any() or prepared.part.outliers == "clip":
        return
    slope, without = (
        surface_statistics(measured_maps.treat(heights, "tilt", "smooth").heights, prepared.size).rms_slope
        for heights in (cut, np.where(odd, np.nan, cut))
    )
    furthest = cut[odd][np.argmax(np.abs(cut[odd] - np.nanmedian(cut)))]
    count = int(np.count_nonzero(cut == furthest))
    repeated = f"; {quantity(furthest, 'm', 4)} occurs {count} times" if count > 1 else ""
    nodata = ", or nodata: NUMBER if one number marks missing points" if prepared.part.nodata is None else ""
    numbers = {
        "nodata": nodata,
        "count": int(odd.sum()),
        "deviations": measured_maps.OUTLIER,
        "slope": slope,
        "without": without,
    }
    yield WARN_OUTLIERS("surface", {**numbers, "repeated": repeated})

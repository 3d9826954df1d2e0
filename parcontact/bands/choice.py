"""Choice of the open parameters of a job in bands: numbers of bands, boxes, points and numbers of surfaces."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..doubts import Doubt
from ..errors import InputError
from ..job import Grid, Job
from ..job.added_sections import answers
from ..job.checks.cells import fast_length
from ..job.checks.size import doubt_memory
from ..job.sections.spectral_bands import AUTO, LEAST_CELLS, Bands
from ..parallel.slab import Array
from ..physics.roughness import EDGE
from ..printed import quantity
from ..scene.measured_range import doubt_band
from .measured_band import MapBand, band_of_map
from .steep_waves import doubt_steep_waves
from .wave_spectrum import WaveSpectrum, spectrum_of

WIDTH = 0.75  # accuracy: width of a band [decades]; the error of friction is 4 % for 0.65 to 1
WAVES, WAVES_OF_LINE = 4, 16  # accuracy: number of longest waves along a box
CELLS = 4.0  # accuracy: cells per shortest wave
FEWEST, MOST = 2, 8  # tuning: limits on the number of surfaces per band
SAMPLE_SHARE = 0.3  # accuracy: share of the scatter of surfaces in the requested accuracy


@dataclass(frozen=True)
class Cut:
    """Bands as they are solved.

    `edges` [rad/m]; points along x and y of each band; number of longest waves along its box; `samples`, the
    surfaces of each band, or 0 for as many as the accuracy needs. With a `measured` map this is the coarsest band,
    and `spectrum` is the spectrum of all others.
    """

    spectrum: WaveSpectrum
    edges: Array
    points: tuple[int, int]
    waves: int
    samples: int
    measured: MapBand | None = None

    @property
    def box(self) -> float:
        """Longer side of the box of the coarsest band [m]."""
        return self.waves * self.spectrum.longest if self.measured is None else max(self.measured.grid.size)

    @property
    def line(self) -> bool:
        """True if its surfaces are profiles."""
        return 1 in self.points

    @property
    def count(self) -> int:
        return len(self.edges) - 1

    @property
    def cells(self) -> float:
        """Cells per shortest wave of a band."""
        return self.points[0] * float(self.edges[-2] / self.edges[-1]) / self.waves

    def wavelengths(self, band: int) -> tuple[float, float]:
        """Return the longest and the shortest wavelength [m] of a band."""
        return 2.0 * math.pi / float(self.edges[band]), 2.0 * math.pi / float(self.edges[band + 1])

    @property
    def rms_height(self) -> float:
        """Rms height of all bands [m]."""
        of_map = self.measured is not None
        square = float(np.var(self.measured.heights)) if self.measured else 0.0
        return math.sqrt(square + self.spectrum.moment(float(self.edges[int(of_map)]), float(self.edges[-1]), 0))

    def rms_slope(self, band: int, first: int | None = None) -> float:
        """Return the rms slope of a band, or of all bands from `first` to it."""
        start = band if first is None else first
        of_map = self.measured is not None and start == 0
        square = self.measured.rms_slope**2 if self.measured and of_map else 0.0
        if band > 0 or not of_map:
            square += self.spectrum.moment(float(self.edges[start + of_map]), float(self.edges[band + 1]), 2)
        return math.sqrt(square)


def cut_bands(job: Job) -> Cut:
    """Return the bands of a job. Raises InputError for a spectrum that cannot be read, and for too few points."""
    asked = Bands() if job.bands == AUTO or job.bands is None else job.bands
    assert isinstance(asked, Bands)
    line = asked.points is not None and 1 in asked.points
    spectrum = spectrum_of(job, line)
    if asked.cutoff_slope is not None and (shortest := spectrum.steep_beyond(asked.cutoff_slope)):
        spectrum = spectrum.without_shorter(shortest)
    decades = math.log10(spectrum.longest / spectrum.shortest)
    measured = band_of_map(job, spectrum.longest, CELLS)
    count = asked.count or 0
    count = max(1, count - bool(measured) if count else round(decades / WIDTH))
    waves, ratio = asked.waves or (WAVES_OF_LINE if line else WAVES), 10.0 ** (decades / count)
    along = fast_length(CELLS * waves * ratio * EDGE)
    points = asked.points or (along, along)
    least = LEAST_CELLS * waves * ratio * EDGE
    side = min((n for n in points if n > 1), default=1)
    if side < least:
        raise InputError(
            f"bands.points: a band from {spectrum.longest:.3g} to {spectrum.longest / ratio:.3g} m with {waves} of its "
            f"longest waves needs {math.ceil(least)} points or more along a side, got {side}"
        )
    for doubt in doubt_memory(Grid(points=points, size=(1.0, 1.0))):
        raise InputError(f"bands.count: {count} of {decades / count:.2g} decades: {doubt.body}, or more bands")
    edges = spectrum.cut(count)
    if measured:
        edges = np.concatenate([[2.0 * np.pi / max(measured.grid.size)], edges])
    return Cut(spectrum, edges, points, waves, asked.samples or 0, measured)


def describe_cut(cut: Cut, job: Job) -> list[str]:
    """Return sentences on what was chosen, and on the height and slope of the surface."""
    many = f"{cut.samples}" if cut.samples else f"{FEWEST} to {MOST}, as their scatter asks for"
    decades, count = math.log10(float(cut.edges[-1] / cut.edges[-2])), cut.count - bool(cut.measured)
    of_map = []
    if cut.measured:
        grid = cut.measured.grid
        of_map = [
            *cut.measured.notes,
            f"bands: the map is the coarsest, down to {cut.spectrum.longest:.3g} m, on {grid.nx} x {grid.ny} points",
        ]
    return [
        *of_map,
        f"bands: {count} of {decades:.2g} decades from {cut.spectrum.longest:.3g} to {cut.spectrum.shortest:.3g} "
        f"m, each on {cut.points[0]} x {cut.points[1]} points with {cut.waves} of its longest waves along the box "
        f"({cut.cells:.3g} cells per shortest wave), for a numerics.accuracy of {job.numerics.asked.friction:g}; "
        f"surfaces of each: {many}",
        f"surface: rms height {quantity(cut.rms_height, 'm', 4)}, rms slope {cut.rms_slope(cut.count - 1, 0):.4g}; "
        f"rms slopes of the bands: {', '.join(f'{cut.rms_slope(band):.3g}' for band in range(cut.count))}",
        *(text for describe in answers("bands", "describe_bands") for text in describe(job, cut)),
    ]


def on_one_grid_of_all(job: Job, cut: Cut) -> Job:
    """Return a job in bands with one grid that holds all its waves, to find the frequencies they excite."""
    side = cut.wavelengths(0)[0]
    points = 2 * math.ceil(side / cut.spectrum.shortest)
    return job.model_copy(update={"grid": Grid(points=(points, points), size=(side, side)), "bands": None})


def doubts_of_bands(job: Job, cut: Cut, temperatures: Sequence[float] = ()) -> list[Doubt]:
    """Return warnings about a job in bands: its own, about unmeasured frequencies, and about steep waves."""
    whole = on_one_grid_of_all(job, cut)
    of_map = cut.measured.doubts if cut.measured else ()
    return [*job.doubts, *of_map, *doubt_band(whole, temperatures), *doubt_steep_waves(cut.spectrum)]

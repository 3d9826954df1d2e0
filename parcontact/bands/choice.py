"""What a job in bands leaves open: how many bands there are, their boxes and points, and how many surfaces of each."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ..errors import InputError
from ..job import Grid, Job
from ..job.checks.cells import fast_length
from ..job.sections.spectral_bands import AUTO, LEAST_CELLS, Bands
from ..parallel.slab import Array
from ..physics.roughness import EDGE
from ..scene.measured_range import describe_beyond
from .limits import describe_slopes
from .wave_spectrum import WaveSpectrum, spectrum_of

NARROW, WIDE = 0.75, 1.0  # accuracy: decades of a band, for an accuracy of FINE or better, and for less
FINE = 0.03  # accuracy: bands of NARROW to WIDE decades are right to 4 % in friction, as far as was compared
WAVES, CELLS = 4, 4.0  # accuracy: longest waves along a box, cells per shortest wave
FEWEST, MOST = 2, 8  # tuning: surfaces of each band, where the scatter chooses them
SAMPLE_SHARE = 0.3  # accuracy: of the accuracy asked for, which the scatter of surfaces may have


@dataclass(frozen=True)
class Cut:
    """Bands as they are solved: their `edges` [rad/m], the points along x and y of each, the longest waves along its
    box, and surfaces of each: as many as `samples`, or until their scatter is below an accuracy where that is 0."""

    spectrum: WaveSpectrum
    edges: Array
    points: tuple[int, int]
    waves: int
    samples: int

    @property
    def count(self) -> int:
        return len(self.edges) - 1

    @property
    def cells(self) -> float:
        """Cells per shortest wave of a band."""
        return self.points[0] * float(self.edges[0] / self.edges[1]) / self.waves

    def wavelengths(self, band: int) -> tuple[float, float]:
        """Return the longest and the shortest wavelength [m] of a band."""
        return 2.0 * math.pi / float(self.edges[band]), 2.0 * math.pi / float(self.edges[band + 1])

    def rms_slope(self, band: int, first: int | None = None) -> float:
        """Return the rms slope of a band, or of all from the `first` to it."""
        low = self.edges[band if first is None else first]
        return math.sqrt(self.spectrum.moment(float(low), float(self.edges[band + 1]), 2))


def choose(job: Job) -> Cut:
    """Return the bands of a job. Raises InputError for a spectrum that cannot be read, and for too few points."""
    asked = Bands() if job.bands == AUTO or job.bands is None else job.bands
    assert isinstance(asked, Bands)
    line = asked.points is not None and 1 in asked.points
    spectrum = spectrum_of(job, line)
    if asked.cutoff_slope is not None and (shortest := spectrum.steep_beyond(asked.cutoff_slope)):
        spectrum = spectrum.without_shorter(shortest)
    decades = math.log10(spectrum.longest / spectrum.shortest)
    each = NARROW if job.numerics.asked.friction <= FINE else WIDE
    count = asked.count or max(1, math.ceil(decades / each * EDGE))
    waves, ratio = asked.waves or WAVES, 10.0 ** (decades / count)
    along = fast_length(CELLS * waves * ratio * EDGE)
    points = asked.points or (along, along)
    least = LEAST_CELLS * waves * ratio * EDGE
    if min(n for n in points if n > 1) < least:
        raise InputError(
            f"bands.points: a band from {spectrum.longest:.3g} to {spectrum.longest / ratio:.3g} m with {waves} of its "
            f"longest waves needs {math.ceil(least)} points or more along a side, got {min(points)}"
        )
    return Cut(spectrum, spectrum.cut(count), points, waves, asked.samples or 0)


def describe_cut(cut: Cut, job: Job) -> list[str]:
    """Return what was chosen, in a sentence."""
    many = f"{cut.samples}" if cut.samples else f"{FEWEST} to {MOST}, as their scatter asks for"
    decades = math.log10(float(cut.edges[1] / cut.edges[0]))
    return [
        f"bands: {cut.count} of {decades:.2g} decades from {cut.spectrum.longest:.3g} to {cut.spectrum.shortest:.3g} "
        f"m, each on {cut.points[0]} x {cut.points[1]} points with {cut.waves} of its longest waves along the box "
        f"({cut.cells:.3g} cells per shortest wave), for a numerics.accuracy of {job.numerics.asked.friction:g}; "
        f"surfaces of each: {many}"
    ]


def doubts_of_bands(job: Job, cut: Cut, temperatures: Sequence[float] = ()) -> list[str]:
    """Return warnings about a job in bands: its own, of frequencies that were not measured, and of steep waves."""
    side = WAVES * cut.spectrum.longest
    points = 2 * math.ceil(side / cut.spectrum.shortest)
    whole = job.model_copy(update={"grid": Grid(points=(points, points), size=(side, side)), "bands": None})
    return [*job.warnings, *describe_beyond(whole, temperatures), *describe_slopes(cut.spectrum)]

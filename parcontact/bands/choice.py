"""Choice of the bands of a job, from its spectrum or measured map: numbers of bands, boxes, points and surfaces.

The spectrum Phi(k) of a job is the sum of the isotropic spectra of its rough shapes. The mean square height and slope
of the waves between two wavenumbers are

    <h^2> = int Phi k dk/(2 pi),    <|grad h|^2> = int Phi k^3 dk/(2 pi).

If the surfaces are profiles, the integrals have one factor k less.

A surface from a spectrum is Gaussian, but the long waves of a real road are not. A measured map describes these waves:
if the surface of a job starts with a map, the coarsest band is the map itself, without finer waves.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .. import job as jobs
from ..errors import Doubt, InputError, Kind
from ..job import Grid, Job, Topography, map_files, measured_maps
from ..job.advice import fast_length
from ..job.calculation import LEAST_CELLS, Bands
from ..job.limits import doubt_memory
from ..job.listing import answers
from ..job.meaning import doubt_ridges
from ..job.measured_maps import prepare
from ..job.parts import AUTO
from ..march import rigid_surface
from ..march.sanity import doubt_band
from ..parallel.slab import Array
from ..physics.roughness import EDGE, Roughness
from ..printed import quantity

POINTS = 4000  # accuracy: points of the midpoint rule over ln k; its error is 1e-5 over six decades


@dataclass(frozen=True)
class WaveSpectrum:
    """Spectrum Phi of a surface as a function of wavenumbers [rad/m], for wavelengths from `longest` to `shortest` [m].

    Phi is in m^4. If `line` is True, the surface is a profile along the sliding, and Phi is in m^3. Phi is smooth
    except at the `kinks` [rad/m].
    """

    phi: Callable[[Array], Array]
    longest: float
    shortest: float
    line: bool = False
    kinks: tuple[float, ...] = ()

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest wavenumber [rad/m]."""
        return 2.0 * np.pi / self.longest, 2.0 * np.pi / self.shortest

    def moment(self, low: float, high: float, power: int) -> float:
        """Return `int Phi k^(1 + power) dk/(2 pi)` between two wavenumbers [rad/m], on profiles one factor k less. The
        result is the mean square height [m^2] for the power 0, and the mean square slope for 2."""
        step = np.log(high / low) / POINTS
        k = low * np.exp(step * (np.arange(POINTS) + 0.5))
        return float(np.sum(self.phi(k) * k ** (power + 2 - self.line)) * step / (2.0 * np.pi))

    def density_of_slopes(self, k: Array, low: float, high: float) -> Array:
        """Return Phi k^2 for wavenumbers k [rad/m], or 0 outside of `low` to `high`.

        The integral over the plane of wavenumbers is 4 pi^2 times the mean square slope. For profiles the integral
        over positive k is 2 pi times the mean square slope."""
        inside = (k >= low) & (k < high)
        known = np.where(inside, k, low)
        return np.where(inside, self.phi(known) * known**2, 0.0)

    def cut(self, count: int) -> Array:
        """Return the wavenumbers [rad/m] at the ends of `count` bands, equally spaced in the logarithm."""
        return np.geomspace(*self.ends, count + 1)

    def steep_beyond(self, slope: float) -> float:
        """Return the wavelength [m] such that the longer waves together have this rms slope; 0 if the rms slope of the
        whole spectrum is smaller."""
        edges = self.cut(POINTS)
        middle, step = np.sqrt(edges[1:] * edges[:-1]), np.log(edges[1] / edges[0])
        squares = np.cumsum(self.phi(middle) * middle ** (4 - self.line)) * step / (2.0 * np.pi)
        place = int(np.searchsorted(squares, slope**2))
        return float(2.0 * np.pi / middle[place]) if place < POINTS else 0.0

    def without_shorter(self, wavelength: float) -> "WaveSpectrum":
        """Return the spectrum without waves shorter than this wavelength [m]."""
        return replace(self, shortest=max(wavelength, self.shortest))


def spectrum_of(job: Job, line: bool = False) -> WaveSpectrum:
    """Return the spectrum of the rough shapes of a job, of profiles if `line` is True. Raises InputError for tables
    that cannot be read, or have no such spectrum."""
    parts = [part for part in job.surface if isinstance(part, jobs.Rough | jobs.RoughSpectrum)]
    found = [_part(part, line) for part in parts]
    longest, shortest = max(one.longest for one in found), min(one.shortest for one in found)
    if not shortest < longest * EDGE:
        raise InputError("surface: bands need a short_wavelength below long_wavelength")
    kinks = tuple(sorted({kink for one in found for kink in (*one.kinks, *one.ends)}))
    return WaveSpectrum(_sum([one.phi for one in found]), longest, shortest, line, kinks)


def _sum(parts: Sequence[Callable[[Array], Array]]) -> Callable[[Array], Array]:
    return lambda k: np.asarray(sum(part(k) for part in parts))


def _part(part: jobs.Rough | jobs.RoughSpectrum, line: bool) -> WaveSpectrum:
    if isinstance(part, jobs.RoughSpectrum):
        found, (longest, shortest) = measured_maps.read_spectrum(part, line)
        ends = 2.0 * np.pi / longest * EDGE, 2.0 * np.pi / shortest / EDGE
        inside = lambda k: np.where((k >= ends[0]) & (k <= ends[1]), found(k), 0.0)  # noqa: E731
        return WaveSpectrum(inside, longest, shortest, line, tuple(found.q.tolist()))
    limits = part.long_wavelength, part.rolloff_wavelength, part.short_wavelength
    unit = WaveSpectrum(Roughness(part.hurst, *limits).density, limits[0], limits[2], line)
    if part.rms_slope is not None:
        factor = part.rms_slope**2 / unit.moment(*unit.ends, 2)
    elif part.rms_height is not None:
        factor = part.rms_height**2 / unit.moment(*unit.ends, 0)
    else:
        factor = part.psd_constant or 0.0
    return replace(unit, phi=lambda k: factor * unit.phi(k), kinks=(2.0 * np.pi / limits[1],))


STEEP = 0.5  # physics: rms slope, up to which slopes count as small
USUAL = 1.3  # physics: rms slope at which the literature on rubber friction cuts spectra off (Lorenz et al. 2011)
ROUNDED = 1.01  # rounding: rms slope over USUAL, up to which a spectrum has been cut off there
STRAIN = math.exp(-1.0)  # physics: rms strain over rms slope, at the depth 1/q where the strain of a wave is largest


WARN_STEEP_WAVES_CUT_OFF = Kind(
    "steep waves, cut-off",
    "its rms slope is {slope:.3g} (rms strain {strain:.2g}); linear theory assumes small slopes, and waves shorter "
    "than {steep:.3g} m exceed a slope of {most:g}. Waves shorter than {usual:.3g} m are usually left out: give "
    "bands.cutoff_slope: {cutoff:g}",
)
WARN_STEEP_WAVES = Kind(
    "steep waves",
    "its rms slope is {slope:.3g} (rms strain {strain:.2g}); linear theory assumes small slopes, and waves shorter "
    "than {steep:.3g} m exceed a slope of {most:g}",
)


def doubt_steep_waves(spectrum: WaveSpectrum) -> Iterator[Doubt]:
    """Yield a warning if the rms slope is above STEEP, where linear theory fails. If the rms slope is above USUAL, too,
    the warning names the wavelength at which such a spectrum is usually cut off."""
    slope = math.sqrt(spectrum.moment(*spectrum.ends, 2))
    if slope <= STEEP:
        return
    steep, usual = spectrum.steep_beyond(STEEP), spectrum.steep_beyond(USUAL)
    numbers = {"slope": slope, "strain": STRAIN * slope, "steep": steep, "most": STEEP}
    if usual and slope > ROUNDED * USUAL:
        yield WARN_STEEP_WAVES_CUT_OFF("surface", {**numbers, "usual": usual, "cutoff": USUAL})
    else:
        yield WARN_STEEP_WAVES("surface", numbers)


FEWEST_WAVES = 4  # accuracy: least number of shortest waves along a map
RESOLVED = 8  # accuracy: points of a map per wave that it resolves


@dataclass(frozen=True)
class MapBand:
    """The coarsest band if it is a measured map.

    `heights` [m] on the `grid` have the shape (ny, nx). `notes` are sentences on the preparation of the map, and
    `doubts` are warnings about the map."""

    grid: Grid
    heights: Array
    rms_slope: float
    notes: tuple[str, ...]
    doubts: tuple[Doubt, ...]


WARN_NO_WAVES_OF_THE_MAP = Kind(
    "no waves of the map",
    "the spectrum begins at {longest!M}, and only longer waves are taken from the map, which is {side!M} long and "
    "has hardly any; give the spectrum a long_wavelength of about {seam:.2g} m ({points} points of the map)",
)


def band_of_map(job: Job, shortest: float, cells: float) -> MapBand | None:
    """Return the measured map with which a job's surface starts, as a band with waves down to `shortest` [m] and this
    number of `cells` per shortest wave; None without a map. Raises InputError for a map that cannot be read."""
    part = job.surface[0]
    if not isinstance(part, Topography):
        return None
    whole = map_files.read_map(part)
    if whole.is_line:
        raise InputError(f"{part.path} is a line scan; bands take a map, or the spectrum of the scan in a table")
    size = part.copies * whole.size[0], part.copies * whole.size[1]
    nx, ny = (fast_length(cells * length / shortest) for length in size)
    grid = Grid(points=(nx, ny), size=size)
    smooth = part.model_copy(update={"short_wavelength": max(shortest, part.short_wavelength or 0.0)})
    found = prepare(smooth, grid, whole)
    doubts = [*rigid_surface.doubt_sizes(found), *rigid_surface.doubt_outliers(found)]
    if shortest > max(size) / FEWEST_WAVES:
        cells = max(length / n for length, n in zip(whole.size, whole.heights.shape[::-1], strict=True))
        seam = {"longest": shortest, "side": max(size), "points": RESOLVED, "seam": RESOLVED * cells}
        doubts.append(WARN_NO_WAVES_OF_THE_MAP("surface", seam))
    waves = np.fft.fft2(found.heights) / found.heights.size
    qy, qx = (2.0 * np.pi * np.fft.fftfreq(n, length / n) for n, length in zip((ny, nx), size[::-1], strict=True))
    slope = math.sqrt(float(np.sum(np.abs(waves) ** 2 * (qx[None, :] ** 2 + qy[:, None] ** 2))))
    return MapBand(grid, found.heights, slope, tuple(rigid_surface.describe_treatment(found)), tuple(doubts))


WIDTH = 0.75  # accuracy: width of a band [decades]; the error of friction is 4 % for 0.65 to 1
WAVES, WAVES_OF_LINE = 4, 16  # accuracy: number of longest waves along a box
CELLS = 4.0  # accuracy: cells per shortest wave
FEWEST, MOST = 2, 8  # tuning: limits on the number of surfaces per band
SAMPLE_SHARE = 0.3  # accuracy: share of the scatter of surfaces in the requested accuracy


@dataclass(frozen=True)
class Cut:
    """The bands of a job as they are solved.

    `edges` [rad/m] are the wavenumbers at the ends of the bands, shape (bands + 1,). Each band has a grid of `points`
    along x and y, whose side is `waves` times the band's longest wavelength. `samples` is the number of surfaces per
    band, 0 for as many as the accuracy needs. A `measured` map is the coarsest band, and `spectrum` is the spectrum of
    all other bands.
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
        """True if the surfaces of the bands are profiles."""
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
        """Return the rms slope of all waves in a band, or in all bands with the numbers from `first` to `band`."""
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
    """Return sentences on the chosen bands, and on the height and slope of the surface."""
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
        *(text for describe in answers("steady", "describe_bands", job) for text in describe(job, cut)),
    ]


def on_one_grid_of_all(job: Job, cut: Cut | None = None) -> Job:
    """Return a job in bands with one grid that resolves the waves of all bands, and any other job as it is. The grid is
    for the range of frequencies that the waves excite, and not for a solve. `cut` are the bands if they are known."""
    if job.bands is None:
        return job
    cut = cut or cut_bands(job)
    side = cut.wavelengths(0)[0]
    points = 2 * math.ceil(side / cut.spectrum.shortest)
    return job.model_copy(update={"grid": Grid(points=(points, points), size=(side, side)), "bands": None})


def doubts_of_bands(job: Job, cut: Cut, temperatures: Sequence[float] = ()) -> list[Doubt]:
    """Return warnings about a job in bands: about the job itself, unmeasured frequencies, and steep waves."""
    whole = on_one_grid_of_all(job, cut)
    of_map = cut.measured.doubts if cut.measured else ()
    ridges = doubt_ridges("bands.points", cut.points, job.directions)
    return [*job.doubts, *of_map, *ridges, *doubt_band(whole, temperatures), *doubt_steep_waves(cut.spectrum)]

"""The spectrum of a job's surface as one function, and moments of its waves between two wavenumbers.

An isotropic spectrum Phi(k) has, between two wavenumbers,

    <h^2> = int Phi k dk/(2 pi),    <|grad h|^2> = int Phi k^3 dk/(2 pi);

on a line of points the integrals have one factor k less. Spectra of several rough shapes are added.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .. import job as jobs
from ..errors import InputError
from ..job import Job
from ..parallel.slab import Array
from ..physics.roughness import EDGE, Roughness
from ..road import spectrum as measured_spectrum

POINTS = 4000  # accuracy: points of the midpoint rule over ln k; its error is 1e-5 over six decades


@dataclass(frozen=True)
class WaveSpectrum:
    """Phi [m^4] as a function of wavenumbers [rad/m], from the `longest` to the `shortest` wavelength [m], of a surface
    or, with `line`, of a profile along the sliding; smooth except at the `kinks` [rad/m]."""

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
        """Return `int Phi k^(1 + power) dk/(2 pi)` between two wavenumbers [rad/m]: the mean square height [m^2] for 0,
        the mean square slope for 2."""
        step = np.log(high / low) / POINTS
        k = low * np.exp(step * (np.arange(POINTS) + 0.5))
        return float(np.sum(self.phi(k) * k ** (power + 2 - self.line)) * step / (2.0 * np.pi))

    def density_of_slopes(self, k: Array, low: float, high: float) -> Array:
        """Return the mean square slope per area of the plane of wavenumbers over 4 pi^2, or per length over 2 pi on a
        line, between two wavenumbers; 0 elsewhere."""
        inside = (k >= low) & (k < high)
        known = np.where(inside, k, low)
        return np.where(inside, self.phi(known) * known**2, 0.0)

    def cut(self, count: int) -> Array:
        """Return the wavenumbers [rad/m] at the ends of `count` bands, equally spaced in the logarithm."""
        return np.geomspace(*self.ends, count + 1)

    def steep_beyond(self, slope: float) -> float:
        """Return the wavelength [m] down to which all longer waves together have this rms slope; 0 if all waves have
        less."""
        edges = self.cut(POINTS)
        middle, step = np.sqrt(edges[1:] * edges[:-1]), np.log(edges[1] / edges[0])
        squares = np.cumsum(self.phi(middle) * middle ** (4 - self.line)) * step / (2.0 * np.pi)
        place = int(np.searchsorted(squares, slope**2))
        return float(2.0 * np.pi / middle[place]) if place < POINTS else 0.0

    def without_shorter(self, wavelength: float) -> "WaveSpectrum":
        """Return the spectrum without waves shorter than this [m]."""
        return replace(self, shortest=max(wavelength, self.shortest))


def spectrum_of(job: Job, line: bool = False) -> WaveSpectrum:
    """Return the spectrum of the rough shapes of a job. Raises InputError for tables that cannot be read, and for
    spectra of a surface [m^4] if the job has profiles."""
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
        if line:
            raise InputError("surface: a spectrum in m^4 is of a surface, and bands.points are those of a line")
        found, (longest, shortest) = measured_spectrum.read_spectrum(part)
        ends = 2.0 * np.pi / longest * EDGE, 2.0 * np.pi / shortest / EDGE
        inside = lambda k: np.where((k >= ends[0]) & (k <= ends[1]), found(k), 0.0)  # noqa: E731
        return WaveSpectrum(inside, longest, shortest, line, tuple(found.q.tolist()))
    limits = part.long_wavelength, part.rolloff_wavelength, part.short_wavelength
    unit = WaveSpectrum(Roughness(part.hurst, *limits).density, limits[0], limits[2], line)
    if part.rms_slope is not None:
        factor = part.rms_slope**2 / unit.moment(*unit.ends, 2)
    elif part.rms_height is not None:
        factor = part.rms_height**2 / unit.moment(*unit.ends, 0)
    elif line:
        raise InputError("surface: psd_constant is of a surface, and bands.points are those of a line; give rms_slope")
    else:
        factor = part.psd_constant or 0.0
    return replace(unit, phi=lambda k: factor * unit.phi(k), kinks=(2.0 * np.pi / limits[1],))

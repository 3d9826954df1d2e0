"""Predictions of Persson's theory for a job with one rough surface: friction and contact area at each instant."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from .. import __version__
from .. import job as jobs
from ..bands.choice import cut_bands
from ..capabilities import Table
from ..columns import BANDS_THEORY, STEADY_THEORY, THEORY, names_of, to_csv, values_of
from ..effects.branches import relaxation_of, time_factor_of
from ..effects.effect import BY_THEORY
from ..errors import InputError
from ..files import files, outputs, tables
from ..files.tables import Wanted
from ..job import Job
from ..job.history import Span, Timeline
from ..march import scene
from ..march.curve import Request, request
from ..parallel.slab import Array, Slab
from ..physics.prony import Prony, complex_modulus
from ..physics.roughness import EDGE, Roughness
from ..theory import persson, wavy
from ..theory.persson import Memory, Rings, SlidingLeg, follow
from .info import FILE, TheorySettings, describe_theory

ONE_ROUGH = (
    "surface: the theory takes the power spectrum of one isotropic rough surface, and this job has none, or other "
    "shapes with it; with --waves lattice it takes the waves of the heights themselves, whatever they are made of"
)
OF_SPECTRA = "surface: the theory takes the spectra of rough shapes, and this job has a measured map in addition"
SETTINGS_HEAD = "# Settings of `parcontact theory` for theory.csv"
SETTINGS = (
    f"{SETTINGS_HEAD}.\n"
    """\
gamma: {gamma!r}  # corrects friction in partial contact
waves: {waves}  # continuum: the job's spectrum; lattice: the waves of the surface in its box
program: parcontact {version}
"""
)
WavesOf = Literal["continuum", "lattice"]


class PredictedInstant(NamedTuple):
    """One row of theory.csv: time [s], distance slid [m], mean pressure [Pa], friction coefficient and share in
    contact."""

    time: float
    distance: float
    pressure: float
    friction: float
    contact_area: float


def predict(job: Job, slab: Slab, gamma: float, waves: WavesOf) -> Iterator[PredictedInstant]:
    """Yield the predictions for a job, one for each instant, the initial state first. `gamma` corrects the friction in
    partial contact (`theory.persson`). The grid must be on one rank, whose `slab` is given.

    If `waves` is "continuum", the waves represent the spectrum of the job's surface without a box. If it is "lattice",
    they are the waves of the heights in the box. For stages that choose their steps, instants are the steps of the run
    in the job's directory; before a run, steps double up to one cell (`job.history`). Raises InputError for jobs
    outside the theory.
    """
    _refuse_unknown(job)
    timeline = Timeline.from_job(job).follow(_times_of_run(job))
    places = {place for span in timeline.spans for place in (span.origin, span.position(span.ends.count))}
    longest = max((math.dist(*pair) for pair in combinations(places, 2)), default=0.0)  # bounds phases of waves
    rings = _lattice(job, slab) if waves == "lattice" else _continuum(job, longest)
    memory = Memory(_on_body(job, rings), _material(job))
    if job.initial.state == "steady":
        memory.slide_for_ever(job.initial.velocity)
    return _rows(job, timeline, memory, gamma)


def _times_of_run(job: Job) -> dict[int, float]:
    """Return the times at which the steps of the job's run ended, by their numbers; none before the run."""
    path = job.output.directory / outputs.RUN.table
    if not Timeline.from_job(job).chooses or not path.is_file():
        return {}
    columns = tables.read_columns(path)
    return dict(zip(map(int, columns["step"]), columns["time"], strict=True))


class SteadyInstant(NamedTuple):
    """One row of steady_theory.csv: velocity [m/s], mean pressure [Pa], temperature [deg C], shift factor, friction
    coefficient and share in contact. The temperature is NaN if the curve is solved at the temperature of the job."""

    velocity: float
    pressure: float
    temperature: float
    shift_factor: float
    friction: float
    contact_area: float


def has_spectrum(job: Job) -> bool:
    """Return True if the theory applies to a job and does not need its heights. Such a job has one isotropic rough
    surface, or is solved in bands of a spectrum."""
    if _why_forbidden(job):
        return False
    if job.bands is not None:
        return not isinstance(job.surface[0], jobs.Topography)
    return job.grid.boundary == "periodic" and _only_rough(job) is not None


def _only_rough(job: Job) -> jobs.Rough | jobs.RoughSpectrum | None:
    """Return the one rough surface of a job that has nothing else."""
    parts = [part for part in job.surface if not isinstance(part, jobs.Flat)]
    part = parts[0] if len(parts) == 1 else None
    isotropic = getattr(part, "anisotropy", None) is None
    return part if isinstance(part, jobs.Rough | jobs.RoughSpectrum) and isotropic else None


def predict_steady(job: Job, wanted: Request, shortest: float = 0.0) -> Iterator[SteadyInstant]:
    """Yield the predicted states of a friction curve for the job's spectrum on an unbounded surface. In bands, waves
    below `shortest` [m] are left out. Raises InputError for jobs outside the theory."""
    rings = _on_body(job, _continuum(job, 0.0, shortest))
    _, kx, ky = rings.waves
    for speed, pressure, temperature in wanted.points:
        at = job if math.isnan(temperature) else job.at_temperature(temperature)
        body, (vx, vy) = _material(at), wanted.velocity(speed)
        omega = wavy.frequency(kx, ky, vx, vy)
        modulus = complex_modulus(omega, body.modulus_inf, body.moduli, body.relaxation_times)
        friction = persson.friction_coefficient(pressure, rings, vx, vy, modulus)
        area = persson.contact_area(pressure, rings, modulus)
        yield SteadyInstant(speed, pressure, temperature, time_factor_of(at.material), float(friction), float(area))


class BandInstant(NamedTuple):
    """One row of bands_theory.csv: velocity [m/s], mean pressure [Pa], temperature [deg C] (NaN for the temperature of
    the job), number of the band, its longest and shortest wavelength [m], the friction of its waves, and the share in
    contact with all waves down to the shortest wave of the band."""

    velocity: float
    pressure: float
    temperature: float
    band: float
    long_wavelength: float
    short_wavelength: float
    friction: float
    contact_area: float


def predict_bands(job: Job, wanted: Request) -> Iterator[BandInstant]:
    """Yield friction and contact area of each band of a job. The friction of a band is the friction with all waves down
    to the shortest wave of the band, minus the friction with the waves of coarser bands only."""
    cut = cut_bands(job)
    rows = dict[Wanted, list[SteadyInstant]]()
    for number in range(cut.count):
        shown = predict_steady(job, wanted, shortest=cut.wavelengths(number)[1])
        for point, row in zip(wanted.points, shown, strict=True):
            rows.setdefault(point, []).append(row)
    for point, found in rows.items():
        for number, row in enumerate(found):
            own = row.friction - (found[number - 1].friction if number else 0.0)
            yield BandInstant(*point, float(number), *cut.wavelengths(number), own, row.contact_area)


def write_steady(job: Job, wanted: Request) -> SteadyInstant:
    """Write the predictions of a friction curve to steady_theory.csv, and of its bands to bands_theory.csv. Return the
    prediction with the highest friction."""
    rows = list(predict_steady(job, wanted))
    if job.bands is not None:
        _write(job.output.directory / outputs.BANDS_THEORY, BANDS_THEORY, predict_bands(job, wanted))
    _write(job.output.directory / outputs.STEADY_THEORY, STEADY_THEORY, rows)
    return max(rows, key=lambda row: row.friction)


def draw_curve(job: Job, wanted: Request) -> Path:
    """Draw the friction curve of a job, with the theory if it needs no heights. Return the path of the picture."""
    if has_spectrum(job):
        write_steady(job, wanted)
    from . import plots

    return plots.draw_steady(job.output.directory / outputs.STEADY.table)


def foretell(job: Job, gamma: float, waves: WavesOf) -> list[str]:
    """Write theory.csv for a job on one rank, or steady_theory.csv for a friction curve. Return sentences, which
    compare the predictions with the run of the job if it exists."""
    files.refuse_pipes(job.output.directory)
    settings = TheorySettings(gamma, waves)
    if not job.history:
        return _foretell_curve(job, settings)
    path = write_theory(job, predict(job, Slab.alone(*job.grid.points), gamma, waves), settings)
    compared = describe_theory(path.parent, job.history, job.grid.dx)
    return [f"Persson's theory, {settings.sentence}: {path}", *compared]


def _foretell_curve(job: Job, settings: TheorySettings) -> list[str]:
    if settings != TheorySettings(persson.GAMMA, "continuum"):
        raise InputError("--gamma and --waves are for histories, and this job has a friction curve alone")
    _refuse_free(job)
    if why := _why_forbidden(job):
        raise InputError(why)
    if not has_spectrum(job):
        raise InputError(f"{ONE_ROUGH.partition(';')[0]}" if job.bands is None else OF_SPECTRA)
    highest = write_steady(job, request(job))
    if (table := job.output.directory / outputs.STEADY.table).is_file():
        from . import plots

        plots.draw_steady(table)
    place = Wanted(highest.velocity, highest.pressure, highest.temperature)
    return [
        f"Persson's theory, {settings.sentence}: {job.output.directory / outputs.STEADY_THEORY}",
        f"Persson's theory predicts a highest friction of {highest.friction:.3g}, at {place}",
    ]


def write_theory(job: Job, rows: Iterator[PredictedInstant], settings: TheorySettings) -> Path:
    """Write the predictions for a job to theory.csv, with theory.yaml. Return the path of the table."""
    return _write(job.output.directory / outputs.THEORY.table, THEORY, rows, settings)


def _write(path: Path, table: Table, rows: Iterable[object], settings: TheorySettings | None = None) -> Path:
    """Write a table and its settings; raises InputError for a path that cannot be written."""
    heads = tuple(",".join(names_of(one)).encode() for one in (STEADY_THEORY, BANDS_THEORY))

    def is_own(there: Path) -> bool:
        """Return True for a table of the theory: histories have settings in the same directory."""
        known = not settings or there.with_name(FILE).is_file()
        return known and there.read_bytes().startswith(b"time,distance,pressure," if settings else heads)

    lines = (map(float, values_of(table, row)) for row in rows)
    with files.writing(path):
        with files.replaced(path, is_own) as file:
            file.write(to_csv(names_of(table), lines).encode())
        if settings:
            write_settings(path.parent, settings)
    return path


def write_settings(directory: Path, settings: TheorySettings) -> None:
    """Write the settings; raises OSError."""
    with files.replaced(directory / FILE, lambda path: path.read_bytes().startswith(SETTINGS_HEAD.encode())) as file:
        file.write(SETTINGS.format(**settings._asdict(), version=__version__).encode())


def _refuse_unknown(job: Job) -> None:
    _refuse_free(job)
    for index, stage in enumerate(job.history):
        if stage.control == "approach":
            raise InputError(f"history.{index}.approach: the theory needs a pressure [Pa] or a force [N]")
        if stage.speed and not stage.slides:
            raise InputError(f"history.{index}.velocity: the theory needs a constant velocity [m/s]")


def _refuse_free(job: Job) -> None:
    if not all(job.grid.cyclic):
        raise InputError(
            "grid.boundary: Persson's theory is for periodic surfaces, and this box is free; for a sphere compare with "
            "Hertz or Lee and Radok (page settings of the manual, An indenter)"
        )


# -- the waves --------------------------------------------------------------------------------------------------------


def _lattice(job: Job, slab: Slab) -> Rings:
    setup = scene.set_up(job, slab)
    heights = setup.units.height * setup.surface.heights((0.0, 0.0), slab.empty())
    try:
        return persson.rings_of_surface(wavy.waves(heights, *job.grid.size))
    except ValueError as error:
        raise InputError(f"surface: {error}") from None


def _on_body(job: Job, rings: Rings) -> Rings:
    """Return the waves on the body of the job, which may be stiffer than a half space."""
    for response in job.asked("response"):
        ratio = response(job, 1.0).compliance_ratio(np.hypot(rings.waves.kx, rings.waves.ky))
        rings = replace(rings, stiffness=1.0 / ratio)
    return rings


def _continuum(job: Job, slide: float, shortest: float = 0.0) -> Rings:
    """Return the spectrum between the limits of the job; its longest wave is at most the longer side of the box."""
    if job.bands is not None:
        spectrum = cut_bands(job).spectrum.without_shorter(shortest)
        phi = lambda k: np.asarray(spectrum.phi(k), float)  # noqa: E731
        return persson.rings_of_spectrum(phi, *spectrum.ends, slide, spectrum.kinks, line=spectrum.line)
    part = _only_rough(job)
    if part is None:
        raise InputError(ONE_ROUGH)
    if isinstance(part, jobs.RoughSpectrum):
        return rings_of_measured(job, part, slide)
    longest = min(part.long_wavelength, job.grid.longest_side)
    k_long, k_rolloff, k_short = (2 * np.pi / x for x in (longest, part.rolloff_wavelength, part.short_wavelength))
    shape = Roughness(part.hurst, part.long_wavelength, part.rolloff_wavelength, part.short_wavelength)
    unit = _rings_on_grid(job, shape.density, (k_long, k_short), slide, (k_rolloff,))
    amplitude, kx, ky = unit.waves
    power = np.abs(amplitude) ** 2 / 2
    if part.rms_slope is not None:
        factor = part.rms_slope / math.sqrt(np.sum(power * (kx**2 + ky**2)))
    elif part.rms_height is not None:
        factor = part.rms_height / math.sqrt(np.sum(power))
    else:
        factor = math.sqrt(part.psd_constant or 0.0)
    return unit.scaled(factor)


def rings_of_measured(job: Job, part: jobs.RoughSpectrum, slide: float) -> Rings:
    """Return the waves of a measured spectrum in rings of equal wavenumber (`persson.Rings`), without waves longer than
    the box or shorter than two cells. Waves are so dense that neighbours stay in phase while the surface slides by
    `slide` [m]."""
    from ..job import measured_maps

    found, (long, short) = measured_maps.read_spectrum(part, job.grid.is_line)
    ends = 2 * np.pi / min(long, job.grid.longest_side), 2 * np.pi / max(short, 2 * job.grid.longest_cell)
    if ends[0] >= EDGE * ends[1]:
        raise InputError("surface: the theory needs waves that fit the box and the grid, the spectrum has none")
    kinks = found.q[(found.q > ends[0]) & (found.q < ends[1])].tolist()
    return _rings_on_grid(job, found, ends, slide, kinks)


def _rings_on_grid(
    job: Job, density: Callable[[Array], Array], ends: tuple[float, float], slide: float, kinks: Sequence[float]
) -> Rings:
    """Return the waves of a spectrum [m^4] between the wavenumbers `ends` [rad/m] on the grid of a job. On one row or
    column of points all waves lie along it, and the spectrum [m^3] is that of the profile."""
    spectrum = lambda k: np.asarray(density(k), float)  # noqa: E731
    rings = persson.rings_of_spectrum(spectrum, *ends, slide, kinks, line=job.grid.is_line)
    if job.grid.points[0] > 1:
        return rings
    amplitude, kx, ky = rings.waves
    return replace(rings, waves=wavy.Waves(amplitude, ky, kx))


# -- the history ------------------------------------------------------------------------------------------------------


def _why_forbidden(job: Job) -> str:
    """Return why an effect of a job forbids the theory; '' if none does."""
    forbidden = [found[BY_THEORY] for found in job.asked("forbids") if BY_THEORY in found]
    return next(filter(None, (*forbidden, *(ask(job) for ask in job.asked("why_no_theory")))), "")


def _material(job: Job) -> Prony:
    """Return the incompressible body with the stiffness of the job's half space, to which nu contributes a factor."""
    if why := _why_forbidden(job):
        raise InputError(why)
    if job.material.hardness is not None:
        raise InputError("the theory excludes counterbodies that yield: leave out material.hardness")
    series, factor = relaxation_of(job.material), 0.5 / (1.0 - job.material.poisson)
    return Prony(factor * series.modulus_inf, factor * series.moduli, series.relaxation_times)


def _rows(job: Job, timeline: Timeline, memory: Memory, gamma: float) -> Iterator[PredictedInstant]:
    pressure = job.initial.pressure or 0.0
    first = SlidingLeg(job.initial.velocity, 0.0, np.zeros(1), np.array([pressure]))
    touched = job.initial.state == "steady"
    legs = [first]
    for span in timeline.spans:
        leg = _leg(job, span)
        touched = touched or bool(np.any(leg.pressures > 0.0))
        legs.append(leg if touched else leg._replace(duration=0.0))  # a body without contact has no memory
    start, slid = [0.0, *(span.start for span in timeline.spans)], 0.0
    for leg, time, found in zip(legs, start, follow(memory, legs, gamma), strict=True):
        distances = slid + math.hypot(*leg.velocity) * leg.instants
        slid = float(distances[-1])
        friction = found.friction(leg.pressures)
        yield from map(PredictedInstant, time + leg.instants, distances, leg.pressures, friction, found.contact_area)


def _leg(job: Job, span: Span) -> SlidingLeg:
    """Return a stage as a leg: the jump of its load, if any, and its steps."""
    fractions = np.array([*([0.0] if span.jumps else []), *(span.ends[index] for index in range(1, span.count + 1))])
    area = job.grid.lx * job.grid.ly if span.stage.control == "force" else 1.0
    pressures = np.array([span.stage.load.at(each, each * span.stage.seconds) for each in fractions]) / area
    return SlidingLeg(span.stage.velocity, span.stage.seconds, fractions * span.stage.seconds, pressures)

"""From a job to what runs: the only place that decides which effects exist.

Each effect is one object handed to the march; an effect that a job does not call for is never made.
"""

from dataclasses import dataclass

import numpy as np

from . import job as jobs
from .clock import Step, steps
from .job import Job
from .parallel.fft import FFT, Spectrum
from .parallel.slab import Array, Slab
from .physics import halfspace, heightfile
from .physics.energy import ElasticEnergy, ZenerEnergy
from .physics.ledger import Ledger
from .physics.material import Elastic, Heights, Zener
from .physics.roughness import Moments, Roughness, moments
from .physics.shapes import Round, Shape
from .physics.sliding import AnyFraction, Path, WholeCells
from .physics.surface import Surface, single_wave
from .physics.units import Units
from .solve.contact import ContactSolver
from .theory.viscoelastic import Prony, normal_form, zener_to_prony

WHOLE = 1e-6  # a displacement this close to whole cells, in cells, is one of whole cells


@dataclass
class Frame:
    """What every calculation on a job shares: who owns which rows, the surface, the units, the body's relaxation.

    `height` [m] is that of the surface from its lowest to its highest point (a cell's length if it is flat); `size` and
    `prony` are the box and the relaxation function in the run's units (and seconds).
    """

    job: Job
    slab: Slab
    fft: FFT
    surface: Surface
    roughness: Moments | None
    height: float
    units: Units
    prony: Prony

    @property
    def size(self) -> tuple[float, float]:
        return self.job.grid.lx / self.units.length, self.job.grid.ly / self.units.length

    @property
    def dtype(self) -> type[np.floating]:
        return np.float32 if self.job.numerics.precision == "single" else np.float64


@dataclass
class Scene:
    """Everything a march needs."""

    frame: Frame
    path: Path
    material: Elastic | Zener
    solver: ContactSolver
    ledger: Ledger
    energy: ElasticEnergy | ZenerEnergy | None
    lasts: bool

    @property
    def job(self) -> Job:
        return self.frame.job

    @property
    def slab(self) -> Slab:
        return self.frame.slab

    @property
    def units(self) -> Units:
        return self.frame.units


def frame(job: Job, slab: Slab) -> Frame:
    """The surface of a job and what it is measured in; collective. Raises InputError for files that do not fit."""
    dtype = np.float32 if job.numerics.precision == "single" else np.float64
    fft = FFT(slab, dtype=dtype)
    surface = _surface(job, fft)
    roughness = moments(surface.waves, fft, job.grid.size) if surface.waves is not None else None
    prony = relaxation_of(job)
    height = _height(surface)
    units = Units.near(height, job.grid.lx, prony.modulus_inf + float(prony.moduli.sum()))
    surface.rescale(units.height)
    scaled = Prony(prony.modulus_inf / units.modulus, prony.moduli / units.modulus, prony.relaxation_times)
    return Frame(job, slab, fft, surface, roughness, height or job.grid.dx, units, scaled)


def build(job: Job, slab: Slab) -> Scene:
    """Make a job's scene on the ranks of `slab`; collective. Raises InputError for surface files that do not fit."""
    base = frame(job, slab)
    timeline = tuple(steps(job.history, job.grid, pressure=job.initial.pressure))
    way = WholeCells if _by_whole_cells(job, timeline) else AnyFraction
    path: Path = way(base.surface, base.dtype)
    material = _material(base)
    solver = ContactSolver(
        slab,
        _operator(base),
        _preconditioner(base),
        base.height / base.units.height,
        job.numerics.tolerance,
        job.numerics.max_iterations,
        base.dtype,
    )
    energy = _energy(job, solver, material) if job.output.energy else None
    lasts = any(not step.jump for step in timeline)
    return Scene(base, path, material, solver, Ledger(slab, base.surface, base.units), energy, lasts)


def relaxation_of(job: Job) -> Prony:
    """The relaxation function of a job's material [Pa, s]; one modulus and no terms if it is elastic."""
    material = job.material
    if isinstance(material, jobs.Elastic):
        return Prony(material.shear_modulus, np.zeros(0), np.zeros(0))
    zener = [b for b in material.branches if isinstance(b, jobs.ZenerBranch)]
    plain = [b for b in material.branches if isinstance(b, jobs.PronyBranch)]
    series, kelvin, viscosity = ([getattr(b, name) for b in zener] for name in ("G0", "G1", "eta1"))
    prony = zener_to_prony(series, kelvin, viscosity, material.modulus_inf)
    moduli, times = [b.modulus for b in plain], [b.relaxation_time for b in plain]
    return normal_form(prony.modulus_inf, [*prony.moduli, *moduli], [*prony.relaxation_times, *times])


def facts(built: Scene) -> list[str]:
    """What a user should know about the surface: its spectral moments and what follows from them."""
    found = built.frame.roughness
    if found is None:
        return []
    return [
        f"surface: rms height {found.rms_height:.4g} m, rms slope {found.rms_slope:.4g}, Nayak's parameter "
        f"{found.nayak:.3g}; m0 {found.m0:.4g} m^2, m2 {found.m2:.4g}, m4 {found.m4:.4g} m^-2"
    ]


# -- parts ------------------------------------------------------------------------------------------------------------


def _surface(job: Job, fft: FFT) -> Surface:
    grid, slab = job.grid, fft.slab
    waves: Spectrum | None = None
    shapes: list[Shape] = []
    for part in job.surface:
        if isinstance(part, jobs.Sphere | jobs.Cylinder):
            centre = part.center or (grid.lx / 2, grid.ly / 2)
            along = (1.0, 1.0)
            if isinstance(part, jobs.Cylinder):
                along = (1.0, 0.0) if part.axis == "y" else (0.0, 1.0)
            shapes.append(Round(part.radius, centre, along, part.profile == "exact"))
        elif not isinstance(part, jobs.Flat):
            added = _waves(part, fft, grid.size)
            waves = added if waves is None else waves + added
    if waves is not None:
        waves = waves.astype(fft.complex, copy=False)
    return Surface(
        slab, fft, grid.size, waves, shapes, grid.boundary == "periodic", job.numerics.slope == "finite-difference"
    )


def _waves(part: jobs.Rough | jobs.Wave | jobs.HeightFile, fft: FFT, size: tuple[float, float]) -> Spectrum:
    if isinstance(part, jobs.Wave):
        return single_wave(fft, part.amplitude, part.waves, part.phase)
    if isinstance(part, jobs.HeightFile):
        rows = heightfile.read(part.path, part.dataset, fft.slab)
        field = fft.slab.empty(fft.dtype)
        np.multiply(rows, part.scale, out=field, casting="same_kind")
        return fft.forward(field).copy()
    return Roughness(
        part.hurst,
        part.long_wavelength,
        part.rolloff_wavelength,
        part.short_wavelength,
        part.seed,
        part.amplitudes == "random",
        part.rms_slope,
        part.rms_height,
        part.psd_constant,
    ).spectrum(fft, size)


def _height(surface: Surface) -> float:
    """From the lowest to the highest point [m]: Sz of the standards on roughness."""
    heights = surface.heights((0.0, 0.0), surface.slab.empty(surface.fft.dtype))
    return sum(surface.slab.reduce((), [float(heights.max(initial=-np.inf)), float((-heights).max(initial=-np.inf))]))


def _material(base: Frame) -> Elastic | Zener:
    if base.prony.moduli.size == 0:
        return Elastic(base.slab, base.prony.modulus_inf)
    return Zener(base.slab, base.prony, base.job.numerics.integrator, base.dtype)


def _operator(base: Frame) -> halfspace.Convolution:
    poisson = base.job.material.poisson
    if base.job.grid.boundary == "free":
        return halfspace.free(base.slab, base.size, poisson, base.dtype)
    return halfspace.periodic(base.fft, base.size, poisson, base.job.numerics.kernel)


def _preconditioner(base: Frame) -> halfspace.Convolution | halfspace.Narrowed:
    poisson = base.job.material.poisson
    if base.job.numerics.precision == "mixed":
        return halfspace.Narrowed(halfspace.inverse(FFT(base.slab, dtype=np.float32), base.size, poisson))
    return halfspace.inverse(base.fft, base.size, poisson)


def _energy(job: Job, solver: ContactSolver, material: Elastic | Zener) -> ElasticEnergy | ZenerEnergy:
    slab = solver.slab
    if isinstance(material, Elastic):
        return ElasticEnergy(slab)
    if job.grid.boundary == "periodic" and job.numerics.kernel == "spectral" and job.numerics.precision == "double":
        inverse = solver.preconditioner
        return ZenerEnergy(slab, material, lambda p, dt, du: inverse.apply(du, solver.w))
    memory = Zener(slab, material.prony, material.integrator)

    def creep(p: Array, dt: float, du: Array) -> Array:
        """What `A^-1 u` has grown by: it answers to the pressure at each point as u does to `A p`."""
        memory.begin(dt, Heights(memory.u))
        memory.commit(p, Heights(memory.u))
        return memory.increment

    return ZenerEnergy(slab, material, creep, memory)


def _by_whole_cells(job: Job, timeline: tuple[Step, ...]) -> bool:
    """Whether the surface stands, or slides by whole cells along x on a periodic box."""
    positions = {step.position for step in timeline}
    if positions <= {(0.0, 0.0)}:
        return True
    if job.grid.boundary == "free":
        return False
    cells = np.array([x for x, _ in positions]) / job.grid.dx
    return all(y == 0.0 for _, y in positions) and bool(np.all(np.abs(cells - np.round(cells)) < WHOLE))

"""From a job to what steps are made of: bodies, solver, energies, ledger and followers are made here and nowhere else.

What is made follows from the job alone, as `effects/decisions.py` decides; what a job does not call for is never made.
Steady sliding takes the setup from here and brings a solver of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ..effects import decisions, relaxation
from ..effects.effect import Decision, Effect, effects_that_follow, values_of
from ..effects.folded_branches import describe_folded_branches, fold_branches_of
from ..effects.interface import interface_of
from ..effects.relaxation import relaxation_of
from ..history.chosen import describe_steps
from ..job import Job, extension
from ..parallel.fft import FFT
from ..parallel.slab import Slab
from ..physics.body import ElasticBody, ZenerBody
from ..physics.energy import AppliedInverse, ElasticEnergy, ElasticPressure, ZenerEnergy
from ..physics.entries import Remembers
from ..physics.folding import FoldedBranches
from ..physics.halfspace import HalfSpace
from ..physics.ledger import Ledger
from ..physics.motion import AnyFraction, Motion, PartCells, WholeCells
from ..physics.prony import Prony
from ..physics.roughness import Moments, moments
from ..physics.surface import Surface
from ..physics.units import Units
from ..solve.constraint import Constraint, NonNegative
from ..solve.contact import ContactSolver
from ..solve.preconditioner.extension import grids_for
from ..solve.problem import Operators
from ..solve.workspace import Workspace
from .rigid_surface import Heights, heights_of, make_surface, shortest_measured


@dataclass
class Setup:
    """What every calculation on a job shares: who owns which rows, the surface, the units, the body's relaxation.

    `heights` [m] are what the surface reaches, `height` is that from its lowest to its highest point (the shorter side
    of a cell if it is flat); `shortest` [m] is the shortest wave of what is measured of it, None where nothing is;
    `size` and `prony` are the box and the relaxation function in the run's units (and seconds); `told` says, on root,
    what was done to measured maps.
    """

    job: Job
    slab: Slab
    fft: FFT
    surface: Surface
    roughness: Moments | None
    shortest: float | None
    heights: Heights
    units: Units
    prony: Prony
    told: list[str]

    @property
    def height(self) -> float:
        return self.heights.span or min(self.job.grid.dx, self.job.grid.dy)

    @property
    def size(self) -> tuple[float, float]:
        return self.job.grid.lx / self.units.length, self.job.grid.ly / self.units.length

    @property
    def half_space(self) -> HalfSpace:
        """The body's, of shear modulus 1, in the run's units."""
        return HalfSpace(
            self.size, self.job.material.poisson, self.job.numerics.kernel, self.job.grid.boundary == "free"
        )

    def in_units(self, velocity: tuple[float, float]) -> tuple[float, float]:
        """A velocity [m/s] in the run's units of length per second."""
        return velocity[0] / self.units.length, velocity[1] / self.units.length

    def ledger(self) -> Ledger:
        """A new one, with the shear of the interface if the job has one."""
        return Ledger(self.slab, self.surface, self.units, interface_of(self.job))


@dataclass
class Scene:
    """Everything a march needs."""

    setup: Setup
    motion: Motion
    folded: FoldedBranches
    material: ElasticBody | ZenerBody
    solver: ContactSolver
    operators: Operators
    ledger: Ledger
    energy: ElasticEnergy | ZenerEnergy | None
    lasts: bool
    keeps_further: bool = False
    followers: dict[str, Effect] = field(default_factory=dict)

    @property
    def parts(self) -> dict[str, Remembers]:
        """What has a memory, by the names that checkpoints know them by."""
        parts: dict[str, Remembers] = {"material": self.material}
        if self.energy is not None:
            parts["energy"] = self.energy
            if isinstance(self.energy, ZenerEnergy) and isinstance(self.energy.inverse, ElasticPressure):
                parts["memory"] = self.energy.inverse
        return parts | self.followers

    @property
    def job(self) -> Job:
        return self.setup.job

    @property
    def slab(self) -> Slab:
        return self.setup.slab

    @property
    def units(self) -> Units:
        return self.setup.units

    def constraint(self, alpha: float) -> Constraint:
        """Which pressures p are admissible in a step with the modulus alpha: `alpha p` is the pressure."""
        return NonNegative()


def effects(job: Job) -> list[Decision]:
    """Every effect that there is, on or off, and why; from the job alone."""
    further = [effect.decide for effect in extension.find_effects().values()]
    return [decide(job) for decide in (*decisions.TABLE, *further)]


def set_up(job: Job, slab: Slab) -> Setup:
    """The surface of a job and what it is measured in; collective. Raises InputError for files that do not fit."""
    fft = FFT(slab)
    surface, told = make_surface(job, fft)
    roughness = moments(surface.waves, fft, job.grid.size) if surface.waves is not None else None
    shortest = shortest_measured(job, surface)
    prony = relaxation_of(job)
    heights = heights_of(surface)
    units = Units.near(heights.span, job.grid.lx, prony.modulus_inf + float(prony.moduli.sum()))
    surface.rescale(units.height)
    scaled = Prony(prony.modulus_inf / units.modulus, prony.moduli / units.modulus, prony.relaxation_times)
    return Setup(job, slab, fft, surface, roughness, shortest, heights, units, scaled, told)


def build(job: Job, slab: Slab, until: float = 0.0, base: Setup | None = None) -> Scene:
    """Make a job's scene on the ranks of `slab`, to be marched to the end of its history or, if later, to `until` [s].

    Its setup is `base`, if it has one. Collective. Raises InputError for surface files that do not fit.
    """
    base = set_up(job, slab) if base is None else base
    motion = _motion(base)
    branches = slab.agree(fold_branches_of(job, until))
    material = _material(base, branches)
    solver, operators = _solver(base, job.numerics.tolerance)
    energy = _energy(base, solver, operators, material) if decisions.energies(job).on else None
    kept = decisions.lasting(job).on, decisions.further_starts(job).on
    scene = Scene(base, motion, branches, material, solver, operators, base.ledger(), energy, *kept)
    scene.followers = {name: effect(scene) for name, effect in effects_that_follow(job).items()}
    values_of(scene.followers)  # refuses those that do not fit, before anything is written
    return scene


def solver_on(base: Setup, slab: Slab, tolerance: float) -> tuple[ContactSolver, Operators]:
    """A solver and the operators of the body of a setup on another grid, for a start or a retry; collective.

    Their transforms are not measured: which are the fastest may turn out otherwise after a restart, and others give
    other last digits.
    """
    return _solver(replace(base, slab=slab, fft=FFT(slab, measured=False)), tolerance)


def solver_in_double(base: Setup) -> Callable[[], tuple[ContactSolver, Operators]] | None:
    """What makes a solver with an operator in double precision, for a retry; None where that of the scene is."""
    if not decisions.single_operator(base.job).on:
        return None
    numerics = base.job.numerics.model_copy(update={"precision": "double"})
    double = replace(base, job=base.job.model_copy(update={"numerics": numerics}))
    return partial(solver_on, double, base.slab, numerics.tolerance)


def facts(built: Scene) -> list[str]:
    """What a user should know: the surface's spectral moments and what follows from them, and the branches folded."""
    found = built.setup.roughness
    told = [*built.setup.told, *describe_folded_branches(built.folded, relaxation_of(built.job))]
    if steps := describe_steps(built.job):
        told.append(f"time steps that are chosen: {steps}")
    if found is None:
        return told
    return [
        *told,
        f"surface: rms height {found.rms_height:.4g} m, rms slope {found.rms_slope:.4g}, Nayak's parameter "
        f"{found.nayak:.3g}; m0 {found.m0:.4g} m^2, m2 {found.m2:.4g}, m4 {found.m4:.4g} m^-2",
    ]


# -- parts ------------------------------------------------------------------------------------------------------------


def _motion(base: Setup) -> Motion:
    """How the surface moves."""
    if not decisions.part_cells(base.job).on:
        return WholeCells(base.surface)
    if decisions.along_x(base.job):
        return PartCells(base.surface)
    return AnyFraction(base.surface)


def _material(base: Setup, branches: FoldedBranches) -> ElasticBody | ZenerBody:
    if not relaxation.decide(base.job).on:
        return ElasticBody(base.slab, base.prony.modulus_inf)
    integrator = base.job.numerics.integrator
    return ZenerBody(base.slab, base.prony, integrator, branches.memoryless, branches.frozen)


def _solver(base: Setup, tolerance: float) -> tuple[ContactSolver, Operators]:
    """The contact solver with its workspace, and the operators of the body."""
    height, limit = base.height / base.units.height, base.job.numerics.max_iterations
    operators = _operators(base)
    grids = grids_for(base.job.grid.dx, base.job.grid.dy)
    kept = np.float32 if decisions.single_operator(base.job).on else np.float64
    return ContactSolver(Workspace(base.slab, tolerance, kept), height, tolerance, limit, grids), operators


def _operators(base: Setup) -> Operators:
    """The operator of the half space, and its preconditioner."""
    body = base.half_space
    if not decisions.mixed_precision(base.job).on:
        return Operators(body.operator(base.fft), body.inverse(base.fft))
    single = FFT(base.slab, dtype=np.float32, measured=base.fft.measured, lender=base.fft)
    own = single if decisions.single_operator(base.job).on else base.fft
    return Operators(body.operator(own), body.inverse(single))


def _energy(
    base: Setup, solver: ContactSolver, operators: Operators, material: ElasticBody | ZenerBody
) -> ElasticEnergy | ZenerEnergy:
    slab, grid, units = base.slab, base.job.grid, base.units
    unit = units.pressure * units.height * grid.dx * grid.dy
    if isinstance(material, ElasticBody):
        return ElasticEnergy(slab, unit)
    if decisions.energy_memory(base.job).on:
        return ZenerEnergy(slab, material, ElasticPressure(slab, material.prony, material.integrator), unit)
    inverse = AppliedInverse(operators.preconditioner, lambda: solver.workspace.pressure)
    return ZenerEnergy(slab, material, inverse, unit)

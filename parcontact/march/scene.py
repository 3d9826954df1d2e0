"""The objects of a calculation, made from a job as `choices.py` decides.

A setup consists of the rigid surface, the body and the units, and is used by steady sliding, which has its own solver.
A scene is used by steps in time. It consists of a setup, the solver, energies, measures and effects.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..contact.preconditioner import grids_for
from ..contact.problem import Box, Operators, Workspace
from ..contact.solver import ContactSolver
from ..contact.starts import LARGER_CELLS, SolverOnTiles
from ..effects import effect
from ..effects.branches import FoldedBranches, describe_folded_branches
from ..effects.effect import TOLERANCES, ContactLaw, Effect, Memories
from ..errors import InputError
from ..job import Grid, Job
from ..job.history import describe_steps
from ..job.listing import is_ours
from ..parallel.fft import FFT
from ..parallel.slab import Array, Slab
from ..physics.body import Body, ElasticBody, ZenerBody, states_errors
from ..physics.convolution import SIDE, TileConvolution, TileOperator, Tiles
from ..physics.energy import AppliedInverse, ElasticEnergy, ElasticPressure, Probe, ZenerEnergy
from ..physics.halfspace import HalfSpace
from ..physics.prony import Prony
from ..physics.records import Units
from ..physics.roughness import Moments, moments
from ..physics.surface import PARTS, AlongX, AnyFraction, Motion, Surface, Vector
from ..printed import quantity
from .choices import Choices, choices
from .controller import Controller, EmbeddedPair
from .rigid_surface import HeightRange, Remarks, heights_of, make_surface, outline_surface, shortest_measured
from .time_error import RunProperties, properties_of


@dataclass
class Setup:
    """The parts that every calculation on a job shares: choices, slab, surface, units and body.

    `heights` is the range of heights of the surface. `height` [m] is their span, or the shorter side of a cell if the
    surface is flat. `shortest` [m] is the shortest wave of a measured map, None without a map. `size` is the size of
    the box in the run's units, and `prony` is the relaxation function in the run's units and seconds. `remarks` are
    notes on measured maps and warnings about these maps. `factors` is None without softening. With softening it is a
    function that returns the factors of the moduli for an array of wavenumbers (`physics.halfspace`).
    """

    choices: Choices
    slab: Slab
    fft: FFT
    surface: Surface
    roughness: Moments | None
    shortest: float | None
    heights: HeightRange
    units: Units
    remarks: Remarks
    factors: Callable[[Array], tuple[Array, Array]] | None = None

    @property
    def job(self) -> Job:
        return self.choices.job

    @property
    def grid(self) -> Grid:
        return self.choices.grid

    @property
    def height(self) -> float:
        return self.heights.span or min(self.grid.dx, self.grid.dy)

    @property
    def size(self) -> tuple[float, float]:
        return self.grid.lx / self.units.length, self.grid.ly / self.units.length

    @cached_property
    def prony(self) -> Prony:
        series, unit = self.choices.prony, self.units.modulus
        return Prony(series.modulus_inf / unit, series.moduli / unit, series.relaxation_times)

    @property
    def half_space(self) -> HalfSpace:
        """The elastic half space of the body with shear modulus 1, in the run's units."""
        poisson, kernel = self.job.material.poisson, self.choices.numerics.kernel
        other = next((response(self.job, self.units.length) for response in self.job.asked("response")), None)
        free, cyclic = self.choices.isolated.on, self.grid.cyclic[0]
        return HalfSpace(self.size, poisson, kernel, free, other, cyclic, self.factors)

    def in_units(self, velocity: tuple[float, float]) -> tuple[float, float]:
        """Return a velocity [m/s] in the run's unit of length per second."""
        return velocity[0] / self.units.length, velocity[1] / self.units.length

    def probe(self) -> Probe:
        """Return a new probe, which measures contacts. It includes the shear that effects add, and the hardness if the
        job states one."""
        return Probe(self.slab, self.surface, self.units, self.choices.shears, self.choices.hardness)


@dataclass
class Scene:
    """All objects of a calculation in time. `law` is the contact law of an effect, or None for the law of the scene's
    bounds on the pressure."""

    setup: Setup
    motion: Motion
    folded: FoldedBranches
    material: Body
    solver: ContactSolver
    operators: Operators
    probe: Probe
    energy: ElasticEnergy | ZenerEnergy | None
    law: ContactLaw[Any] | None = None
    effects: dict[str, Effect[Any]] = field(default_factory=dict)
    time_factor: float = 1.0
    further_bodies: list[ZenerBody] = field(default_factory=list)

    @property
    def choices(self) -> Choices:
        return self.setup.choices

    @property
    def job(self) -> Job:
        return self.setup.job

    @property
    def slab(self) -> Slab:
        return self.setup.slab

    @property
    def units(self) -> Units:
        return self.setup.units

    def relax(self, memories: Memories) -> None:
        """Set all relaxation times to their values at the job's temperature, multiplied by the factors of the effects.
        The factors follow from the `memories` of the effects. Raises RunError."""
        factor = math.prod(effect.time_factor(memories[name]) for name, effect in self.effects.items())
        if factor == self.time_factor:
            return
        self.time_factor = factor
        of_energy = () if self.energy is None else self.energy.bodies
        for body in (self.material.branched, *of_energy, *self.further_bodies):
            if body is not None:
                body.set_time_factor(factor)
        if self.material.branched is not None:
            self.properties = replace(self.properties, prony=self.material.branched.prony)
        if shears := self.choices.shears:
            self.probe = replace(self.probe, shears=[shear.shifted(factor) for shear in shears])

    def body_for_shear(self, slab: Slab) -> tuple[ZenerBody, ElasticEnergy | ZenerEnergy | None]:
        """Return a second body, for displacements along the surface, on the given slab, and the energies of this body.
        The energies are None unless the job asks for energies. The second body relaxes like the scene's body."""
        chosen, folded, prony = self.choices, self.folded, self.setup.prony
        integrator = chosen.numerics.integrator
        body = ZenerBody(slab, prony, integrator, folded.memoryless, folded.frozen)
        self.further_bodies.append(body)
        if self.energy is None:
            return body, None
        if not chosen.viscoelasticity.on:
            return body, ElasticEnergy(slab, self.energy.unit)
        inverse = ElasticPressure(slab, prony, integrator)
        self.further_bodies.extend(inverse.bodies)
        return body, ZenerEnergy(slab, body, inverse, self.energy.unit)

    @cached_property
    def controller(self) -> Controller:
        """Controller, which chooses the tolerance of each solve and the length of each step."""
        choices = self.choices
        energies, exact = self.energy is not None, bool(choices.forbidden(TOLERANCES))
        return Controller(self.job, choices.timeline, self.material, energies, exact)

    @cached_property
    def properties(self) -> RunProperties:
        """Properties of the run for the error budget, with the present relaxation of the body."""
        branches = self.material.branched
        prony = None if branches is None else branches.prony
        return properties_of(self.job, self.setup.shortest, self.folded.bound, prony)

    @cached_property
    def integrators(self) -> EmbeddedPair | None:
        """Comparison of the integrators for a body with branches; None for another body."""
        branches = self.material.branched
        return None if branches is None else EmbeddedPair(self.slab, branches, self.choices.grid.dx / self.units.length)

    @cached_property
    def in_double(self) -> tuple[ContactSolver, Operators]:
        """A solver and operators in double precision. They are made at the first use, which is collective."""
        return solver_on(self.setup, self.slab, self.choices.numerics.tolerance, np.float64)

    def heights(self, position: Vector) -> Array:
        """Return the heights of the rigid surface at a position as a new array: this rank's rows, in the run's
        units."""
        base, offset = self.motion.at(position).parts
        return np.roll(base, offset, axis=1)

    def gap(self, displacement: Array, position: Vector, approach: float) -> Array:
        """Return the gap [m] on this rank's rows for the surface at a position [m]. The displacement and the approach
        are in the run's units."""
        return (displacement - self.heights(position) - approach) * self.units.height

    def constraint(self, alpha: float, most: float = math.inf) -> Box:
        """Return the bounds of p in a step of modulus alpha, in which the pressure is `alpha p`. An upper bound
        on p that is not below `most` is left out, as no p can reach such a bound."""
        return effect.constraint_of(self.job, alpha * self.units.pressure, most)


def set_up(job: Job, slab: Slab, until: float = 0.0, measured: bool = True) -> Setup:
    """Return the setup of a job for a march to the end of its history or, if later, to `until` [s]; collective. Raises
    InputError for files that do not fit. If `measured` is True, the fastest transforms are chosen by trials
    (`parallel.fft.FFT`)."""
    chosen, fft = choices(job, until), FFT(slab, measured=measured)
    surface, remarks = make_surface(job, fft)
    roughness = moments(surface.waves, fft, job.grid.size) if surface.waves is not None else None
    shortest = shortest_measured(job, surface)
    heights = heights_of(surface)
    units = Units.near(heights.span, job.grid.lx, chosen.prony.modulus_inf + float(chosen.prony.moduli.sum()))
    surface.rescale(units.height)
    return Setup(chosen, slab, fft, surface, roughness, shortest, heights, units, remarks)


def outline(job: Job, slab: Slab) -> Setup:
    """Return the setup of a job for planning. Its slab only counts memory, its surface has waves without values, and
    all units are 1."""
    slab.tally.purpose = "transforms"
    chosen, fft = choices(job), FFT(slab)
    slab.tally.purpose = "surface spectrum"
    surface, flat, units = outline_surface(job, fft), HeightRange(0.0, 0.0, 0.0), Units(1.0, 1.0, 1.0)
    return Setup(chosen, slab, fft, surface, None, None, flat, units, Remarks([], []))


def build(job: Job, slab: Slab, until: float = 0.0) -> Scene:
    """Return the scene of a job on the ranks of `slab`, by `set_up` and `build_on`; collective."""
    return build_on(set_up(job, slab, until))


def build_on(setup: Setup) -> Scene:
    """Return the scene of a setup; collective."""
    chosen, tally, folded = setup.choices, setup.slab.tally, setup.slab.agree(setup.choices.folded)
    solver, operators = _solver(setup, chosen.numerics.tolerance, chosen.operator_type)
    inverse = AppliedInverse(operators.preconditioner, lambda: solver.workspace.other_displacement)
    tally.purpose = "heights"
    material, energy = _body_and_energy(setup, folded, inverse)
    if chosen.timeline.chooses and not states_errors(material):
        raise InputError(
            "the body states no error by its steps, by which stages could choose them: give time_step or "
            "cells_per_step in each stage with a duration"
        )
    scene = Scene(setup, _motion(setup), folded, material, solver, operators, setup.probe(), energy)
    for name, make in chosen.effects.items():
        if setup.slab.only_counts and not is_ours(name):
            continue  # it may look at heights
        tally.purpose = name
        scene.effects[name] = make(scene)
        scene.law = scene.law or scene.effects[name].law()
    return scene


def solver_on(
    setup: Setup, slab: Slab, tolerance: float, operator_type: type[np.floating] | None = None
) -> tuple[ContactSolver, Operators]:
    """Return a solver and the operators of a setup's body on another grid, for a start or a retry; collective. The
    transforms on this grid are planned without measurement, so that a restarted run has the same rounding."""
    on_slab = replace(setup, slab=slab, fft=FFT(slab, measured=False))
    return _solver(on_slab, tolerance, operator_type or setup.choices.operator_type)


def solver_on_tiles(setup: Setup) -> SolverOnTiles | None:
    """Return a function that makes a solver and operators on the tiles that cover the contact, on one rank. Return None
    if the body cannot be solved on tiles of this grid."""
    body, tally, limit = setup.half_space, setup.slab.tally, setup.choices.numerics.max_iterations
    height = setup.height / setup.units.height

    def on(tiles: Tiles, tolerance: float) -> tuple[ContactSolver, TileOperator, TileConvolution]:
        workspace = Workspace(Slab.alone(SIDE, tiles.count * SIDE, tally), tolerance)
        solver = ContactSolver(workspace, height, tolerance, limit, LARGER_CELLS, body.free)
        return solver, *body.on_tiles(tiles, tally)

    return on if body.works_on_tiles(setup.slab.nx, setup.slab.ny) else None


def describe_scene(scene: Scene) -> Iterator[str]:
    """Yield sentences on prepared maps, folded branches, chosen steps and the moments of the surface."""
    yield from scene.setup.remarks.notes
    yield from describe_folded_branches(scene.folded, scene.choices.prony, bool(scene.job.directions))
    yield from scene.job.facts
    if steps := describe_steps(scene.job):
        yield f"chosen time steps: {steps}"
    yield from describe_roughness(scene.setup)


def describe_roughness(setup: Setup) -> Iterator[str]:
    """Yield a sentence on the moments of a surface with waves."""
    if (found := setup.roughness) and found.m0:
        yield (
            f"surface: rms height {quantity(found.rms_height, 'm', 4)}, rms slope {found.rms_slope:.4g}, Nayak's "
            f"parameter {found.nayak:.3g} (moments m0 {found.m0:.4g} m^2, m2 {found.m2:.4g}, m4 {found.m4:.4g} m^-2)"
        )


# -- parts ------------------------------------------------------------------------------------------------------------


def _motion(setup: Setup) -> Motion:
    if not setup.choices.part_cells.on:
        return AlongX(setup.surface)
    return AlongX(setup.surface, PARTS) if setup.choices.slides_along_x else AnyFraction(setup.surface)


def _solver(setup: Setup, tolerance: float, operator_type: type[np.floating]) -> tuple[ContactSolver, Operators]:
    """Make the contact solver with its workspace, and the operators of the body."""
    height, limit = setup.height / setup.units.height, setup.choices.numerics.max_iterations
    setup.slab.tally.purpose = "operators"
    operators = _operators(setup, operator_type)
    body, slab = setup.half_space, setup.slab
    grids = grids_for(body.size[0] / slab.nx, body.size[1] / slab.ny, body.response.reach(body.size))
    setup.slab.tally.purpose = "solver"
    workspace = Workspace(setup.slab, tolerance, operator_type)
    further = body.response.preconditioner(body.size)
    return ContactSolver(workspace, height, tolerance, limit, grids, body.free, further), operators


def _operators(setup: Setup, operator_type: type[np.floating]) -> Operators:
    """Return the operator of the half space and its preconditioner."""
    body = setup.half_space
    if not setup.choices.mixed_precision.on:
        return Operators(body.operator(setup.fft), body.inverse(setup.fft))
    single = FFT(setup.slab, dtype=np.float32, measured=setup.fft.measured, sharing=setup.fft)
    return Operators(body.operator(single if operator_type == np.float32 else setup.fft), body.inverse(single))


def _body_and_energy(
    setup: Setup, folded: FoldedBranches, inverse: AppliedInverse
) -> tuple[Body, ElasticEnergy | ZenerEnergy | None]:
    """Make the body, and its energies if the job asks for them; `inverse` is used if it is the inverse of
    the operator."""
    chosen, slab, integrator = setup.choices, setup.slab, setup.choices.numerics.integrator
    unit = setup.units.pressure * setup.units.height * setup.grid.dx * setup.grid.dy
    if not chosen.viscoelasticity.on:
        body = ElasticBody(slab, setup.prony.modulus_inf, chosen.slides_along_x)
        return body, ElasticEnergy(slab, unit) if chosen.energies.on else None
    rubber = ZenerBody(slab, setup.prony, integrator, folded.memoryless, folded.frozen)
    if not chosen.energies.on:
        return rubber, None
    memory = ElasticPressure(slab, setup.prony, integrator) if chosen.energy_memory.on else None
    return rubber, ZenerEnergy(slab, rubber, memory or inverse, unit)

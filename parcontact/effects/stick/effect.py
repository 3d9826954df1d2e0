"""Stick and slip of the contact area: the body is sheared before the surface slides, and while parts of the contact
slide.

The rigid surface moves by D along itself. Tractions t move the points of the body by u. The tractions are bounded,

    |t| <= f,    f = mu p (Coulomb) or a shear strength at all points in contact.

A shear strength that depends on the velocity is the same at all points in a step. It is taken at the velocity of the
rigid surface, and not at the velocities of slip, with which a step could have several solutions. While the surface
rests, the last strength applies. Before the surface first moves, there are no tractions, and the bound is the highest
strength.

A point in contact slips by `s = D - u`: its slip grows along t where `|t| = f`, and is constant where `|t| < f`. In an
incompressible half space tractions and pressures move the surface independently of each other
(`effects.stick.solver`), so that the tractions of a step follow from its pressures. The body obeys the law of
`physics.body` in both components,

    A t = G_inf u + sum_k h_k,

so that a step to the tractions `alpha t` is the problem of `solver`. A point that sticks ends at the displacement g,
its `target`: its last displacement plus the increment of D. With the map m of `physics.body`,

    e = g + m/alpha,    w = e - A t = g - u.

Points of the body keep their positions on the grid, as in a march without stick: u, t and the branches belong to these
points, and nothing is shifted. The surface moves over the points. The bounds f move with the surface, as they follow
from the pressure of each step. A point without contact has g = u, so that its slip counts from its first contact.

The residuals of solves must not add up over many steps. So the target g of a point that sticks stays as it is, and is
not set to the displacement u of the solution. The target of a point that slips contains the difference between its
traction and its bound, and the next solve corrects this difference.

The shape of a surface that rolls moves over the body, but its points move along the body only by a share of this
motion, the creep (F. W. Carter, Proc. R. Soc. Lond. A 112 (1926) 151): D grows by the creep times the motion of the
shape. Sliding has the creep 1, free rolling the creep 0.

With output.energy the work of the tractions on the body is added to the work of the pressures, and the loss in slip is

    sum max(0, (t_old + t)/2 (s - s_old)),

so that work = stored + dissipated + slip_loss. At each point slip loses energy. If the motion turns back within a step,
the trapezoidal rule may give a negative loss, which is replaced by 0.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ...columns import added_by
from ...contact.preconditioner import grids_for
from ...march.time_error import Fit
from ...parallel.slab import Array
from ...physics import loops
from ...physics.body import BodyMemory, MovedHeights, surface_of
from ...physics.energy import EnergyMemory, Pressed
from ...physics.records import Entry, Measures, Saved, Units
from ...physics.surface import Vector
from ...printed import quantity
from ..effect import Changes, Instant, Sheared
from ..interface.effect import InterfaceEffect, shares
from . import solver
from .solver import ShearOperator, TangentialSolver, TractionProblem, components, settle_slips, stacked

UNIFORM = 1e-12  # rounding: share of the square of a pressure below which its waves are rounding
LEAST_BOUND = 1e-12  # rounding: bound of tractions, in the run's units, that displacements hardly resolve: taken as 0
ROLLING = Fit(
    "tractions in rolling: times the shares of the contact that enter in a step and that stick",
    2.0,
    1.0,
    "tests/effects/stick/test_rolling.py",
    "0.7 to 30 for cylinders, by where edges lie in a cell; 10 for a sphere",
)
STICKING = Fit(
    "tractions by a shear strength: times the excess of the counted area, the share that sticks, and t over its bound",
    3.0,
    1.0,
    "tests/effects/stick/test_effect.py",
    "0.7 to 4 in two rough contacts, where t exceeds a quarter of its bound",
)


class BoundedTraction(NamedTuple):
    """The map of the tractions and the map of their bounds, both divided by the modulus alpha and in the run's units.
    The map of the tractions has the components along x and y one above the other (`solver.stacked`)."""

    traction: Array
    bound: Array


@dataclass(frozen=True)
class StickMemory:
    """Memory of stick and slip. Maps are in the run's units. Maps of tractions and displacements have two stacked
    components, maps of bounds have one.

    `body` is the memory of the displacements along the surface. `last` has the tractions and the bounds of the last
    step, divided by the modulus `alpha` of that step. `spare` has the maps for the tractions and bounds of the next
    step. `target` is the displacement that points would have if they all stuck. `strength` is the shear strength [Pa]
    of the last step in which the surface moved. `share` is the mean traction divided by the mean bound. `energy` is the
    memory of the energies, or None if the job asks for none, and `lost` the energy lost in slip [J]. `columns` are the
    values of the columns in the last row, except `slip_loss`.
    """

    body: BodyMemory
    last: BoundedTraction
    spare: BoundedTraction
    target: Array
    strength: float
    alpha: float = 0.0
    share: Vector = (0.0, 0.0)
    energy: EnergyMemory | None = None
    lost: float = 0.0
    columns: tuple[float, ...] = (0.0, 0.0, 0.0)


class StickSlip(InterfaceEffect[StickMemory]):
    """Effect of stick and slip: it solves for the tractions of the contact, and adds the columns that follow from
    them."""

    columns: ClassVar[tuple[str, ...]] = (*added_by("interface"), *added_by("interface.stick"))
    fields: ClassVar[tuple[str, ...]] = ("traction_x", "traction_y")

    def __init__(self, scene: Any) -> None:
        setup, slab, grid, numerics = scene.setup, scene.slab, scene.choices.grid, scene.choices.numerics
        self._scene, self._slab, self._law = scene, slab, scene.job.section("interface")
        self._friction = self._law.friction(scene.job.material)
        self._both = stacked(slab)
        self._body, self._energy = scene.body_for_shear(self._both)
        self._slipping = slab.zeros() if scene.job.section("thermal") is not None else np.zeros((0, 0))
        self._cell_force = grid.dx * grid.dy * scene.units.pressure
        self._free = setup.half_space.free
        operator = ShearOperator(setup.fft, setup.size, scene.job.material.poisson, self._free)
        grids = grids_for(setup.size[0] / slab.nx, setup.size[1] / slab.ny)
        self._tolerance, inverse = numerics.tolerance, scene.operators.preconditioner
        self._solver = TangentialSolver(slab, operator, inverse, grids, numerics.max_iterations)

    def at_rest(self) -> StickMemory:
        last, spare = (BoundedTraction(self._both.zeros(), self._slab.zeros()) for _ in range(2))
        energy = None if self._energy is None else self._energy.at_rest()
        strength = self._law.shear_stress or 0.0
        return StickMemory(self._body.at_rest(), last, spare, self._both.zeros(), strength, energy=energy)

    def follow(self, instant: Instant, memory: StickMemory) -> Changes[StickMemory]:
        """Solve for the tractions of a step, in the maps of `memory`. Return the new memory, with what else the step
        changes (`Changes`). Collective."""
        step, alpha, target = instant.step, instant.modulus, memory.target
        (x, y), (along, across) = instant.moved, self._scene.job.history[step.stage].creep
        way = along * x - across * y, along * y + across * x
        for part, moved in zip(components(target), way, strict=True):
            part += moved / self._scene.units.height
        strength = self._strength(step.dt, math.hypot(*way), memory.strength)
        trial = self._body.begin(memory.body, step.dt, MovedHeights(target), step.growth)
        new = self._start(instant, memory, strength)
        stiffness = self._stiffness(instant)
        tolerance = min(self._tolerance, self._scene.controller.largest_tolerance(step))
        pulled, last = TractionProblem(new.bound, trial.effective, stiffness, tolerance), memory.last.traction
        solved = self._solver.solve(pulled, new.traction, last, memory.alpha / alpha)
        body = self._body.commit(memory.body, trial, solved.displacement, surface_of(memory.body))
        now, before = Pressed(new.traction, alpha), Pressed(memory.last.traction, memory.alpha)
        energy = memory.energy
        if self._energy is not None and energy is not None:
            energy = self._energy.advance(energy, step.dt, now, before, solved.displacement, body, step.growth)
        bounds, u = (memory.last.bound, new.bound), surface_of(body)
        sheared, share, stuck = self._settle(instant, bounds, now, before, stiffness, u, target, solved.certificate)
        lost, (x, y) = memory.lost + sheared.lost, sheared.force
        columns = *shares(sheared.measures, (-x, -y)), stuck
        after = StickMemory(body, new, memory.last, target, strength, alpha, share, energy, lost, columns)
        whole = not self._free and instant.measures.contact_area == 1.0  # no step resolves how it begins to slide
        turned = 0.0 if whole else math.dist(share, memory.share)
        return Changes(after, solved.failure, sheared=sheared, turned=turned)

    def _strength(self, dt: float, way: float, last: float) -> float:
        """Return the shear strength [Pa] of a step in which the surface moves by a way [m] along itself; `last` is the
        strength before."""
        if self._friction is None or dt == 0.0 or way == 0.0:
            return last
        return self._friction.shifted(self._scene.time_factor).stress(way / dt)

    def _start(self, instant: Instant, memory: StickMemory, strength: float) -> BoundedTraction:
        """Return the bounds `f/alpha` of a step, and tractions from which its solve starts, in the spare maps; local.
        A shear strength acts on the corrected contact area, as without stick."""
        (t, bound), last, measures = memory.spare, memory.last, instant.measures
        if self._law.coefficient is not None:
            np.multiply(instant.pressure, self._law.coefficient, out=bound)
        else:
            share = measures.contact_area_corrected / measures.contact_area if measures.contact_area > 0.0 else 0.0
            bound[:] = strength * share / (instant.modulus * self._scene.units.pressure)
        bound[(instant.touching == 0) | (bound < LEAST_BOUND)] = 0.0
        scale = memory.alpha / instant.modulus, instant.step.growth
        past = *components(last.traction), last.bound
        solver.extrapolate_tractions(*past, *scale, bound, *memory.share, *components(t))
        return memory.spare

    def _stiffness(self, instant: Instant) -> float:
        """Return pressure over displacement of the contact as a whole, `<p, p>/<p, A p>`; collective.

        In a periodic box p is without its mean, which does not move the surface. Where nothing is left, any number will
        do.
        """
        p, u = instant.pressure, instant.solved.contact.u
        square, work, total = self._slab.sum(loops.dot(p, p), loops.dot(p, u), float(p.sum(dtype=np.float64)))
        waves = square if self._free else square - total**2 / self._slab.points
        return waves / work if work > 0.0 and waves > UNIFORM * square else 1.0

    def _settle(
        self,
        instant: Instant,
        bounds: tuple[Array, Array],
        now: Pressed,
        before: Pressed,
        stiffness: float,
        displacement: Array,
        target: Array,
        error: float,
    ) -> tuple[Sheared, Vector, float]:
        """Renew the targets of points that slip or are not touched; collective. Return what the tractions add to the
        measures of a step, their mean over the mean bound, and the share of the box that sticks.

        The `bounds` are those before and after the step. The share of the tractions that is wrong as the area is: all
        of those by a shear strength; by a coefficient where points stick, as those that slip add up to a share of the
        load. Spots that stick slip first at their edges, and edge cells make them too stiff; by a coefficient tractions
        are small there. In rolling, points that enter the contact in a step move with the surface for all of it."""
        (past, bound), measures = bounds, instant.measures
        t, old = ((each.modulus, *components(each.p)) for each in (now, before))
        ends = *components(displacement), *components(target)
        sums = settle_slips(bound, stiffness, *t, *old, *ends, self._slipping)
        lost, total_x, total_y, most, stuck, power = self._slab.sum(*sums)
        unit = self._cell_force * now.modulus
        force = 0.0 - unit * total_x, 0.0 - unit * total_y
        mean = (total_x / most, total_y / most) if most > 0.0 else (0.0, 0.0)
        touching = measures.contact_area * self._slab.points
        sticking = round(stuck) / touching if touching else 0.0
        share, mesh, time = sticking, 0.0, 0.0
        if touching and self._law.coefficient is None:
            excess = 1.0 - measures.contact_area_corrected / measures.contact_area
            share, mesh = 1.0, STICKING.value * excess * sticking * math.hypot(*mean)
        if touching and self._scene.job.history[instant.step.stage].rolls:
            entered = self._slab.sum(float(np.count_nonzero((bound > 0.0) & (past <= 0.0))))[0]
            time = ROLLING.value * (entered / touching) * sticking
        loss = lost * self._cell_force * self._scene.units.height
        slipping = self._slipping if instant.slid and power > 0.0 else bound
        sheared = Sheared(_with_force(instant, force), force, loss, slipping, error, share, time, mesh)
        return sheared, mean, round(stuck) / self._slab.points

    def last_lines(self, memory: StickMemory) -> Iterator[str]:
        if memory.energy is not None:
            yield f"slip lost {quantity(memory.lost, 'J', 4)}, which is a part of the work"

    def values(self, memory: StickMemory) -> Sequence[float]:
        """Return the two parts of friction, the share of the box that sticks, and the energy lost in slip [J]. This
        energy is NaN if the job asks for no energies."""
        return *memory.columns, math.nan if memory.energy is None else memory.lost

    def field(self, memory: StickMemory, name: str) -> Array:
        """Return this rank's rows of one component of the traction on the body [Pa]: `traction_x` or `traction_y`."""
        traction = components(memory.last.traction)[self.fields.index(name)]
        return traction * (memory.alpha * self._scene.units.pressure)

    def further_energies(self, memory: StickMemory) -> tuple[EnergyMemory, float] | None:
        return None if memory.energy is None else (memory.energy, memory.lost)

    # -- checkpoints --------------------------------------------------------------------------------------------------

    def entries(self, memory: StickMemory, units: Units) -> dict[str, Entry]:
        """Return the checkpoint entries. A map with two components has an entry for each component."""
        pressure = units.height / units.length
        both = {
            "traction": Entry(memory.last.traction, pressure),
            "earlier traction": Entry(memory.spare.traction, pressure),
            "target": Entry(memory.target, units.height, "m"),
            **self._body.memory_entries(memory.body, units.height, "m", units.modulus * units.height, "Pa m"),
        }
        if self._energy is not None and memory.energy is not None:
            energies = self._energy.entries(memory.energy, units)
            both |= {f"energy {name}": entry for name, entry in energies.items()}
            both["lost"] = Entry(memory.lost, 1.0, "J")
        found = {"bound": Entry(memory.last.bound, pressure), "modulus": Entry(memory.alpha, units.modulus, "Pa")}
        found |= {"share": Entry(np.array(memory.share)), "columns": Entry(np.array(memory.columns))}
        found["strength"] = Entry(memory.strength, 1.0, "Pa")
        for name, entry in both.items():
            found |= _split(name, entry) if entry.is_map else {name: entry}
        return found

    def restored(self, memory: StickMemory, saved: Saved) -> StickMemory:
        """Return the memory of a checkpoint. The saved maps have already been read into `memory`."""
        joined = {name.removesuffix(" x"): value for name, value in saved.items()}
        energy = memory.energy
        if self._energy is not None and energy is not None:
            of_energy = {name.removeprefix("energy "): value for name, value in joined.items()}
            energy = self._energy.restored(energy, of_energy)
        x, y = saved["share"].tolist()
        return replace(
            memory,
            body=self._body.restored(memory.body, joined),
            strength=float(saved["strength"]),
            alpha=float(saved["modulus"]),
            share=(x, y),
            energy=energy,
            lost=float(saved.get("lost", 0.0)),
            columns=tuple(saved["columns"].tolist()),
        )


def _split(name: str, entry: Entry) -> dict[str, Entry]:
    """Return the entries of both components of a stacked map."""
    parts = zip("xy", components(np.asarray(entry.value)), strict=True)
    return {f"{name} {axis}": replace(entry, value=part) for axis, part in parts}


def _with_force(instant: Instant, force: Vector) -> Measures:
    """Return the measures of a step with a force of the interface [N]."""
    measures, own = instant.measures, math.hypot(*force)
    x, y, normal = measures.force_x + force[0], measures.force_y + force[1], measures.normal_force
    presses = normal > instant.solved.least_load and measures.contact_area > 0.0
    return replace(
        measures,
        force_x=x,
        force_y=y,
        friction=math.hypot(x, y) / normal if presses else 0.0,
        friction_interface=own / normal if presses else 0.0,
        force_interface=own,
    )

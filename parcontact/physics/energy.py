"""Energies of the body, and measures of a contact: load, tangential force, contact area, gaps.

Energies are the work done on the body, the energy stored in it, and the energy dissipated by its branches. Measures
are in SI units.

With `<a, b>` the sum over points, branch k stores `<h_k, A^-1 h_k>/(2 G_k)` and dissipates `<h_k, A^-1 h_k>/(G_k
tau_k)` per time; the parallel spring stores `G_inf <u, A^-1 u>/2`. All energies follow from products of `w = A^-1 du`
of each step with existing maps.

The exponential integrators take u as linear or quadratic in time within a step (`physics.body`): work and
dissipation are the exact integrals over this motion, and the balance closes up to rounding. With `0 <= s <= 1`, `z =
dt/tau` and the bend `c = kappa/2 (du - r du_before)`,

    u' = du + (2 s - 1) c,     h = exp(-z s) h_0 + G a du + G b c,                                                (1)
    a = (1 - exp(-z s))/z,     b = int_0^s exp(-z (s - x)) (2 x - 1) dx.

The error of the assumed motion appears in the difference between this work and the work of the forces on the surface,
the integral of `W dd - F ds`. Backward Euler defines no motion within a step: the work follows from the trapezoidal
rule, the dissipated power is taken at the end of the step, and the balance closes to first order in the time step.

Counting the cells in contact gives too large an area, as a cell on the edge of contact counts as a whole. With the
length S of all edges of contact along the sides of cells of length dx, the true area is on average smaller by
`(pi - 1 + ln 2)/24 S dx` (V. A. Yastrebov, G. Anciaux, J.-F. Molinari, Tribology International 114 (2017) 161,
arXiv:1701.02727). This excess is `SIDE` cells for each side between a point in contact and a point that is not, and
smaller on long cells (`records.excess_of`).

This holds if the pressure falls to 0 at the edge. Where a stiff counterbody yields, the pressure ends at the
hardness H, and a point on the edge carries the share p/H of the hardness: the excess is `1 - p/H` of a cell, and 0 at
points that have yielded. Where the pressure falls from H to 0 over a cell or more, the edge is as without yielding,
although points on it may have neighbours that have yielded. `Probe` computes both estimates of the excess and takes the
smaller one.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..parallel import regrid
from ..parallel.slab import Array, Slab
from . import loops
from .body import BodyMemory, MovedHeights, ZenerBody, surface_of
from .prony import Prony, bend
from .records import Entry, Measures, Saved, Units, excess_of
from .surface import Shear, Surface, Vector

SMALL = 1.0  # rounding: z below which integrals over a step are computed by Gauss's rule, to fifteen digits
NODES, WEIGHTS = (0.5 * (each + shift) for each, shift in zip(np.polynomial.legendre.leggauss(10), (1, 0), strict=True))


@dataclass(frozen=True)
class EnergyMemory:
    """Memory of the energies of a body: `work`, `stored` and `dissipated` since the start, in the unit that
    `ElasticEnergy` and `ZenerEnergy` name. `dissipated` has one number for each branch.

    The energies of a body with branches need the products of the last step, with the increment du of u in this step:

    * spring: `<u, A^-1 u>`;
    * branches: `<h_k, A^-1 h_k>` for each branch;
    * increment: `<du, A^-1 du>`;
    * crossed: `<h_k, A^-1 du>` for each branch;
    * elastic: the memory of `ElasticPressure`; None if `AppliedInverse` is used.
    """

    work: float = 0.0
    stored: float = 0.0
    dissipated: Array = field(default_factory=lambda: np.zeros(0))
    spring: float = 0.0
    branches: Array = field(default_factory=lambda: np.zeros(0))
    increment: float = 0.0
    crossed: Array = field(default_factory=lambda: np.zeros(0))
    elastic: BodyMemory | None = None

    def without_work(self, before: "EnergyMemory") -> "EnergyMemory":
        """Return the energies after a step that began with the memory `before` and had no external work. The stored
        energy that is lost in the step is shared among the branches in proportion to their dissipation."""
        lost = self.dissipated - before.dissipated
        whole = float(lost.sum())
        share = (before.stored - self.stored) / whole if whole > 0.0 else 0.0
        return replace(self, work=before.work, dissipated=before.dissipated + share * lost)


class Pressed(NamedTuple):
    """A pressure at an instant, given by a map p and the `modulus` that multiplies the map."""

    p: Array
    modulus: float


class Inverse(Protocol):
    """Operator from displacement to pressure of an elastic body of modulus 1; collective."""

    def apply(self, field: Array, out: Array) -> Array: ...


class StepProducts(NamedTuple):
    """Products of one branch over a step, or the weights with which an energy is the sum of these products. With the
    modulus G of the branch, its map h_0 at the start of the step, and the increment du and the bend c of the module,
    the products are `S = <h_0, A^-1 h_0>/G`, `X = <h_0, A^-1 du>`, `D = G <du, A^-1 du>`, `Y = <h_0, A^-1 c>`,
    `E = G <du, A^-1 c>`, `F = G <c, A^-1 c>`."""

    s: Array
    x: Array
    d: Array
    y: Array
    e: Array
    f: Array

    def dot(self, other: "StepProducts") -> Array:
        return np.asarray(sum(one * two for one, two in zip(self, other, strict=True)))


def dissipation_weights(z: Array) -> StepProducts:
    """Return the weights with which `StepProducts` give the energy that a branch dissipates in a step: the integral of
    `<h, A^-1 h>/(G tau)` over the step. `z = dt/tau` has any shape, and the weights have the same shape."""
    z = np.asarray(z, np.float64)
    safe, small = np.maximum(z, SMALL), np.minimum(z, SMALL)
    lost, q = -np.expm1(-safe), bend(safe)
    twice = 0.5 * lost * (2.0 - lost)
    crossed = -2.0 * q - 2.0 * lost / safe / safe + (1.0 + 2.0 / safe) * twice / safe
    closed = StepProducts(
        twice,
        lost * (lost / safe),
        (safe - lost - 0.5 * lost**2) / safe / safe,
        2.0 * crossed,
        -2.0 * (2.0 * q + crossed) / safe,
        2.0 * (1.0 / (6.0 * safe) - q / safe * (1.0 + 2.0 / safe) - q**2),
    )
    past, change, bent = motion_at_nodes(small)
    parts = past * past, 2.0 * past * change, change * change, 2.0 * past * bent, 2.0 * change * bent, bent * bent
    return StepProducts(
        *(np.where(z < SMALL, small * (part @ WEIGHTS), one) for part, one in zip(parts, closed, strict=True))
    )


def bend_weights(z: Array) -> StepProducts:
    """Return the weights with which `StepProducts` give the error of the trapezoidal rule in the work of a branch. This
    error is the exact work in a step, the integral of `<h, A^-1 u'>`, minus the mean of `<h, A^-1 du>` at both ends of
    the step. `z = dt/tau` has any shape."""
    z = np.asarray(z, np.float64)
    safe, small = np.maximum(z, SMALL), np.minimum(z, SMALL)
    q = bend(z)
    closed = 1.0 / (3.0 * safe) - 2.0 * bend(safe) * (1.0 + 2.0 / safe) / safe
    series = motion_at_nodes(small)[2] @ (WEIGHTS * (2.0 * NODES - 1.0))
    return StepProducts(np.zeros_like(z), -z * q, q, -2.0 * q, -q, np.where(z < SMALL, series, closed))


def motion_at_nodes(z: Array) -> tuple[Array, Array, Array]:
    """Return `exp(-z s)`, a and b of Eq. (1) of the module at the quadrature points s = NODES, along a new axis. Valid
    for z <= SMALL."""
    x = z[..., None] * NODES
    change = NODES * (np.exp(-x[..., None] * NODES) @ WEIGHTS)
    later = 2.0 * NODES[:, None] * (1.0 - NODES) - 1.0  # 2 x - 1 at x = s - s y
    return np.exp(-x), change, NODES * ((np.exp(-x[..., None] * NODES) * later) @ WEIGHTS)


class ElasticEnergy:
    """Computes the energies of a body without memory, which stores all work. Energies are in the unit `unit` [J]."""

    bodies: tuple[ZenerBody, ...] = ()  # that relax

    def __init__(self, slab: Slab, unit: float = 1.0) -> None:
        self.slab, self.unit = slab, unit

    def at_rest(self) -> EnergyMemory:
        """Return the energies of a body at rest."""
        return EnergyMemory()

    def advance(
        self,
        memory: EnergyMemory,
        dt: float,
        now: Pressed,
        before: Pressed,
        u: Array,
        body: BodyMemory,
        growth: float = 0.0,
    ) -> EnergyMemory:
        """Return the energies after a step that ends at the pressure `now` with the displacement u; collective, with
        one reduction. The other arguments are not used."""
        stored = 0.5 * now.modulus * self.slab.sum(loops.dot(now.p, u))[0]
        return EnergyMemory(work=stored, stored=stored)

    def entries(self, memory: EnergyMemory, units: Units) -> dict[str, Entry]:
        """Return the checkpoint entry of the stored energy. The entry is optional, as the energy can be computed from
        any contact."""
        return {"stored": Entry(memory.stored, self.unit, "J", optional=True)}

    def restored(self, memory: EnergyMemory, saved: Saved) -> EnergyMemory:
        """Return the energies of a checkpoint. The work equals the stored energy."""
        stored = float(saved.get("stored", 0.0))
        return EnergyMemory(work=stored, stored=stored)


class AppliedInverse:
    """Computes `A^-1 du` with the operator `inverse`, which must be the exact inverse of A (periodic half space with
    the spectral kernel). `scratch()` returns a map that is free until the next solve."""

    bodies: tuple[ZenerBody, ...] = ()  # that relax

    def __init__(self, inverse: Inverse, scratch: Callable[[], Array]) -> None:
        self._inverse, self._scratch = inverse, scratch

    def at_rest(self) -> None:
        """Return None: there is no memory."""

    def advance(self, memory: BodyMemory | None, dt: float, p: Array, du: Array, growth: float) -> tuple[Array, None]:
        """Return the map `A^-1 du` and None; collective."""
        return self._inverse.apply(du, self._scratch()), None

    def entries(self, memory: BodyMemory | None, units: Units) -> dict[str, Entry]:
        """Return no entry of a checkpoint: there is no memory."""
        return {}

    def restored(self, memory: BodyMemory | None, saved: Saved) -> None:
        """Return None: there is no memory."""


class ElasticPressure:
    """Computes `v = A^-1 u`, the pressure that causes u on an elastic body of modulus 1, without an inverse of A.

    A acts on space and relaxation acts on time, so that they commute. With maps m_k, for which `h_k = A m_k`, the law
    of the body

        A p = G_inf u + sum_k h_k,     dh_k/dt = G_k du/dt - h_k/tau_k

    becomes a law that holds at each point alone:

        p = G_inf v + sum_k m_k,       dm_k/dt = G_k dv/dt - m_k/tau_k.

    So v is the displacement of a second `ZenerBody`, each point of which responds to the pressure at this point only.
    """

    def __init__(self, slab: Slab, prony: Prony, integrator: str) -> None:
        self.body = ZenerBody(slab, prony, integrator)
        self.bodies: tuple[ZenerBody, ...] = (self.body,)

    def at_rest(self) -> BodyMemory:
        return self.body.at_rest()

    def advance(
        self, memory: BodyMemory | None, dt: float, p: Array, du: Array, growth: float
    ) -> tuple[Array, BodyMemory]:
        """Return `A^-1 du`, which is the increment of v in a step, and the memory after the step; local to this rank.
        The map p is the pressure at the end of the step, divided by the modulus alpha of the step. The memory after the
        step uses the maps of the memory before."""
        assert memory is not None
        v = surface_of(memory)
        now = self.body.commit(memory, self.body.begin(memory, dt, MovedHeights(v), growth), p, v)
        return now.increment, now

    def entries(self, memory: BodyMemory | None, units: Units) -> dict[str, Entry]:
        """Return the checkpoint entries of the second body. Here v, a pressure for the modulus 1, takes the place of
        the displacement; v has the unit of a strain."""
        assert memory is not None
        strain = units.height / units.length
        return self.body.memory_entries(memory, strain, "1", units.modulus * strain, "Pa")

    def restored(self, memory: BodyMemory | None, saved: Saved) -> BodyMemory:
        """Return the memory of a checkpoint. The saved maps have already been read into `memory`."""
        assert memory is not None
        return self.body.restored(memory, saved)


class ZenerEnergy:
    """Computes the energies of a `ZenerBody`, in the unit `unit` [J]."""

    def __init__(
        self, slab: Slab, material: ZenerBody, inverse: AppliedInverse | ElasticPressure, unit: float = 1.0
    ) -> None:
        self.slab, self.material, self.inverse, self.unit = slab, material, inverse, unit
        self.bodies = inverse.bodies

    def at_rest(self) -> EnergyMemory:
        """Return the energies of a body at rest."""
        count = len(self.material.prony.moduli)
        none = np.zeros(count)
        return EnergyMemory(dissipated=none, branches=none, crossed=none, elastic=self.inverse.at_rest())

    def advance(
        self,
        memory: EnergyMemory,
        dt: float,
        now: Pressed,
        before: Pressed,
        u: Array,
        body: BodyMemory,
        growth: float = 0.0,
    ) -> EnergyMemory:
        """Return the energies after a step from the pressure `before` to the pressure `now`; collective, with one
        reduction. `body` is the memory of the body after the step.

        `growth` is dt divided by the length of the step before (`physics.body`). The maps of an `elastic` memory are
        reused.
        """
        material, du, moduli = self.material, body.increment, self.material.prony.moduli
        w, elastic = self.inverse.advance(memory.elastic, dt, now.p, du, growth)
        sums = [loops.dot(branch, w) for branch in body.branches]
        sums += [loops.dot(body.before, w), loops.dot(du, w), loops.dot(surface_of(body), w)]
        *products, past, own, total, work = self.slab.sum(*sums, loops.work(*now, *before, du))
        crossed = np.array(products)
        decay, gain, back = material.coefficients(dt, growth)
        branches = decay**2 * memory.branches + 2 * decay * (gain * crossed + back * memory.crossed)
        branches += gain**2 * own + 2 * gain * back * past + back**2 * memory.increment
        spring = memory.spring + (2 * total - own)
        stored = 0.5 * (material.prony.modulus_inf * spring + float(np.sum(branches / moduli)))
        z, dissipated = material.elapsed(dt), memory.dissipated
        if dt == 0.0:  # a jump is elastic
            work = stored - memory.stored
        elif material.integrator == "backward-euler":
            dissipated = dissipated + z * branches / moduli
        else:
            half = growth / (1.0 + growth) if material.integrator == "exponential" else 0.0  # kappa/2
            y = half * (crossed - growth * memory.crossed)
            e = half * (own - growth * past)
            f = half**2 * (own - 2.0 * growth * past + growth**2 * memory.increment)
            seen = StepProducts(memory.branches / moduli, crossed, moduli * own, y, moduli * e, moduli * f)
            work = work + float(np.sum(bend_weights(z).dot(seen)))
            dissipated = dissipated + dissipation_weights(z).dot(seen)
        crossed = decay * crossed + gain * own + back * past
        return EnergyMemory(memory.work + work, stored, dissipated, spring, branches, own, crossed, elastic)

    def entries(self, memory: EnergyMemory, units: Units) -> dict[str, Entry]:
        """Return the checkpoint entries: energies, sums needed to continue them, and the memory of
        `ElasticPressure`."""
        spring = units.height**2 / units.length
        return {
            "work": Entry(memory.work, self.unit, "J"),
            "stored": Entry(memory.stored, self.unit, "J"),
            "dissipated": Entry(memory.dissipated, self.unit, "J"),
            "spring": Entry(memory.spring, spring, "m"),
            "branches": Entry(memory.branches, units.modulus**2 * spring, "Pa^2 m"),
            "increment": Entry(memory.increment, spring, "m"),
            "crossed": Entry(memory.crossed, units.modulus * spring, "Pa m"),
            **{f"elastic {name}": entry for name, entry in self.inverse.entries(memory.elastic, units).items()},
        }

    def restored(self, memory: EnergyMemory, saved: Saved) -> EnergyMemory:
        """Return the energies of a checkpoint. The saved maps have already been read into `memory`."""
        work, stored, spring, increment = (float(saved[name]) for name in ("work", "stored", "spring", "increment"))
        names = "dissipated", "branches", "crossed"
        dissipated, branches, crossed = (np.array(saved[name], dtype=np.float64) for name in names)
        own = {name.removeprefix("elastic "): value for name, value in saved.items() if name.startswith("elastic ")}
        elastic = self.inverse.restored(memory.elastic, own)
        return EnergyMemory(work, stored, dissipated, spring, branches, increment, crossed, elastic)


YIELDED = 1e-6  # accuracy: relative distance of a pressure to the hardness up to which a point counts as yielded


class _Yielding(NamedTuple):
    """Sums over all points of a contact that may yield: excess cells on its edge if pressures end at the hardness
    there, points that have yielded, and their gaps, which are negative."""

    excess: float
    points: float
    gaps: float


@dataclass(frozen=True)
class Probe:
    """Computes measures from the maps of a solved step. `shears` are sources of friction in the contact area
    (`surface.Shear`). `hardness` [Pa] is the largest pressure, None if pressures have no limit."""

    slab: Slab
    surface: Surface
    units: Units
    shears: Sequence[Shear] = ()
    hardness: float | None = None

    @cached_property
    def _excess(self) -> float:
        """Excess cells per side on the edge of contact."""
        (lx, ly), slab = self.surface.size, self.slab
        return excess_of(lx / slab.nx, ly / slab.ny, 1 in (slab.nx, slab.ny))

    def measure(
        self,
        p: Array,
        alpha: float,
        u: Array,
        h: Array,
        d: float,
        touching: NDArray[Any],
        displacement: Vector,
        velocity: Vector = (0.0, 0.0),
        least_load: float = 0.0,
    ) -> Measures:
        """Return the measures of the pressure `alpha p` with the gap `u - h - d`; collective.

        The surface has moved by `displacement` [m] and moves with `velocity` [m/s]. `touching` is a map that is not 0
        where the surfaces touch. Friction is 0 unless the load is compressive and above `least_load` [N]. A smaller
        load is only the rounding error of two forces in balance. If no point touches, all pressure is tension. Then a
        load above 0 is only an error of the solve, and friction is 0, too.
        """
        units, points = self.units, self.slab.points
        along_x, along_y = self.surface.periodic
        *sums, largest = loops.sum_measures(
            p, u, h, touching, regrid.before_first(self.slab, touching, along_y), along_x
        )
        edge = _touches_edge(self.slab, touching, self.surface.periodic)
        at_edges = [] if all(self.surface.periodic) else _sum_edges(self.slab, u, h)
        load, count, gaps, sides_x, sides_y, *at_edges, largest, edge = self.slab.reduce(
            [*sums, *at_edges], [largest, edge]
        )
        by_edges = self._measure_edges(at_edges, gaps / points) if at_edges else 0.0
        unit_pressure = alpha * units.pressure
        sides = sides_x + sides_y
        excess, least = self._excess * sides, 0.0
        if self.hardness is not None:
            highest = self.hardness / unit_pressure
            least = min(load / highest, count)
            if largest >= (1.0 - YIELDED) * highest:
                yielding = self._measure_yielded(p, u, h, highest)
                gaps -= yielding.gaps - yielding.points * d
                excess = min(excess, yielding.excess)
        area = self.surface.size[0] * self.surface.size[1]
        force_x, force_y = 0.0, 0.0
        if load > 0.0 or least_load > 0.0:
            unit_force = area / points * unit_pressure * units.height
            force_x, force_y = (unit_force * force for force in self.surface.forces(p, displacement))
        normal = load / points * unit_pressure * area
        presses = normal > least_load and count > 0
        corrected = max(count - excess, least) / points
        forces = [shear.force(corrected * area, velocity) for shear in self.shears]
        own = sum(force[0] for force in forces), sum(force[1] for force in forces)
        force_x, force_y = force_x + own[0], force_y + own[1]
        rubbed = math.hypot(*own)
        return Measures(
            pressure=load / points * unit_pressure,
            force_x=force_x,
            force_y=force_y,
            friction=math.hypot(force_x, force_y) / normal if presses else 0.0,
            contact_area=count / points,
            approach=d * units.height - self.surface.datum,
            mean_gap=(gaps / points - d) * units.height,
            gap_by_edges=by_edges * units.height,
            max_pressure=largest * unit_pressure,
            contact_area_corrected=corrected,
            at_edge=edge > 0.0,
            normal_force=normal,
            friction_interface=rubbed / normal if presses else 0.0,
            force_interface=rubbed,
            spared=(self._excess * sides - excess) / points,
            straight=self._straightness(sides_x, sides_y),
        )

    def _measure_edges(self, sums: Sequence[float], mean: float) -> float:
        """Return the error of the mean gap by the edges of a free box, from `_sum_edges` of all ranks."""
        nx, ny = self.slab.nx, self.slab.ny
        (first_x, last_x, first_y, last_y), (along_x, along_y) = sums, self.surface.periodic
        error = 0.0
        if nx > 1 and not along_x:
            error += _error_by_edges(first_x / ny, last_x / ny, mean, nx)
        if ny > 1 and not along_y:
            error += _error_by_edges(first_y / nx, last_y / nx, mean, ny)
        return error

    def _straightness(self, sides_x: float, sides_y: float) -> float:
        """Return how nearly all edges of contact follow one axis of the grid; the numbers of their cell sides are those
        between neighbours along x and along y."""
        (lx, ly), slab = self.surface.size, self.slab
        along_y, along_x = sides_x * ly / slab.ny, sides_y * lx / slab.nx
        return abs(along_x - along_y) / ((along_x + along_y) or 1.0)

    def _measure_yielded(self, p: Array, u: Array, h: Array, highest: float) -> _Yielding:
        """Return the sums for a contact whose pressures end at `highest`, in the unit of p; collective."""
        along_x, along_y = self.surface.periodic
        above, below = regrid.around(self.slab, p, 1, along_y)
        found = loops.measure_yielded(p, u, h, above[0], below[0], along_x, (1.0 - YIELDED) * highest)
        sharp, sides, count, gaps = self.slab.sum(*found)
        return _Yielding(sharp + self._excess * sides, count, gaps)


def _sum_edges(slab: Slab, u: Array, h: Array) -> list[float]:
    """Return this rank's sums of `u - h` over the first and last points along x, and along y."""
    first, last = slice(0, 1 if slab.rows.start == 0 else 0), slice(-1 if slab.rows.stop == slab.ny else len(u), None)
    edges = (u[:, 0], h[:, 0]), (u[:, -1], h[:, -1]), (u[first], h[first]), (u[last], h[last])
    return [float(np.sum(ours - theirs, dtype=np.float64)) for ours, theirs in edges]


def _error_by_edges(first: float, last: float, mean: float, points: int) -> float:
    """Return the error of a mean over this number of points along a free box, from the means of the gap at its first
    and last points, and over the box. The last point is a cell before the end of the box, over which the gap rises as
    in a paraboloid."""
    rise = 6.0 * (0.5 * (first + last) - mean) / points
    return 0.5 * (abs(last + rise - first) + abs(rise)) / points


def _touches_edge(slab: Slab, touching: NDArray[Any], periodic: tuple[bool, bool]) -> float:
    """Return 1 if the surfaces touch on this rank at a free edge of the box, in a direction with several points."""
    sides = [touching[:, 0], touching[:, -1]] if slab.nx > 1 and not periodic[0] else []
    if slab.ny > 1 and len(touching) and not periodic[1]:
        sides += [touching[0]] * (slab.rows.start == 0) + [touching[-1]] * (slab.rows.stop == slab.ny)
    return float(any(side.any() for side in sides))

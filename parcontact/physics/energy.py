"""Energy balance of the body: work done on it, energy stored in it, energy dissipated by its branches.

With `<a, b>` the sum over points, branch k stores `<h_k, A^-1 h_k>/(2 G_k)` and dissipates
`<h_k, A^-1 h_k>/(G_k tau_k)` per time; the parallel spring stores `G_inf <u, A^-1 u>/2`. All of them follow from
`w = A^-1 du` of each step by products with the maps that are there anyway.

The exponential integrator moves a body whose u is linear in time within a step: work and dissipation are the exact
integrals over that motion, and the balance closes but for rounding. How well the motion itself is resolved shows in the
work against that of the forces on the surface, the integral of `W dd - F ds`. Backward Euler knows no motion within a
step: its work is that of the trapezoidal rule, its dissipation that of the end of the step, and the balance closes to
first order in the time step.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import NamedTuple, Protocol

import numpy as np

from ..parallel.slab import Array, Slab
from . import loops
from .body import BodyMemory, Heights, ZenerBody, surface_of
from .entries import Entry, MapCount, Saved
from .prony import Prony
from .units import Units

SMALL = 1e-2  # rounding: z below which differences of exponentials are summed as series, here to ten digits


@dataclass(frozen=True)
class EnergyMemory:
    """Memory of the energies of a body: sums since the start, in the unit of the scene, `dissipated` by branch.

    A body with branches goes on from `spring`, `<u, A^-1 u>`, and `branches`, `<h_k, A^-1 h_k>`; `elastic` is the
    memory of `ElasticPressure` where there is one.
    """

    work: float = 0.0
    stored: float = 0.0
    dissipated: Array = field(default_factory=lambda: np.zeros(0))
    spring: float = 0.0
    branches: Array = field(default_factory=lambda: np.zeros(0))
    elastic: BodyMemory | None = None

    def without_work(self, before: "EnergyMemory") -> "EnergyMemory":
        """Return the energies after a step in which nothing has acted on the body: its branches have dissipated what it
        stores less, in the shares that the integrator tells."""
        lost = self.dissipated - before.dissipated
        whole = float(lost.sum())
        share = (before.stored - self.stored) / whole if whole > 0.0 else 0.0
        return replace(self, work=before.work, dissipated=before.dissipated + share * lost)


class Pressed(NamedTuple):
    """The pressure `modulus p` at an instant, with its map p."""

    p: Array
    modulus: float


class Inverse(Protocol):
    """Displacement -> pressure of an elastic body of modulus 1; collective."""

    def apply(self, field: Array, out: Array) -> Array: ...


def dissipation_weights(z: Array) -> tuple[Array, Array, Array]:
    """Weights of `S = <h, A^-1 h>/G`, `X = <h, w>` and `D = G <du, w>` in the dissipation over a step `z = dt/tau`.

    With h the branch map before the step: the integral of `<h, A^-1 h>/(G tau)` over it, u being linear in time.
    """
    e = -np.expm1(-z)
    safe = np.where(z > 0.0, z, 1.0)
    closed = (z - e - 0.5 * e**2) / safe / safe
    x = np.minimum(z, SMALL)
    series = x * (1 / 3 - x * (1 / 4 - x * (7 / 60 - x * (1 / 24 - 31 / 2520 * x))))
    return 0.5 * e * (2.0 - e), e * (e / safe), np.where(z < SMALL, series, closed)


def bend_weights(z: Array) -> tuple[Array, Array]:
    """Weights of X and D, as above, in what the work over a step `z = dt/tau` exceeds that of the trapezoidal rule by.

    It is the mean of the branch's `h(t)` over the step, u being linear in time, less the mean of its two ends.
    """
    e = -np.expm1(-z)
    safe = np.where(z > 0.0, z, 1.0)
    x = np.minimum(z, SMALL)
    series = x * (1 / 12 - x * (1 / 24 - x * (1 / 80 - x / 360)))
    of_change = np.where(z < SMALL, series, (1.0 - 0.5 * e - e / safe) / safe)
    return -z * of_change, of_change


class ElasticEnergy:
    """Energies of a body without memory: all work is stored. `unit` [J] is that of all energies here."""

    bodies: tuple[ZenerBody, ...] = ()  # that relax

    def __init__(self, slab: Slab, unit: float = 1.0) -> None:
        self.slab, self.unit = slab, unit

    def at_rest(self) -> EnergyMemory:
        """Return the energies of a body into which nothing has been pressed."""
        return EnergyMemory()

    def advance(
        self, memory: EnergyMemory, dt: float, now: Pressed, before: Pressed, u: Array, body: BodyMemory
    ) -> EnergyMemory:
        """Return the energies after a solve for a pressure and the displacement u; one reduction; collective."""
        stored = 0.5 * now.modulus * self.slab.sum(loops.dot(now.p, u))[0]
        return EnergyMemory(work=stored, stored=stored)

    def entries(self, memory: EnergyMemory, units: Units) -> dict[str, Entry]:
        """Return what is stored; it follows anew from each contact, so that a run can go on without."""
        return {"stored": Entry(memory.stored, self.unit, "J", optional=True)}

    def restored(self, memory: EnergyMemory, saved: Saved) -> EnergyMemory:
        """Return what is stored in a checkpoint, which is the work."""
        stored = float(saved.get("stored", 0.0))
        return EnergyMemory(work=stored, stored=stored)


class AppliedInverse:
    """`A^-1 du` by an operator K that is the inverse of A; `scratch()` is a map that is free until the next solve."""

    bodies: tuple[ZenerBody, ...] = ()  # that relax

    def __init__(self, inverse: Inverse, scratch: Callable[[], Array]) -> None:
        self._inverse, self._scratch = inverse, scratch

    def at_rest(self) -> None:
        """Return no memory."""

    def advance(self, memory: BodyMemory | None, dt: float, p: Array, du: Array) -> tuple[Array, None]:
        """Return `A^-1 du`, and no memory; collective."""
        return self._inverse.apply(du, self._scratch()), None

    def entries(self, memory: BodyMemory | None, units: Units) -> dict[str, Entry]:
        """Return no entry."""
        return {}

    def restored(self, memory: BodyMemory | None, saved: Saved) -> None:
        """Return no memory."""


class ElasticPressure:
    """`v = A^-1 u` where the inverse of A is not at hand: the pressure that held u on an elastic body of modulus 1.

    A acts on points and the relaxation on times, so that they commute: with `h_k = A m_k` the law of the body,

        A p = G_inf u + sum_k h_k,     dh_k/dt = G_k du/dt - h_k/tau_k,     becomes at every point
          p = G_inf v + sum_k m_k,     dm_k/dt = G_k dv/dt - m_k/tau_k.

    So v is the displacement of a second `ZenerBody`, whose every point obeys on its own to the pressure there.
    """

    def __init__(self, slab: Slab, prony: Prony, integrator: str) -> None:
        self.body = ZenerBody(slab, prony, integrator)
        self.bodies: tuple[ZenerBody, ...] = (self.body,)

    @staticmethod
    def count_maps(branches: int) -> MapCount:
        """Count the maps of a body with so many branches, each of which has one; in double precision."""
        return ZenerBody.count_maps(branches)

    def at_rest(self) -> BodyMemory:
        return self.body.at_rest()

    def advance(self, memory: BodyMemory | None, dt: float, p: Array, du: Array) -> tuple[Array, BodyMemory]:
        """Return what v has grown by in a step to the pressure `alpha p`, which is `A^-1 du`, and the memory after it,
        in the maps of the one before; local to this rank."""
        assert memory is not None
        v = surface_of(memory)
        now = self.body.commit(memory, self.body.begin(memory, dt, Heights(v)), p, v)
        return now.increment, now

    def entries(self, memory: BodyMemory | None, units: Units) -> dict[str, Entry]:
        """Return the entries of a body with strains in place of displacements."""
        assert memory is not None
        strain = units.height / units.length
        return self.body.memory_entries(memory, strain, "1", units.modulus * strain, "Pa")

    def restored(self, memory: BodyMemory | None, saved: Saved) -> BodyMemory:
        """Return the memory that a checkpoint has, whose maps have been read into those of this one."""
        assert memory is not None
        return self.body.restored(memory, saved)


class ZenerEnergy:
    """Energies of a `ZenerBody`; `unit` [J] is that of all energies here."""

    def __init__(
        self, slab: Slab, material: ZenerBody, inverse: AppliedInverse | ElasticPressure, unit: float = 1.0
    ) -> None:
        self.slab, self.material, self.inverse, self.unit = slab, material, inverse, unit
        self.bodies = inverse.bodies

    def at_rest(self) -> EnergyMemory:
        """Return the energies of a body into which nothing has been pressed."""
        count = len(self.material.prony.moduli)
        return EnergyMemory(dissipated=np.zeros(count), branches=np.zeros(count), elastic=self.inverse.at_rest())

    def advance(
        self, memory: EnergyMemory, dt: float, now: Pressed, before: Pressed, u: Array, body: BodyMemory
    ) -> EnergyMemory:
        """Return the energies after a step to the pressure `now` from `before`, with the memory of the body after it;
        one reduction; collective. The maps of an `elastic` memory are those of the one before."""
        material, du, moduli = self.material, body.increment, self.material.prony.moduli
        w, elastic = self.inverse.advance(memory.elastic, dt, now.p, du)
        sums = [loops.dot(branch, w) for branch in body.branches]
        work = loops.work(*now, *before, du)
        *products, own, total, work = self.slab.sum(*sums, loops.dot(du, w), loops.dot(surface_of(body), w), work)
        crossed, past = np.array(products), memory.branches
        decay, gain = material.coefficients(dt)
        branches = decay**2 * past + 2 * decay * gain * crossed + gain**2 * own
        spring = memory.spring + (2 * total - own)
        stored = 0.5 * (material.prony.modulus_inf * spring + float(np.sum(branches / moduli)))
        z, dissipated = material.elapsed(dt), memory.dissipated
        if dt == 0.0:  # a jump is elastic: nothing is lost in it
            work = stored - memory.stored
        elif material.integrator == "exponential":
            work = work + float(np.sum(_weighted(bend_weights(z), crossed, moduli * own)))
            dissipated = dissipated + _weighted(dissipation_weights(z), past / moduli, crossed, moduli * own)
        else:
            dissipated = dissipated + z * branches / moduli
        return EnergyMemory(memory.work + work, stored, dissipated, spring, branches, elastic)

    def entries(self, memory: EnergyMemory, units: Units) -> dict[str, Entry]:
        """Return the energies, the sums over maps that they go on from, and the memory of `ElasticPressure`."""
        spring = units.height**2 / units.length
        return {
            "work": Entry(memory.work, self.unit, "J"),
            "stored": Entry(memory.stored, self.unit, "J"),
            "dissipated": Entry(memory.dissipated, self.unit, "J"),
            "spring": Entry(memory.spring, spring, "m"),
            "branches": Entry(memory.branches, units.modulus**2 * spring, "Pa^2 m"),
            **{f"elastic {name}": entry for name, entry in self.inverse.entries(memory.elastic, units).items()},
        }

    def restored(self, memory: EnergyMemory, saved: Saved) -> EnergyMemory:
        """Return the energies of a checkpoint, whose maps have been read into those of this memory."""
        work, stored, spring = (float(saved[name]) for name in ("work", "stored", "spring"))
        dissipated, branches = (np.array(saved[name], dtype=np.float64) for name in ("dissipated", "branches"))
        elastic = self.inverse.restored(memory.elastic, _of_elastic(saved))
        return EnergyMemory(work, stored, dissipated, spring, branches, elastic)


def _of_elastic(saved: Saved) -> Saved:
    """Return the entries of the elastic memory, by its own names."""
    return {name.removeprefix("elastic "): value for name, value in saved.items() if name.startswith("elastic ")}


def _weighted(weights: tuple[Array, ...], *terms: Array) -> Array:
    return np.asarray(sum(weight * term for weight, term in zip(weights, terms, strict=True)))

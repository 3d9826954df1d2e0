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
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from ..parallel.slab import Array, Slab
from . import loops
from .body import Heights, ZenerBody
from .entries import Entry, MapCount, Saved
from .prony import Prony
from .units import Units

SMALL = 1e-2  # z below which differences of exponentials are summed as series, here to ten digits


@dataclass
class EnergyBalance:
    """Sums since the start, in the run's units; `dissipated` has one entry per branch."""

    work: float = 0.0
    stored: float = 0.0
    dissipated: Array = field(default_factory=lambda: np.zeros(0))


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

    def __init__(self, slab: Slab, unit: float = 1.0) -> None:
        self.slab, self.unit = slab, unit
        self.balance = EnergyBalance()

    def advance(self, dt: float, now: Pressed, before: Pressed, u: Array) -> None:
        """After a solve for a pressure and the displacement u; one reduction; collective."""
        self.balance.work = self.balance.stored = 0.5 * now.modulus * self.slab.sum(loops.dot(now.p, u))[0]

    def entries(self, units: Units) -> dict[str, Entry]:
        """What is stored, and the work; it follows anew from each contact, so that a run can go on without."""
        return {"stored": Entry(self.balance.stored, self.unit, "J", optional=True)}

    def restore(self, saved: Saved) -> None:
        """What is stored, and the work."""
        self.balance.work = self.balance.stored = float(saved.get("stored", 0.0))


class AppliedInverse:
    """`A^-1 du` by an operator K that is the inverse of A; `scratch()` lends a map until the next solve."""

    def __init__(self, inverse: Inverse, scratch: Callable[[], Array]) -> None:
        self._inverse, self._scratch = inverse, scratch

    def advance(self, dt: float, p: Array, du: Array) -> Array:
        """`A^-1 du`; collective."""
        return self._inverse.apply(du, self._scratch())


class ElasticPressure:
    """`v = A^-1 u` where the inverse of A is not at hand: the pressure that held u on an elastic body of modulus 1.

    A acts on points and the relaxation on times, so that they commute: with `h_k = A m_k` the law of the body,

        A p = G_inf u + sum_k h_k,     dh_k/dt = G_k du/dt - h_k/tau_k,     becomes at every point
          p = G_inf v + sum_k m_k,     dm_k/dt = G_k dv/dt - m_k/tau_k.

    So v is the displacement of a second `ZenerBody`, whose every point obeys on its own to the pressure there.
    """

    def __init__(self, slab: Slab, prony: Prony, integrator: str) -> None:
        self.body = ZenerBody(slab, prony, integrator)

    @staticmethod
    def count_maps(branches: int) -> MapCount:
        """Of a body with so many branches, each of which has a map; in double precision."""
        return ZenerBody.count_maps(branches)

    def advance(self, dt: float, p: Array, du: Array) -> Array:
        """What v has grown by in a step to the pressure `alpha p`, which is `A^-1 du`; local to this rank."""
        self.body.commit(self.body.begin(dt, Heights(self.body.u)), p)
        return self.body.increment

    def entries(self, units: Units) -> dict[str, Entry]:
        """As of a body, for strains in place of displacements."""
        strain = units.height / units.length
        return self.body.memory(strain, "1", units.modulus * strain, "Pa")

    def restore(self, saved: Saved) -> None:
        self.body.restore(saved)


class ZenerEnergy:
    """Energies of a `ZenerBody`, advanced after each committed step; `unit` [J] is that of all energies here."""

    def __init__(
        self, slab: Slab, material: ZenerBody, inverse: AppliedInverse | ElasticPressure, unit: float = 1.0
    ) -> None:
        self.slab, self.material, self.inverse, self.unit = slab, material, inverse, unit
        count = len(material.prony.moduli)
        self.balance = EnergyBalance(dissipated=np.zeros(count))
        self._spring, self._branches = 0.0, np.zeros(count)  # <u, A^-1 u> and <h_k, A^-1 h_k>

    def advance(self, dt: float, now: Pressed, before: Pressed, u: Array) -> None:
        """After a step to the pressure `now` from `before`; one reduction; collective."""
        material, balance = self.material, self.balance
        moduli, du = material.prony.moduli, material.increment
        w = self.inverse.advance(dt, now.p, du)
        sums = [loops.dot(branch, w) for branch in material.branches]
        work = loops.work(*now, *before, du)
        *products, own, total, work = self.slab.sum(*sums, loops.dot(du, w), loops.dot(material.u, w), work)
        crossed, past = np.array(products), self._branches
        decay, gain = material.coefficients(dt)
        self._branches = decay**2 * past + 2 * decay * gain * crossed + gain**2 * own
        self._spring += 2 * total - own
        stored = 0.5 * (material.prony.modulus_inf * self._spring + float(np.sum(self._branches / moduli)))
        z = material.elapsed(dt)
        if dt == 0.0:  # a jump is elastic: nothing is lost in it
            balance.work += stored - balance.stored
        elif material.integrator == "exponential":
            balance.work += work + float(np.sum(_weighted(bend_weights(z), crossed, moduli * own)))
            balance.dissipated += _weighted(dissipation_weights(z), past / moduli, crossed, moduli * own)
        else:
            balance.work += work
            balance.dissipated += z * self._branches / moduli
        balance.stored = stored

    def entries(self, units: Units) -> dict[str, Entry]:
        """The balance, and the sums over the maps that it goes on from."""
        balance, spring = self.balance, units.height**2 / units.length
        return {
            "work": Entry(balance.work, self.unit, "J"),
            "stored": Entry(balance.stored, self.unit, "J"),
            "dissipated": Entry(balance.dissipated, self.unit, "J"),
            "spring": Entry(self._spring, spring, "m"),
            "branches": Entry(self._branches, units.modulus**2 * spring, "Pa^2 m"),
        }

    def restore(self, saved: Saved) -> None:
        """The balance and the sums."""
        work, stored, spring = (float(saved[name]) for name in ("work", "stored", "spring"))
        self.balance = EnergyBalance(work, stored, np.array(saved["dissipated"], dtype=np.float64))
        self._spring, self._branches = spring, np.array(saved["branches"], dtype=np.float64)


def _weighted(weights: tuple[Array, ...], *terms: Array) -> Array:
    return np.asarray(sum(weight * term for weight, term in zip(weights, terms, strict=True)))

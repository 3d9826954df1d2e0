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

import numpy as np

from ..parallel.slab import Array, Slab
from . import loops
from .body import Zener

SMALL = 1e-2  # z below which differences of exponentials are summed as series, here to ten digits


@dataclass
class Balance:
    """Sums since the start, in the run's units; `dissipated` has one entry per branch."""

    work: float = 0.0
    stored: float = 0.0
    dissipated: Array = field(default_factory=lambda: np.zeros(0))


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
    """Energies of a body without memory: all work is stored."""

    def __init__(self, slab: Slab) -> None:
        self.slab = slab
        self.balance = Balance()

    def advance(self, p: Array, alpha: float, u: Array) -> None:
        """After a solve for the pressure `alpha p` and the displacement u; one reduction; collective."""
        self.balance.work = self.balance.stored = 0.5 * alpha * self.slab.sum(loops.dot(p, u))[0]


class ZenerEnergy:
    """Energies of a `Zener` body, advanced after each committed step.

    `creep(p, dt, du)` gives `w = A^-1 du` of the step just committed; `memory` is what it remembers, if anything.
    """

    def __init__(
        self,
        slab: Slab,
        material: Zener,
        creep: Callable[[Array, float, Array], Array],
        memory: Zener | None = None,
    ) -> None:
        self.slab, self.material, self.creep, self.memory = slab, material, creep, memory
        count = len(material.prony.moduli)
        self.balance = Balance(dissipated=np.zeros(count))
        self._spring, self._branches = 0.0, np.zeros(count)  # <u, A^-1 u> and <h_k, A^-1 h_k>

    def advance(self, dt: float, p: Array, alpha: float, p_old: Array | None, alpha_old: float) -> None:
        """After a step to pressure `alpha p` from `alpha_old p_old`; one reduction; collective."""
        material, balance = self.material, self.balance
        moduli, du = material.prony.moduli, material.increment
        w = self.creep(p, dt, du)
        sums = [loops.dot(branch, w) for branch in material.branches]
        work = loops.work(p, alpha, p if p_old is None else p_old, alpha_old, du)
        *products, own, total, work = self.slab.sum(*sums, loops.dot(du, w), loops.dot(material.u, w), work)
        crossed, before = np.array(products), self._branches
        decay, gain = material.coefficients(dt)
        self._branches = decay**2 * before + 2 * decay * gain * crossed + gain**2 * own
        self._spring += 2 * total - own
        stored = 0.5 * (material.prony.modulus_inf * self._spring + float(np.sum(self._branches / moduli)))
        z = material.elapsed(dt)
        if dt == 0.0:  # a jump is elastic: nothing is lost in it
            balance.work += stored - balance.stored
        elif material.integrator == "exponential":
            balance.work += work + float(np.sum(_weighted(bend_weights(z), crossed, moduli * own)))
            balance.dissipated += _weighted(dissipation_weights(z), before / moduli, crossed, moduli * own)
        else:
            balance.work += work
            balance.dissipated += z * self._branches / moduli
        balance.stored = stored

    def state(self) -> dict[str, Array | float]:
        """What a restart needs, in the run's units, besides `memory`."""
        balance = self.balance
        return {
            "work": balance.work,
            "stored": balance.stored,
            "dissipated": balance.dissipated,
            "spring": self._spring,
            "branches": self._branches,
        }

    def restore(self, state: dict[str, Array | float]) -> None:
        """Go on from a `state`."""
        work, stored = float(state["work"]), float(state["stored"])
        self.balance = Balance(work, stored, np.array(state["dissipated"], dtype=np.float64))
        self._spring, self._branches = float(state["spring"]), np.array(state["branches"], dtype=np.float64)


def _weighted(weights: tuple[Array, ...], *terms: Array) -> Array:
    return np.asarray(sum(weight * term for weight, term in zip(weights, terms, strict=True)))

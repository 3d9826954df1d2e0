"""Energy balance of the body: work done on it, energy stored in it, energy dissipated by its branches.

With `<a, b>` the sum over points, branch k stores `<h_k, A^-1 h_k>/(2 G_k)` and dissipates `<h_k, A^-1 h_k>/(G_k tau_k)`
per time; the parallel spring stores `G_inf <u, A^-1 u>/2`. All of them follow from `w = A^-1 du` of each step by products
with the maps that are there anyway, and the dissipation of a step is the exact integral for u linear in time.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..parallel.slab import Array, Slab
from . import loops
from .material import Heights, Zener


@dataclass
class Balance:
    """Sums since the start, in the run's units; `dissipated` has one entry per branch."""

    work: float = 0.0
    stored: float = 0.0
    dissipated: Array = field(default_factory=lambda: np.zeros(0))


def dissipation_weights(z: Array) -> tuple[Array, Array, Array]:
    """Weights of `S = <h, A^-1 h>/G`, `X = <h, w>` and `D = G <du, w>` in the dissipation over a step `z = dt/tau`.

    With h the branch map before the step: the integral of `<h, A^-1 h>/(G tau)` over it, u being linear in time. Small z
    by their series: the closed form of the last loses all digits there.
    """
    e = -np.expm1(-z)
    safe = np.where(z > 0.0, z, 1.0)
    closed = (z - e - 0.5 * e**2) / safe**2
    series = z / 3 - z**2 / 4 + 7 * z**3 / 60 - z**4 / 24
    return 0.5 * e * (2.0 - e), np.where(z > 0.0, e**2 / safe, 0.0), np.where(z < 3e-3, series, closed)


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

    `creep(p, du)` gives `w = A^-1 du` of the step just committed.
    """

    def __init__(self, slab: Slab, material: Zener, creep: Callable[[Array, float, Array], Array]) -> None:
        self.slab, self.material, self.creep = slab, material, creep
        count = len(material.prony.moduli)
        self.balance = Balance(dissipated=np.zeros(count))
        self._spring, self._branches = 0.0, np.zeros(count)  # <u, A^-1 u> and <h_k, A^-1 h_k>

    def advance(self, dt: float, p: Array, alpha: float, p_old: Array | None, alpha_old: float) -> None:
        """After a step to pressure `alpha p` from `alpha_old p_old`; one reduction; collective."""
        material, balance = self.material, self.balance
        moduli, times = material.prony.moduli, material.prony.relaxation_times
        du = material.increment
        w = self.creep(p, dt, du)
        sums = [loops.dot(branch, w) for branch in material.branches]
        work = loops.work(p, alpha, p if p_old is None else p_old, alpha_old, du)
        *products, own, total, work = self.slab.sum(*sums, loops.dot(du, w), loops.dot(material.u, w), work)
        crossed = np.array(products)
        decay, gain = material.coefficients(dt)
        before = self._branches
        self._branches = decay**2 * before + 2 * decay * gain * crossed + gain**2 * own
        self._spring += 2 * total - own
        stored = 0.5 * (material.prony.modulus_inf * self._spring + float(np.sum(self._branches / moduli)))
        if material.integrator == "exponential":
            weights = dissipation_weights(dt / times)
            lost = weights[0] * before / moduli + weights[1] * crossed + weights[2] * moduli * own
        else:
            lost = dt / times * self._branches / moduli
        balance.work += stored - balance.stored if dt == 0.0 else work  # a jump is elastic: nothing is lost in it
        balance.stored = stored
        balance.dissipated += lost

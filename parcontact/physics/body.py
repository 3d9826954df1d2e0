"""What the body remembers: nothing (ElasticBody), or one map per relaxing branch (ZenerBody).

With `G(t) = G_inf + sum_k G_k exp(-t/tau_k)` and the elastic operator A of shear modulus 1, the total pressure obeys

    A p = G_inf u + sum_k h_k,     dh_k/dt = G_k du/dt - h_k/tau_k,     h_k the part of branch k [Pa m].

A step advances `h_k <- decay_k h_k + gain_k (u_new - u)` with, for z = dt/tau_k,

    exponential      decay = exp(-z),     gain = G_k (1 - exp(-z))/z    exact for u linear in time,
    backward-euler   decay = 1/(1 + z),   gain = G_k/(1 + z)            the paper's Eqs. (7)-(9), in another form,

so that `A p = alpha u_new + r`, `alpha = G_inf + sum gain_k`, `r = sum decay_k h_k - (sum gain_k) u`. The contact
problem of a step is then that of an elastic body of modulus alpha under the effective heights `h + r/alpha` (paper,
Eq. 9).

Two kinds of branches have no map (`physics.folding` says which and what it costs): of a memoryless one
`gain (u_new - u)` is all there is, its decay being 0 to the error allowed; a frozen one is the spring `h_k = G_k u`.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np

from ..parallel.slab import Array, Slab, allocate
from . import loops
from .entries import Entry, MapCount, Saved
from .prony import Prony
from .units import Units


@dataclass(frozen=True)
class Heights:
    """Heights of the rigid surface: the map `base` moved by `offset` cells along x (cyclic)."""

    base: Array
    offset: int = 0

    @property
    def parts(self) -> tuple[Array, int]:
        return self.base, self.offset


def elapsed(prony: Prony, dt: float) -> Array:
    """`z = dt/tau` of each branch, at most 1e100 so that nothing overflows."""
    return np.asarray(dt / np.maximum(prony.relaxation_times, 1e-100 * dt))


def coefficients(prony: Prony, integrator: str, dt: float) -> tuple[Array, Array]:
    """`decay` and `gain` of each branch over a step dt; dt = 0 is a jump, in which nothing relaxes."""
    z = elapsed(prony, dt)
    if integrator == "backward-euler":
        return 1.0 / (1.0 + z), prony.moduli / (1.0 + z)
    phi = np.divide(-np.expm1(-z), z, out=np.ones_like(z), where=z > 0.0)
    return np.exp(-z), prony.moduli * phi


Advance = tuple[Array, Array]  # decay and gain of the branches that have a map


@dataclass(frozen=True)
class Trial:
    """A step of a body that has begun: it ends when `commit` consumes it, and is nothing if it is dropped.

    The contact problem of the step is that of an elastic body of modulus `alpha` under the `effective` heights, a map
    that is valid until the next step begins; `advance` is what the branches will have done by the end of the step.
    """

    alpha: float
    effective: Array
    heights: Heights
    advance: Advance | None = None


class ElasticBody:
    """A body of one modulus: remembers nothing and allocates at most the moved heights."""

    def __init__(self, slab: Slab, modulus: float) -> None:
        self.slab, self.modulus = slab, modulus
        self._moved: Array | None = None

    @staticmethod
    def count_maps(moved: bool) -> MapCount:
        """Of a body whose heights are `moved` by an offset, or not."""
        return MapCount(1 if moved else 0)

    def begin(self, dt: float, heights: Heights) -> Trial:
        """A step under the heights themselves; local to this rank."""
        if heights.offset == 0:
            return Trial(self.modulus, heights.base, heights)
        if self._moved is None:
            self._moved = self.slab.empty()
        loops.roll(heights.base, heights.offset, self._moved)
        return Trial(self.modulus, self._moved, heights)

    def commit(self, trial: Trial, displacement: Array) -> None:
        """Nothing to remember."""

    def entries(self, units: Units) -> dict[str, Entry]:
        """None."""
        return {}

    def restore(self, saved: Saved) -> None:
        """Nothing to restore."""


@dataclass(frozen=True)
class _Coefficients:
    """Of a step dt: its modulus, how the kept branches advance, what they and u weigh in the effective heights."""

    dt: float
    alpha: float
    advance: Advance
    weights: tuple[Array, float]


class ZenerBody:
    """Relaxing branches: this rank's rows of one map per branch and of the last displacement.

    Branches are known by their number in `prony`. Those of `kept` have a map each, in that order in `branches`; the
    `memoryless` and `frozen` ones have none. All but the frozen ones are `moving`.

    The advance of a committed step is pending until the next step begins: then one pass over the maps makes it and
    forms the effective heights. Meanwhile the increment of the displacement waits in the map of those heights.
    """

    def __init__(
        self,
        slab: Slab,
        prony: Prony,
        integrator: str,
        memoryless: Collection[int] = (),
        frozen: Collection[int] = (),
    ) -> None:
        self.prony, self.integrator = prony, integrator
        numbers = range(len(prony.moduli))
        self.kept = [k for k in numbers if k not in memoryless and k not in frozen]
        self.moving = [k for k in numbers if k not in frozen]
        self._spring = prony.modulus_inf + float(prony.moduli[list(frozen)].sum())
        self.branches = allocate((len(self.kept), *slab.shape), np.float64, slab.tally)
        self.branches.fill(0.0)
        self.u = slab.zeros()
        self._buffer = slab.zeros()
        self._still: Advance = np.ones(len(self.kept)), np.zeros(len(self.kept))
        self._pending: Advance = self._still
        self._coefficients: _Coefficients | None = None

    @staticmethod
    def count_maps(kept: int) -> MapCount:
        """Of a body with so many branch maps; the others are the displacement and the effective heights."""
        return MapCount(held=kept + 2, saved=kept + 1)

    def elapsed(self, dt: float) -> Array:
        """`z = dt/tau` of each branch."""
        return elapsed(self.prony, dt)

    def coefficients(self, dt: float) -> tuple[Array, Array]:
        """`decay` and `gain` of each branch over a step dt."""
        return coefficients(self.prony, self.integrator, dt)

    def begin(self, dt: float, heights: Heights) -> Trial:
        """A step of modulus alpha under the effective heights `h + r/alpha`, in place of one that has begun and is not
        committed; local to this rank."""
        if self._coefficients is None or self._coefficients.dt != dt:
            self._coefficients = self._coefficients_of(dt)
        step = self._coefficients
        loops.begin(self.branches, *self._pending, self._buffer, *step.weights, self.u, *heights.parts)
        self._pending = self._still
        return Trial(step.alpha, self._buffer, heights, step.advance)

    def _coefficients_of(self, dt: float) -> _Coefficients:
        decay, gain = self.coefficients(dt)
        total = float(gain[self.moving].sum())
        alpha = self._spring + total
        decay, gain = decay[self.kept], gain[self.kept]
        return _Coefficients(dt, alpha, (decay, gain), (decay / alpha, total / alpha))

    def commit(self, trial: Trial, displacement: Array) -> None:
        """End the step: `displacement` is `A p/alpha`, which under the effective heights stands for u; local to this
        rank."""
        assert trial.advance is not None
        loops.commit(displacement, trial.effective, self.u, *trial.heights.parts)
        self._pending = trial.advance

    def take_back(self, u: Array) -> None:
        """Undo the step just committed: `u` is the displacement before it; local to this rank."""
        self.u[...] = u
        self._pending = self._still

    def begin_with(self, u: Array, branches: Iterable[Array]) -> None:
        """Begin with a displacement and the map of each branch of `prony`, in order."""
        self.u[...] = u
        for k, branch in enumerate(branches):
            if k in self.kept:
                self.branches[self.kept.index(k)] = branch
        self._pending = self._still

    @property
    def increment(self) -> Array:
        """`u_new - u` of the step just committed; valid until the next begins."""
        return self._buffer

    def settle(self) -> None:
        """Advance the branch maps now, for somebody who reads them; the run goes on to the same digits."""
        loops.begin(self.branches, *self._pending, self._buffer, self._still[0], 0.0, self.u, self.u, 0)
        self._pending = self._still

    def relaxing(self, seconds: float) -> tuple[Array, float]:
        """What share each of `branches` loses within a time if u is kept, and the modulus G that is left then."""
        share = -np.expm1(-self.elapsed(seconds)[self.kept])
        return share, self._spring + float(self.prony.moduli[self.kept] @ (1.0 - share))

    def entries(self, units: Units) -> dict[str, Entry]:
        """The displacement and the branch maps (those of branches that had none when a checkpoint was written are
        restored without), which branches are frozen, and the branches themselves."""
        return {
            **self.memory(units.height, "m", units.modulus * units.height, "Pa m"),
            "moduli": Entry(self.prony.moduli, units.modulus, "Pa", given=True),
            "relaxation times": Entry(self.prony.relaxation_times, 1.0, "s", given=True),
        }

    def memory(self, unit: float, symbol: str, branch_unit: float, branch_symbol: str) -> dict[str, Entry]:
        """The entries that change, with the units of the displacement and of the branch maps."""
        self.settle()
        frozen = np.array([float(k not in self.moving) for k in range(len(self.prony.moduli))])
        maps = zip(self.kept, self.branches, strict=True)
        branches = {f"branch {k}": Entry(branch, branch_unit, branch_symbol, optional=True) for k, branch in maps}
        return {"displacement": Entry(self.u, unit, symbol), "frozen": Entry(frozen), **branches}

    def restore(self, saved: Saved) -> None:
        """A branch that has no map in `saved` begins: one that was frozen then as `G_k u`, else as 0."""
        self.u[...] = saved["displacement"]
        for k, branch in zip(self.kept, self.branches, strict=True):
            spring = self.prony.moduli[k] * saved["frozen"][k]
            branch[...] = saved[f"branch {k}"] if f"branch {k}" in saved else spring * self.u
        self._pending = self._still

"""The body: elastic, or with relaxing branches, and its memory as data.

With `G(t) = G_inf + sum_k G_k exp(-t/tau_k)` and the elastic operator A of shear modulus 1, the total pressure obeys

    A p = G_inf u + sum_k h_k,     dh_k/dt = G_k du/dt - h_k/tau_k,     h_k the part of branch k [Pa m].

A step advances `h_k <- decay_k h_k + gain_k (u_new - u)` with, for z = dt/tau_k,

    exponential      decay = exp(-z),     gain = G_k (1 - exp(-z))/z    exact for u linear in time,
    backward-euler   decay = 1/(1 + z),   gain = G_k/(1 + z)            the paper's Eqs. (7)-(9), in another form,

so that `A p = alpha u_new + r`, `alpha = G_inf + sum gain_k`, `r = sum decay_k h_k - (sum gain_k) u`. The contact
problem of a step is then that of an elastic body of modulus alpha under the effective heights `h + r/alpha` (paper,
Eq. 9).

A body is what has `begin` and `commit`. What it remembers from one step to the next is a `BodyMemory`, which these take
and return: a step that is dropped leaves the memory from which it began.

Two kinds of branches have no map (`effects.folded_branches` says which and what it costs): of a memoryless one
`gain (u_new - u)` is all there is, its decay being 0 to the error allowed; a frozen one is the spring `h_k = G_k u`.
"""

import math
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, replace

import numpy as np

from ..parallel.slab import Array, Slab, allocate
from . import loops
from .entries import Entry, MapCount, Saved
from .prony import Prony, coefficients, elapsed
from .units import Units


@dataclass(frozen=True)
class Heights:
    """Heights of the rigid surface: the map `base` moved by `offset` cells along x (cyclic)."""

    base: Array
    offset: int = 0

    @property
    def parts(self) -> tuple[Array, int]:
        return self.base, self.offset


Advance = tuple[Array, Array]  # decay and gain of the branches that have a map


@dataclass
class BodyMemory:
    """Memory of a body between two steps: the displacement of its surface, and this rank's rows of its branch maps.

    `displacement` is None where it follows from the pressure and is not at hand. The advance of the branches over the
    last step is `pending`: the pass that begins the next step makes it, with the `increment` of the displacement in
    that step, and forms the effective heights in the map of the latter. This changes how the memory is written, not
    what it means, so that a step may begin from the same memory again. The memories before and after a step share all
    maps but the displacement: the former is no more once a step has begun from the latter.
    """

    displacement: Array | None
    branches: Array
    increment: Array
    pending: Advance


@dataclass(frozen=True)
class Trial:
    """A step of a body that has begun, and is nothing if it is dropped.

    The contact problem of the step is that of an elastic body of modulus `alpha` under the `effective` heights, a map
    that is valid until the next step begins; `advance` is what the branches will have done by the end of the step.
    """

    alpha: float
    effective: Array
    heights: Heights
    advance: Advance


NO_BRANCHES: Advance = np.ones(0), np.zeros(0)
NO_MAP = np.zeros((0, 0))


class ElasticBody:
    """A body of one modulus: remembers nothing and allocates at most the moved heights."""

    branched: "ZenerBody | None" = None
    shortest_time = math.inf

    def __init__(self, slab: Slab, modulus: float) -> None:
        self.slab, self.modulus = slab, modulus
        self._moved: Array | None = None

    @staticmethod
    def count_maps(moved: bool) -> MapCount:
        """Count the maps of a body whose heights are `moved` by an offset, or not."""
        return MapCount(1 if moved else 0)

    def at_rest(self) -> BodyMemory:
        """Return the memory of a body into which nothing has been pressed."""
        return BodyMemory(None, np.zeros((0, *self.slab.shape)), NO_MAP, NO_BRANCHES)

    def start_from(self, memory: BodyMemory, displacement: Array, branches: Iterable[Array]) -> None:
        """Do nothing: the displacement follows from the pressure."""

    def begin(self, memory: BodyMemory, dt: float, heights: Heights) -> Trial:
        """Begin a step under the heights themselves; local to this rank.

        The displacement is that in a map of the solver, which the solve of the step overwrites.
        """
        memory.displacement = None
        if heights.offset == 0:
            return Trial(self.modulus, heights.base, heights, NO_BRANCHES)
        if self._moved is None:
            self._moved = self.slab.empty()
        loops.roll(heights.base, heights.offset, self._moved)
        return Trial(self.modulus, self._moved, heights, NO_BRANCHES)

    def commit(self, memory: BodyMemory, trial: Trial, displacement: Array, out: Array) -> BodyMemory:
        """Return a memory with the displacement, until the next step begins."""
        return replace(memory, displacement=displacement)

    def displacement(self, memory: BodyMemory, of_pressure: Callable[[], Array], alpha: float) -> Array:
        """Return the displacement, found anew from that of the map of p for the pressure `alpha p` if it is not at
        hand; collective."""
        if memory.displacement is None:
            memory.displacement = of_pressure()
            memory.displacement *= alpha / self.modulus  # 1 after a step of this body
        return memory.displacement

    def entries(self, memory: BodyMemory, units: Units) -> dict[str, Entry]:
        return {}

    def restored(self, memory: BodyMemory, saved: Saved) -> BodyMemory:
        return replace(memory, displacement=None)


@dataclass(frozen=True)
class _Coefficients:
    """Coefficients of a step dt: its modulus, how the kept branches advance, their and u's weights in the heights."""

    dt: float
    alpha: float
    advance: Advance
    weights: tuple[Array, float]


class ZenerBody:
    """A body with relaxing branches, which are known by their number in `prony`.

    Those of `kept` have a map each, in that order in the memory; the `memoryless` and `frozen` ones have none. All but
    the frozen ones are `moving`. `shortest_time` [s] is the shortest relaxation time of those kept.
    """

    def __init__(
        self,
        slab: Slab,
        prony: Prony,
        integrator: str,
        memoryless: Collection[int] = (),
        frozen: Collection[int] = (),
    ) -> None:
        self.slab, self.prony, self.integrator = slab, prony, integrator
        self._cold = prony.relaxation_times
        numbers = range(len(prony.moduli))
        self.kept = [k for k in numbers if k not in memoryless and k not in frozen]
        self.moving = [k for k in numbers if k not in frozen]
        self.shortest_time = float(prony.relaxation_times[self.kept].min(initial=math.inf))
        self._spring = prony.modulus_inf + float(prony.moduli[list(frozen)].sum())
        self._still: Advance = np.ones(len(self.kept)), np.zeros(len(self.kept))
        self._coefficients: _Coefficients | None = None

    @staticmethod
    def count_maps(kept: int) -> MapCount:
        """Count the maps of a body with so many branch maps; the others are the displacement and its increment."""
        return MapCount(held=kept + 2, saved=kept + 1)

    @property
    def branched(self) -> "ZenerBody":
        return self

    def set_time_factor(self, factor: float) -> None:
        """Relax from now on with so many times the relaxation times that it was made with."""
        self.prony = self.prony._replace(relaxation_times=self._cold * factor)
        self._coefficients = None

    def elapsed(self, dt: float) -> Array:
        """Return `z = dt/tau` of each branch."""
        return elapsed(self.prony, dt)

    def coefficients(self, dt: float) -> tuple[Array, Array]:
        """Return `decay` and `gain` of each branch over a step dt."""
        return coefficients(self.prony, self.integrator, dt)

    def at_rest(self) -> BodyMemory:
        """Return the memory of a body into which nothing has been pressed, in new maps."""
        branches = allocate((len(self.kept), *self.slab.shape), np.float64, self.slab.tally)
        branches.fill(0.0)
        return BodyMemory(self.slab.zeros(), branches, self.slab.zeros(), self._still)

    def start_from(self, memory: BodyMemory, displacement: Array, branches: Iterable[Array]) -> None:
        """Put a displacement and the map of each branch of `prony`, in order, into the maps of a memory."""
        surface_of(memory)[...] = displacement
        for k, branch in enumerate(branches):
            if k in self.kept:
                memory.branches[self.kept.index(k)] = branch
        memory.pending = self._still

    def begin(self, memory: BodyMemory, dt: float, heights: Heights) -> Trial:
        """Begin a step of modulus alpha under the effective heights `h + r/alpha`, in place of one that has begun from
        the same memory; local to this rank."""
        if self._coefficients is None or self._coefficients.dt != dt:
            self._coefficients = self._coefficients_of(dt)
        step, u = self._coefficients, surface_of(memory)
        loops.begin(memory.branches, *memory.pending, memory.increment, *step.weights, u, *heights.parts)
        memory.pending = self._still
        return Trial(step.alpha, memory.increment, heights, step.advance)

    def _coefficients_of(self, dt: float) -> _Coefficients:
        decay, gain = self.coefficients(dt)
        total = float(gain[self.moving].sum())
        alpha = self._spring + total
        decay, gain = decay[self.kept], gain[self.kept]
        return _Coefficients(dt, alpha, (decay, gain), (decay / alpha, total / alpha))

    def commit(self, memory: BodyMemory, trial: Trial, displacement: Array, out: Array) -> BodyMemory:
        """Return the memory after a step, with its displacement in the map `out`; local to this rank.

        `displacement` is `A p/alpha`, which under the effective heights stands for that of the surface.
        """
        loops.commit(displacement, trial.effective, surface_of(memory), *trial.heights.parts, out)
        return BodyMemory(out, memory.branches, memory.increment, trial.advance)

    def displacement(self, memory: BodyMemory, of_pressure: Callable[[], Array], alpha: float) -> Array:
        return surface_of(memory)

    def settle(self, memory: BodyMemory) -> None:
        """Advance the branch maps now, for somebody who reads them; the run goes on to the same digits."""
        u = surface_of(memory)
        loops.begin(memory.branches, *memory.pending, memory.increment, self._still[0], 0.0, u, u, 0)
        memory.pending = self._still

    def entries(self, memory: BodyMemory, units: Units) -> dict[str, Entry]:
        """Return the entries of the memory, and the branches, which a checkpoint must agree with."""
        return {
            **self.memory_entries(memory, units.height, "m", units.modulus * units.height, "Pa m"),
            "moduli": Entry(self.prony.moduli, units.modulus, "Pa", given=True),
            "relaxation times": Entry(self._cold, 1.0, "s", given=True),
        }

    def memory_entries(
        self, memory: BodyMemory, unit: float, symbol: str, branch_unit: float, branch_symbol: str
    ) -> dict[str, Entry]:
        """Return the displacement, the branch maps and which branches are frozen, with the units of both kinds of maps.

        Maps of branches that had none when a checkpoint was written are restored without.
        """
        self.settle(memory)
        frozen = np.array([float(k not in self.moving) for k in range(len(self.prony.moduli))])
        maps = zip(self.kept, memory.branches, strict=True)
        branches = {f"branch {k}": Entry(branch, branch_unit, branch_symbol, optional=True) for k, branch in maps}
        return {"displacement": Entry(surface_of(memory), unit, symbol), "frozen": Entry(frozen), **branches}

    def restored(self, memory: BodyMemory, saved: Saved) -> BodyMemory:
        """Return the memory that a checkpoint has, whose maps have been read into those of this one.

        A branch without a map in `saved` begins: one that was frozen then as `G_k u`, else as 0.
        """
        for k, branch in zip(self.kept, memory.branches, strict=True):
            if f"branch {k}" not in saved:
                branch[...] = self.prony.moduli[k] * saved["frozen"][k] * surface_of(memory)
        return replace(memory, pending=self._still)


def surface_of(memory: BodyMemory) -> Array:
    """Return the displacement of a body that remembers it."""
    assert memory.displacement is not None
    return memory.displacement


Body = ElasticBody | ZenerBody

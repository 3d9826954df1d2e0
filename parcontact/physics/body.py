"""The body, elastic or with relaxing branches, and its memory.

With the relaxation function `G(t) = G_inf + sum_k G_k exp(-t/tau_k)`, the elastic operator A of shear modulus 1, and
the displacement u of the surface, the total pressure p satisfies

    A p = G_inf u + sum_k h_k,     dh_k/dt = G_k du/dt - h_k/tau_k,     h_k the part of branch k [Pa m].

A step advances `h_k <- decay_k h_k + gain_k du + back_k du_before` with the increments du of u in this step and
du_before in the step before. For z = dt/tau_k and phi(z) = (1 - exp(-z))/z,

    exponential          decay = exp(-z),     gain = G_k (phi + kappa q),   back = -G_k kappa q r,
    exponential-linear   decay = exp(-z),     gain = G_k phi,               back = 0,
    backward-euler       decay = 1/(1 + z),   gain = G_k/(1 + z),           back = 0.

The first rule is exact for u quadratic in time through the last two values and the new one: with r = dt/dt_before,

    u(s) = u + s du + s (s - 1) kappa/2 (du - r du_before),   kappa = 2 r/(1 + r),   0 <= s <= 1,
    q(z) = (1 + exp(-z))/(2 z) - (1 - exp(-z))/z^2.

After a jump and in the first step of a stage, kappa is 0. The second rule is exact for u linear in time. The third
is equivalent to Eqs. (7)-(9) of the paper (named in `physics.prony`). With `alpha = G_inf + sum gain_k` and the map
`m = sum decay_k h_k - (sum gain_k) u + (sum back_k) du_before`, it follows that `A p = alpha u_new + m`: a step is a
contact problem of an elastic body of modulus alpha with the effective heights `h + m/alpha` (paper, Eq. 9), where h are
the heights of the rigid surface. Displacements belong to points of the body, not of the moving surface.

A body has the methods `begin` and `commit`, which take and return a `BodyMemory`; after a dropped step, the memory from
which the step began is still valid. A step of length 0 is a jump of the load, without relaxation. A body without
relaxing branches (`branched` is None) may have a method `time_error(memory, trial, dt)`, which returns the relative
error that the length of a step causes.

For two kinds of branches the map h_k is not stored (`effects.branches` selects them and bounds the error):
memoryless branches, for which `h_k = gain du + back du_before`, and frozen branches, which are springs `h_k = G_k u`.
"""

import math
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, replace

import numpy as np

from ..parallel.slab import Array, Slab
from . import loops
from .prony import Advance, Prony, coefficients, elapsed
from .records import Entry, Saved, Units


@dataclass(frozen=True)
class MovedHeights:
    """Heights of the rigid surface: the map `base`, shifted by `offset` cells along x. Cells beyond the edge of the box
    come in again at the other edge."""

    base: Array
    offset: int = 0

    @property
    def parts(self) -> tuple[Array, int]:
        return self.base, self.offset


@dataclass
class BodyMemory:
    """Memory of a body between two steps, on the rows of this rank: the displacement u of its surface, the `increment`
    of u in the last step, and the branch maps.

    `displacement` is None if it must be computed from the pressure. `pending` holds the coefficients by which the
    branch maps advance over the last step. The next `begin` makes this advance, from the increments of u in the last
    step and in the step before (map `before`), and then overwrites the map `before` by the effective heights. If this
    next step is dropped, another step may begin from the same memory. The memories at the start and at the end of a
    step share all maps but the displacement: once a step has begun from the memory at the end, the memory at the start
    is invalid.
    """

    displacement: Array | None
    branches: Array
    increment: Array
    before: Array
    pending: Advance


@dataclass(frozen=True)
class Trial:
    """A step of a body that has begun. To drop the step, nothing need be called.

    The contact problem of the step is that of an elastic body of modulus `alpha` with the `effective` heights, a map
    that is valid until the next step begins. `heights` are the heights of the rigid surface. `advance` has the
    coefficients of the branches over the step.
    """

    alpha: float
    effective: Array
    heights: MovedHeights
    advance: Advance


NO_BRANCHES = Advance(np.ones(0), np.zeros(0), np.zeros(0))
NO_MAP = np.zeros((0, 0))


class ElasticBody:
    """A body of one shear modulus, without memory. The only map that it allocates is that of moved heights."""

    branched: "ZenerBody | None" = None
    shortest_time = math.inf  # of the relaxation [s]

    def __init__(self, slab: Slab, modulus: float, moves: bool = True) -> None:
        """Make a body of shear `modulus`; `moves` is False if the heights never move by an offset."""
        self.slab, self.modulus = slab, modulus
        self._moved = slab.empty() if moves else None

    def at_rest(self) -> BodyMemory:
        """Return the memory of a body at rest."""
        return BodyMemory(None, np.zeros((0, *self.slab.shape)), NO_MAP, NO_MAP, NO_BRANCHES)

    def start_from(self, memory: BodyMemory, displacement: Array, branches: Iterable[Array]) -> None:
        """Do nothing: the displacement follows from the pressure."""

    def begin(self, memory: BodyMemory, dt: float, heights: MovedHeights, growth: float = 0.0) -> Trial:
        """Begin a step; local to this rank. The effective heights are the `heights` themselves, moved by their
        offset; `dt` and `growth` have no effect. The displacement of `memory` is dropped, as the next solve
        overwrites its map."""
        memory.displacement = None
        if heights.offset == 0:
            return Trial(self.modulus, heights.base, heights, NO_BRANCHES)
        assert self._moved is not None
        loops.roll(heights.base, heights.offset, self._moved)
        return Trial(self.modulus, self._moved, heights, NO_BRANCHES)

    def commit(self, memory: BodyMemory, trial: Trial, displacement: Array, out: Array) -> BodyMemory:
        """Return the memory after a step that ends at this displacement. The memory is valid until the next step
        begins; `out` is not used."""
        return replace(memory, displacement=displacement)

    def displacement(self, memory: BodyMemory, of_pressure: Callable[[], Array], alpha: float) -> Array:
        """Return the displacement u under the pressure `alpha p`; collective. If `memory` no longer holds u, u is
        `alpha/modulus` times `of_pressure()`, the displacement of a body of modulus 1 under the map p."""
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
    """Coefficients of a step dt: its modulus, the advance of the kept branches, and the weights of these, of u and of
    the last increment in the effective heights."""

    dt: float
    growth: float
    alpha: float
    advance: Advance
    weights: tuple[Array, float, float]


class ZenerBody:
    """A body whose relaxing branches are the terms of `prony`.

    Branches are given by their indices in `prony`. The arguments `memoryless` and `frozen` are the branches of these
    two kinds (`physics.body`), which have no map. Each branch of the list `kept` has a map, in the order of this list.
    The list `moving` has all branches that are not frozen. `shortest_time` [s] is the shortest relaxation time of the
    branches in `kept`.
    """

    def __init__(
        self, slab: Slab, prony: Prony, integrator: str, memoryless: Collection[int] = (), frozen: Collection[int] = ()
    ) -> None:
        self.slab, self.prony, self.integrator = slab, prony, integrator
        self._cold = prony.relaxation_times
        numbers = range(len(prony.moduli))
        self.kept = [k for k in numbers if k not in memoryless and k not in frozen]
        self.moving = [k for k in numbers if k not in frozen]
        self.shortest_time = float(prony.relaxation_times[self.kept].min(initial=math.inf))
        self._spring = prony.modulus_inf + float(prony.moduli[list(frozen)].sum())
        none = np.zeros(len(self.kept))
        self._still = Advance(np.ones(len(self.kept)), none, none)
        self._coefficients: _Coefficients | None = None
        self.time_factor = 1.0

    @property
    def branched(self) -> "ZenerBody":
        return self

    def set_time_factor(self, factor: float) -> None:
        """Multiply the original relaxation times by `factor` in all further steps."""
        self.prony, self.time_factor = self.prony._replace(relaxation_times=self._cold * factor), factor
        self._coefficients = None

    def elapsed(self, dt: float) -> Array:
        """Return `z = dt/tau`, the length of a step divided by the relaxation time, for each branch."""
        return elapsed(self.prony, dt)

    def coefficients(self, dt: float, growth: float = 0.0) -> Advance:
        """Return the coefficients of all branches for a step of the length dt [s], which is `growth` times the length
        of the step before."""
        return coefficients(self.prony, self.integrator, dt, growth)

    def at_rest(self) -> BodyMemory:
        """Return the memory of a body at rest, in new maps."""
        branches = self.slab.zeros(maps=(len(self.kept),))
        return BodyMemory(self.slab.zeros(), branches, self.slab.zeros(), self.slab.zeros(), self._still)

    def start_from(self, memory: BodyMemory, displacement: Array, branches: Iterable[Array]) -> None:
        """Put a displacement and branch maps into `memory`. `branches` yields the map h_k of every term of `prony`, in
        order; maps of branches that are not in `kept` are skipped."""
        surface_of(memory)[...] = displacement
        for k, branch in enumerate(branches):
            if k in self.kept:
                memory.branches[self.kept.index(k)] = branch
        memory.pending = self._still

    def begin(self, memory: BodyMemory, dt: float, heights: MovedHeights, growth: float = 0.0) -> Trial:
        """Begin a step of modulus `alpha`; local to this rank. The module states its effective heights. The new step
        replaces any step that has begun from the same memory.

        `growth` is dt divided by the length of the step before. `growth` is 0 after a jump and in the first step of a
        stage.
        """
        if self._coefficients is None or (self._coefficients.dt, self._coefficients.growth) != (dt, growth):
            self._coefficients = self._coefficients_of(dt, growth)
        step, u = self._coefficients, surface_of(memory)
        maps = memory.increment, memory.before
        loops.begin(memory.branches, *memory.pending, *maps, *step.weights, u, *heights.parts)
        memory.pending = self._still
        return Trial(step.alpha, memory.before, heights, step.advance)

    def _coefficients_of(self, dt: float, growth: float) -> _Coefficients:
        decay, gain, back = self.coefficients(dt, growth)
        total, past = float(gain[self.moving].sum()), float(back[self.moving].sum())
        alpha = self._spring + total
        advance = Advance(decay[self.kept], gain[self.kept], back[self.kept])
        return _Coefficients(dt, growth, alpha, advance, (advance.decay / alpha, total / alpha, past / alpha))

    def commit(self, memory: BodyMemory, trial: Trial, displacement: Array, out: Array) -> BodyMemory:
        """Return the memory after a step, with its displacement in the map `out`; local to this rank. `displacement` is
        `A p/alpha`, the displacement relative to the effective heights."""
        loops.commit(displacement, trial.effective, surface_of(memory), *trial.heights.parts, out)
        return BodyMemory(out, memory.branches, trial.effective, memory.increment, trial.advance)

    def displacement(self, memory: BodyMemory, of_pressure: Callable[[], Array], alpha: float) -> Array:
        return surface_of(memory)

    def advance_branches(self, memory: BodyMemory) -> None:
        """Advance the branch maps to the end of the last step, so that they can be read. Later steps give the same
        results as without this call."""
        if self.slab.only_counts:
            return
        u = surface_of(memory)
        maps = memory.increment, memory.before
        loops.begin(memory.branches, *memory.pending, *maps, self._still.decay, 0.0, 0.0, u, u, 0)
        memory.pending = self._still

    def entries(self, memory: BodyMemory, units: Units) -> dict[str, Entry]:
        """Return the checkpoint entries: the memory, and the moduli and relaxation times, which must equal those of the
        body that reads the checkpoint."""
        return {
            **self.memory_entries(memory, units.height, "m", units.modulus * units.height, "Pa m"),
            "moduli": Entry(self.prony.moduli, units.modulus, "Pa", given=True),
            "relaxation times": Entry(self._cold, 1.0, "s", given=True),
        }

    def memory_entries(
        self, memory: BodyMemory, unit: float, symbol: str, branch_unit: float, branch_symbol: str
    ) -> dict[str, Entry]:
        """Return the checkpoint entries of the displacement, its last increment, the branch maps, and which branches
        are frozen.

        `unit` is the SI value of the unit of displacements, and `symbol` is the name of the SI unit; `branch_unit` and
        `branch_symbol` are the same for branch maps. Branch maps are optional, as a branch may have had no map when a
        checkpoint was written.
        """
        self.advance_branches(memory)
        frozen = np.array([float(k not in self.moving) for k in range(len(self.prony.moduli))])
        maps = zip(self.kept, memory.branches, strict=True)
        branches = {f"branch {k}": Entry(branch, branch_unit, branch_symbol, optional=True) for k, branch in maps}
        increment = Entry(memory.increment, unit, symbol)
        surface = {"displacement": Entry(surface_of(memory), unit, symbol), "increment": increment}
        return {**surface, "frozen": Entry(frozen), **branches}

    def restored(self, memory: BodyMemory, saved: Saved) -> BodyMemory:
        """Return the memory of a checkpoint. The saved maps have already been read into `memory`. A branch without a
        map in `saved` starts as `G_k u` if it was frozen, else as 0."""
        for k, branch in zip(self.kept, memory.branches, strict=True):
            if f"branch {k}" not in saved:
                branch[...] = self.prony.moduli[k] * saved["frozen"][k] * surface_of(memory)
        return replace(memory, pending=self._still)


def surface_of(memory: BodyMemory) -> Array:
    """Return the surface displacement from the memory of a body that stores it."""
    assert memory.displacement is not None
    return memory.displacement


Body = ElasticBody | ZenerBody


def remembers(body: Body) -> bool:
    """Return True unless the body is an `ElasticBody`, the only body without memory."""
    return type(body) is not ElasticBody


def states_errors(body: Body) -> bool:
    """Return True if the error of a time step can be computed: the body has no memory, has branches, or has the method
    `time_error`."""
    return not remembers(body) or body.branched is not None or hasattr(body, "time_error")
